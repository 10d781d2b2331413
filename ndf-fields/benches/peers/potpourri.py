"""What potpourri3d (geometry-central) finds on a mesh: the peer of `cargo bench -p ndf-fields --bench peers`.

    python3 -m venv VENV && VENV/bin/pip install numpy potpourri3d

Usage: potpourri.py FOLDER. The folder holds raw little-endian arrays: `positions` (f64), `faces` (u32), `source` (u32), `vector` (f64, three
coordinates, tangent at the source), `curves` (u32: a count of vertices, then so many, and so on), `two` (u32, two vertices) and `ends`
(f64, vectors at the source that geodesics follow). Leaves there `transport`, `extend`, `log`, `signed` and `traces`, f64, vectors
embedded in space. Prints the version."""

import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import potpourri3d

folder = Path(sys.argv[1])
V = np.fromfile(folder / "positions", np.float64).reshape(-1, 3)
F = np.fromfile(folder / "faces", np.uint32).reshape(-1, 3).astype(np.int64)
source = int(np.fromfile(folder / "source", np.uint32)[0])
vector = np.fromfile(folder / "vector", np.float64)
two = [int(v) for v in np.fromfile(folder / "two", np.uint32)]
ends = np.fromfile(folder / "ends", np.float64).reshape(-1, 3)
numbers = [int(v) for v in np.fromfile(folder / "curves", np.uint32)]
curves = []
while numbers:
    count, numbers = numbers[0], numbers[1:]
    curves.append([(v, []) for v in numbers[:count]])
    numbers = numbers[count:]


def leave(name, values):
    np.ascontiguousarray(values, np.float64).tofile(folder / name)


solver = potpourri3d.MeshVectorHeatSolver(V, F)
X, Y, _ = solver.get_tangent_frames()


def embedded(pairs, at=slice(None)):
    return pairs[:, :1] * X[at] + pairs[:, 1:] * Y[at]


plane = [float(vector @ X[source]), float(vector @ Y[source])]
leave("transport", embedded(solver.transport_tangent_vector(source, plane)))
leave("extend", solver.extend_scalar(two, [1.0, 3.0]))
leave("log", embedded(solver.compute_log_map(source), [source]))
# Theirs is positive on the left.
leave("signed", -potpourri3d.MeshSignedHeatSolver(V, F).compute_distance(curves, [True] * len(curves)))
tracer = potpourri3d.GeodesicTracer(V, F)
leave("traces", [tracer.trace_geodesic_from_vertex(source, end)[-1] for end in ends])
print(version("potpourri3d"))
