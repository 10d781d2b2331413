"""pygeodesic's exact distances (MMP, by D. Kirsanov) timed on request: a peer of `cargo xtask geodesics`.

    python3 -m venv VENV && VENV/bin/pip install numpy pygeodesic

Usage: mmp.py FOLDER. The folder holds positions and faces as raw little-endian arrays. Prints a JSON line with
versions; then for every line on standard input a JSON line with the wall seconds of the distances of all vertices from
vertex 0, and the largest."""

import json
import sys
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
from pygeodesic.geodesic import PyGeodesicAlgorithmExact

folder = Path(sys.argv[1])
positions = np.fromfile(folder / "positions.f64", np.float64).reshape(-1, 3)
faces = np.fromfile(folder / "faces.u32", np.uint32).astype(np.int32).reshape(-1, 3)
algorithm = PyGeodesicAlgorithmExact(positions, faces)


def answer(**values):
    print(json.dumps(values), flush=True)


answer(pygeodesic=version("pygeodesic"))
for _ in sys.stdin:
    start = time.perf_counter()
    distances, _ = algorithm.geodesicDistances(np.array([0]), None)
    seconds = time.perf_counter() - start
    answer(seconds=seconds, max=float(distances[distances < 1e90].max()))
