"""Simplifies meshes and compresses them with Draco on request: a peer of `cargo xtask compression`.

    python3 -m venv VENV && VENV/bin/pip install numpy DracoPy fast-simplification

Usage: draco.py FOLDER. Prints a JSON line with versions, then one for every line on standard input. Meshes are raw
little-endian arrays in the folder, positions NAME.f64 and faces NAME.u32.

    simplify FROM TO FACES   decimates with fast-simplification, as gently as leads to so few faces
    compress FROM TO BITS    compresses by edgebreaker at Draco's best level (10) with so many bits a coordinate, writes
                             what comes out again as TO, and answers with the bytes"""

import json
import sys
from importlib.metadata import version
from pathlib import Path

import DracoPy
import fast_simplification
import numpy as np

folder = Path(sys.argv[1])


def answer(**values):
    print(json.dumps(values), flush=True)


def read(name):
    points = np.fromfile(folder / f"{name}.f64", np.float64).reshape(-1, 3)
    return points, np.fromfile(folder / f"{name}.u32", np.uint32).reshape(-1, 3)


def write(name, points, faces):
    np.asarray(points, np.float64).tofile(folder / f"{name}.f64")
    np.asarray(faces, np.uint32).tofile(folder / f"{name}.u32")


def simplify(source, target, count):
    points, faces = read(source)
    # Its thresholds are lengths, for a mesh of about unit size.
    least, size = points.min(axis=0), np.ptp(points, axis=0).max()
    unit = ((points - least) / size).astype(np.float32)
    for aggression in range(1, 11):
        points, simplified = fast_simplification.simplify(
            unit, faces.astype(np.int32), target_count=count, agg=aggression
        )
        if len(simplified) <= 1.01 * count:
            break
    write(target, points.astype(np.float64) * size + least, simplified)
    answer(faces=len(simplified), aggression=aggression)


def compress(source, target, bits):
    stream = DracoPy.encode(*read(source), quantization_bits=bits, compression_level=10)
    mesh = DracoPy.decode(stream)
    write(target, mesh.points, mesh.faces)
    answer(bytes=len(stream))


answer(**{name: version(name) for name in ("DracoPy", "fast-simplification")})
for line in sys.stdin:
    command, source, target, number = line.split()
    {"simplify": simplify, "compress": compress}[command](source, target, int(number))
