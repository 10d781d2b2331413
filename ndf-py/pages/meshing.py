"""An isosurface with even triangles."""

import numpy as np
import ndf


def rounded_box(p):
    q = np.abs(p) - [0.6, 0.4, 0.3]
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0) - 0.2


V, F = ndf.marching_cubes(rounded_box, ([-1, -1, -1], [1, 1, 1]), grid=64)
coarse, faces, births = ndf.decimate(V, F, faces=1000)
V, F = ndf.remesh(V, F, edge_length=0.08)
view = ["--wireframe"]
