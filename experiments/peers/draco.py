"""Sizes of Draco on request: a peer of `cargo xtask compression`.

    python3 -m venv VENV && VENV/bin/pip install numpy DracoPy

Usage: draco.py FOLDER. Prints a JSON line; then for every line on standard input, the name of a mesh in the folder, whose
positions and faces are raw little-endian arrays NAME.f64 and NAME.u32, compresses it with 11 bits a coordinate, by
edgebreaker (level 7) and sequentially (level 0), writes what comes out of the first as NAME.decoded.f64 and
NAME.decoded.u32, and prints a JSON line with both sizes."""

import json
import sys
from importlib.metadata import version
from pathlib import Path

import DracoPy
import numpy as np

folder = Path(sys.argv[1])


def answer(**values):
    print(json.dumps(values), flush=True)


answer(DracoPy=version("DracoPy"))
for line in sys.stdin:
    name = line.strip()
    points = np.fromfile(folder / f"{name}.f64", np.float64).reshape(-1, 3)
    faces = np.fromfile(folder / f"{name}.u32", np.uint32).reshape(-1, 3)
    edgebreaker, sequential = (
        DracoPy.encode(points, faces, quantization_bits=11, compression_level=level) for level in (7, 0)
    )
    mesh = DracoPy.decode(edgebreaker)
    np.asarray(mesh.points, np.float64).tofile(folder / f"{name}.decoded.f64")
    np.asarray(mesh.faces, np.uint32).tofile(folder / f"{name}.decoded.u32")
    answer(edgebreaker=len(edgebreaker), sequential=len(sequential))
