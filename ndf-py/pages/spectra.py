"""An eigenmode of the Laplacian."""

import numpy as np
import ndf


def blob(p):
    return np.linalg.norm(p * [1, 1.3, 1.3], axis=1) - 0.8 - 0.12 * np.sin(7 * p).prod(axis=1)


V, F = ndf.marching_cubes(blob, ([-1.1] * 3, [1.1] * 3), grid=80)
w, phi = ndf.spectrum(V, F, k=20)
u = phi[:, 17]
