"""A scalar that is stored with the model, at the vertices of a mesh that was extracted of it."""

import numpy as np
import ndf


def pillow(p):
    return (np.abs(p) ** 4).sum(axis=1) ** 0.25 - 0.9


V, F = ndf.marching_cubes(pillow, ([-1, -1, -1], [1, 1, 1]), grid=64)
model = ndf.fit(V, F, base_faces=1000)
model.add_scalars({"waves": np.sin(9 * V[:, 0]) * np.cos(9 * V[:, 2])}, V, F)

V, F, face, bary = model.extract_places(edge_length=0.03)
u = model.eval_scalars("waves", face, bary)
