"""How far a decimated mesh is from the mesh that it was made of, at each of its vertices."""

import numpy as np
import ndf


def torus(p):
    return np.hypot(np.hypot(p[:, 0], p[:, 2]) - 0.65, p[:, 1]) - 0.3


V, F = ndf.marching_cubes(torus, ([-1, -0.4, -1], [1, 0.4, 1]), grid=80)
V2, F2, births = ndf.decimate(V, F, faces=600)
print(ndf.measure(V, F, V2, F2)["hausdorff"])

nearest, face, bary = ndf.closest_point(V2, F2, V)
u = np.linalg.norm(V - nearest, axis=1)
