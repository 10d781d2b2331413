"""What the page shows at first; there it is cut to other edge lengths, and distances and modes are computed."""

import numpy as np
import ndf


def torus(p):
    return np.hypot(np.hypot(p[:, 0], p[:, 1]) - 0.7, p[:, 2]) - 0.28


V, F = ndf.marching_cubes(torus, ([-1, -1, -0.4], [1, 1, 0.4]), grid=64)
model = ndf.fit(V, F, base_faces=500)
page = model.show(edge_length=0.1)                # in a notebook, or in a browser
page.save("torus.html")
V, F = model.extract(edge_length=0.1)
view = ["--wireframe"]
