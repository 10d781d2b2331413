"""Simplifies meshes and compresses them with Draco on request: a peer of `cargo xtask compression`.

    python3 -m venv VENV && VENV/bin/pip install numpy DracoPy fast-simplification

Usage: draco.py FOLDER. Prints a JSON line with versions, then one for every line on standard input. Meshes are raw
little-endian arrays in the folder, positions NAME.f64 and faces NAME.u32.

    simplify FROM TO FACES   decimates with fast-simplification, as gently as leads to so few faces
    compress FROM TO BITS LEVEL
                             compresses with so many bits a coordinate at a level of Draco's (10: the best, by edgebreaker; 0:
                             sequential connectivity), writes what comes out again as TO, and answers with the bytes and the
                             seconds of encoding and decoding"""

import json
import sys
import time
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


def compress(source, target, bits, level):
    arrays = read(source)
    start = time.perf_counter()
    stream = DracoPy.encode(*arrays, quantization_bits=bits, compression_level=level)
    encoded = time.perf_counter()
    mesh = DracoPy.decode(stream)
    decoded = time.perf_counter()
    write(target, mesh.points, mesh.faces)
    answer(bytes=len(stream), encoding=encoded - start, decoding=decoded - encoded)


answer(**{name: version(name) for name in ("DracoPy", "fast-simplification")})
for line in sys.stdin:
    command, source, target, *numbers = line.split()
    {"simplify": simplify, "compress": compress}[command](source, target, *map(int, numbers))
