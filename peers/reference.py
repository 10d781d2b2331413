"""Reference values for the tests of ndf-geodesic and ndf-spectral, by programs that share no code with this repository:
exact distances by pygeodesic (Kirsanov's implementation of Mitchell, Mount and Papadimitriou), distances by the heat
method by potpourri3d (geometry-central), and eigenvalues by SciPy of the matrices of libigl and robust_laplacian.

The meshes are made by formulas that tests/common/mod.rs of either crate repeats. Writes reference.json beside this file.

    python -m venv venv && venv/bin/pip install numpy scipy libigl pygeodesic potpourri3d robust_laplacian
    venv/bin/python peers/reference.py
"""

import json
from importlib.metadata import version
from pathlib import Path

import igl
import numpy as np
import potpourri3d
import pygeodesic.geodesic as geodesic
import robust_laplacian
from scipy.sparse.linalg import eigsh

MODES = 20
# Distances are written for every 29th vertex.
STRIDE = 29


def torus(m=48, n=20):
    """A closed surface with a wavy tube."""
    V = []
    for j in range(n):
        for i in range(m):
            u, v = 2 * np.pi * i / m, 2 * np.pi * j / n
            r = 0.4 * (1 + 0.3 * np.sin(3 * u + 2 * v))
            V.append([(1 + r * np.cos(v)) * np.cos(u), (1 + r * np.cos(v)) * np.sin(u), r * np.sin(v)])
    at = lambda i, j: i % m + m * (j % n)
    return np.array(V), faces(at, m, n)


def sheet(m=40, n=25):
    """An open surface with long thin triangles."""
    V = []
    for j in range(n):
        for i in range(m):
            x, y = i / (m - 1), j / (n - 1)
            V.append([4 * x, y, 0.3 * np.sin(5 * x) * np.cos(4 * y)])
    return np.array(V), faces(lambda i, j: i + m * j, m - 1, n - 1)


def comb(m=40, n=25):
    """The sheet with a fin along its middle, where three faces meet at every edge."""
    V, F = sheet(m, n)
    spine = [i + m * (n // 2) for i in range(m)]
    fin = [len(V) + i for i in range(m)]
    V = np.concatenate([V, V[spine] + [0, 0.05, 0.3]])
    for i in range(m - 1):
        F = np.concatenate([F, [[spine[i], spine[i + 1], fin[i]], [fin[i], spine[i + 1], fin[i + 1]]]])
    return V, F


def faces(at, m, n):
    F = []
    for j in range(n):
        for i in range(m):
            F.append([at(i, j), at(i + 1, j), at(i + 1, j + 1)])
            F.append([at(i, j), at(i + 1, j + 1), at(i, j + 1)])
    return np.array(F)


def distances(V, F, sources):
    exact, _ = geodesic.PyGeodesicAlgorithmExact(V, F).geodesicDistances(np.array(sources), None)
    heat = potpourri3d.MeshHeatMethodDistanceSolver(V, F).compute_distance_multisource(sources)
    # Their mean over the sources is 0; here the lowest value at a source is.
    heat -= heat[sources].min()
    return {
        "sources": sources,
        "exact": {"max": exact.max(), "sum": exact.sum(), "at": exact[::STRIDE].tolist()},
        "heat": {"max": heat.max(), "at": heat[::STRIDE].tolist()},
    }


def eigenvalues(L, M):
    return np.sort(eigsh(L.tocsc(), MODES, M.tocsc(), sigma=-1e-3)[0]).tolist()


def plain(V, F):
    """Cotangents of the triangles as they are."""
    return eigenvalues(-igl.cotmatrix(V, F), igl.massmatrix(V, F, igl.MASSMATRIX_TYPE_BARYCENTRIC))


def tufted(V, F):
    """The intrinsic Delaunay triangulation of the tufted cover."""
    return eigenvalues(*robust_laplacian.mesh_laplacian(V, F, mollify_factor=0))


reference = {
    "made_by": {name: version(name) for name in ["pygeodesic", "potpourri3d", "libigl", "robust_laplacian", "scipy"]},
    "stride": STRIDE,
}
for name, (V, F) in {"torus": torus(), "sheet": sheet(), "comb": comb()}.items():
    entry = {"vertices": len(V), "faces": len(F), "plain": plain(V, F), "tufted": tufted(V, F)}
    if name != "comb":
        entry["distances"] = [distances(V, F, sources) for sources in ([0], [7, 500, 503])]
    reference[name] = entry
path = Path(__file__).with_name("reference.json")
path.write_text(json.dumps(reference, indent=1) + "\n")
