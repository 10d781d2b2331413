"""Exact distances from a point, with lines of equal distance."""

import numpy as np
import ndf


def torus(p):
    return np.hypot(np.hypot(p[:, 0], p[:, 1]) - 0.7, p[:, 2]) - 0.28


V, F = ndf.marching_cubes(torus, ([-1, -1, -0.4], [1, 1, 0.4]), grid=80)
solver = ndf.GeodesicSolver(V, F)
source = int(V[:, 0].argmax())
u = solver.distance(source)
path = solver.path(source, int(V[:, 0].argmin()))
print(path.length, len(path.points))
view = ["--isolines", "20"]
