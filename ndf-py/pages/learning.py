"""The mesh that is extracted of a model of 9 kB, which was learned from an isosurface."""

import numpy as np
import ndf


def bumpy_torus(p):
    bumps = 0.04 * np.sin(11 * p[:, 0]) * np.sin(11 * p[:, 1]) * np.sin(11 * p[:, 2])
    return np.hypot(np.hypot(p[:, 0], p[:, 1]) - 0.65, p[:, 2]) - 0.28 - bumps


V, F = ndf.marching_cubes(bumpy_torus, ([-1, -1, -0.4], [1, 1, 0.4]), grid=96)
model = ndf.fit(V, F, size=9000)
V, F = model.extract(edge_length=0.05)
view = ["--wireframe"]
