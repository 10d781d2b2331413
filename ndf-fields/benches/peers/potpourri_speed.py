"""How long potpourri3d (geometry-central) takes on a mesh: a peer of `cargo bench -p ndf-fields --bench peers -- --speed`.

Usage: potpourri_speed.py FOLDER. The folder holds raw little-endian arrays: `positions`, `direction` (f64), `faces`, `source`, `target` and
`curves`, of two vertices each (u32). Leaves there `seconds`, in the order of the rows of speed.rs, and `distances`, `path` (a length) and
`end` (a point), f64. Prints the version."""

import sys
import time
from importlib.metadata import version
from pathlib import Path
from statistics import median

import numpy as np
import potpourri3d

REPEATS = 3

folder = Path(sys.argv[1])
V = np.fromfile(folder / "positions", np.float64).reshape(-1, 3)
F = np.fromfile(folder / "faces", np.uint32).reshape(-1, 3).astype(np.int64)
source, target = (int(np.fromfile(folder / name, np.uint32)[0]) for name in ("source", "target"))
ends = np.fromfile(folder / "curves", np.uint32).reshape(-1, 2)
curves = [[(int(v), []) for v in pair] for pair in ends]
direction = np.fromfile(folder / "direction", np.float64)


def timed(work):
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def repeated(work):
    runs = [timed(work) for _ in range(REPEATS)]
    return median(seconds for seconds, _ in runs), runs[0][1]


heat_factors, heat = timed(lambda: potpourri3d.MeshHeatMethodDistanceSolver(V, F))
distance, distances = repeated(lambda: heat.compute_distance(source))


def transport():
    return solver.transport_tangent_vector(source, [1.0, 0.0])


def logarithm():
    return solver.compute_log_map(source, strategy="VectorHeat")


# Matrices are factored when they are first needed.
construction, solver = timed(lambda: potpourri3d.MeshVectorHeatSolver(V, F))
cold = construction + timed(transport)[0] + timed(logarithm)[0]
transported, mapped = repeated(transport)[0], repeated(logarithm)[0]
extended = repeated(lambda: solver.extend_scalar([source, len(V) - 1], [1.0, 3.0]))[0]
signed = timed(lambda: potpourri3d.MeshSignedHeatSolver(V, F).compute_distance(curves, [True] * len(curves)))[0]


def flips():
    return potpourri3d.EdgeFlipGeodesicSolver(V, F)


flipped, path = timed(lambda: flips().find_geodesic_path(source, target))
flipper = flips()
again = repeated(lambda: flipper.find_geodesic_path(source, target))[0]
tracer = potpourri3d.GeodesicTracer(V, F)
straightest, trace = repeated(lambda: tracer.trace_geodesic_from_face(0, [1 / 3, 1 / 3, 1 / 3], direction))

factors = cold - transported - mapped
none = np.nan
seconds = [heat_factors, distance, factors, transported, extended, mapped, signed, none, none, flipped, again, straightest]
for name, values in {
    "seconds": seconds,
    "distances": distances,
    "path": [np.linalg.norm(np.diff(path, axis=0), axis=1).sum()],
    "end": trace[-1],
}.items():
    np.asarray(values, np.float64).tofile(folder / name)
print(version("potpourri3d"))
