"""The error protocol of ndf::evaluate, once more and independently: the peer of `cargo xtask reproduce --check-protocol`.

    python3 -m venv VENV && VENV/bin/pip install numpy scipy libigl pygeodesic

Usage: protocol.py FOLDER. The folder holds two meshes as raw little-endian arrays, truth and candidate, positions NAME.f64 and faces
NAME.u32. Prints a JSON line with versions; then for every line on standard input, "vertices" or "area", a JSON line with the errors of the candidate, means of which are
over the vertices of the truth or over its area.

Closest points are libigl's, distances pygeodesic's (MMP, by D. Kirsanov), matrices libigl's, modes SciPy's. A source inside of a
face or an edge becomes a vertex: faces are split there, which leaves the surface what it is."""

import json
import sys
from importlib.metadata import version
from pathlib import Path

import igl
import numpy as np
from pygeodesic.geodesic import PyGeodesicAlgorithmExact
from scipy.sparse.linalg import eigsh

folder = Path(sys.argv[1])
COUNT, SIGMA, GAP, SNAP = 20, 1e-3, 0.02, 1e-9


def read(name):
    vertices = np.fromfile(folder / f"{name}.f64", np.float64).reshape(-1, 3)
    return vertices, np.fromfile(folder / f"{name}.u32", np.uint32).astype(np.int64).reshape(-1, 3)


def closest(points, vertices, faces):
    """The faces closest to points, the barycentric coordinates there, and the points."""
    _, found, places = igl.point_mesh_squared_distance(np.atleast_2d(points), vertices, faces)
    corners = [np.ascontiguousarray(vertices[faces[found, k]]) for k in range(3)]
    return found, igl.barycentric_coordinates(places, *corners), places


def distances(source, vertices, faces):
    """Exact distances of all vertices from the point of the mesh closest to another, and that point."""
    found, coordinates, places = closest(source, vertices, faces)
    face, coordinates, place = found[0], coordinates[0], places[0]
    corners = faces[face]
    if coordinates.max() > 1 - SNAP:
        start, more = corners[coordinates.argmax()], []
    else:
        # Every face with the point inside, or on an edge of it, is split into those of its sides that do not hold the point.
        start = len(vertices)
        vertices = np.vstack([vertices, place])
        near = corners[coordinates > SNAP]
        around = np.flatnonzero(np.isin(faces, near).sum(axis=1) == len(near))
        more = []
        for f in around:
            for k in range(3):
                side = faces[f][k], faces[f][(k + 1) % 3]
                if not (len(near) == 2 and set(side) == set(near)):
                    more.append([*side, start])
        faces = np.vstack([np.delete(faces, around, axis=0), more])
    algorithm = PyGeodesicAlgorithmExact(vertices, faces.astype(np.int32))
    found, _ = algorithm.geodesicDistances(np.array([start]), None)
    return found[: len(found) - (1 if len(more) else 0)], place


def modes(vertices, faces, sigma):
    laplacian = -igl.cotmatrix(vertices, faces)
    mass = igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_BARYCENTRIC)
    values, functions = eigsh(laplacian.tocsc(), COUNT, mass.tocsc(), sigma=-sigma, tol=1e-13)
    order = np.argsort(values)
    return values[order], functions[:, order], mass.diagonal()


def of_distances(found, truth, weights):
    error = np.abs(found - truth)
    mean = np.average(error, weights=weights)
    return mean, mean / np.average(truth, weights=weights), error.max()


def mode_errors(values, truth, found, areas):
    weight = np.sqrt(areas)[:, None]
    truth, found = (m * weight / np.linalg.norm(m * weight, axis=0) for m in (truth, found))
    ends = [k + 1 for k in range(1, COUNT - 1) if values[k + 1] - values[k] > GAP * values[k + 1]]
    errors, sizes = [], []
    for start, end in zip([1, *ends], ends):
        u, v = truth[:, start:end], found[:, start:end]
        left, _, right = np.linalg.svd(v.T @ u)
        errors.append(np.linalg.norm(u - v @ left @ right) / np.sqrt(end - start))
        sizes.append(end - start)
    return np.average(errors, weights=sizes), max(errors)


def protocol(over):
    truth, candidate = read("truth"), read("candidate")
    vertices, faces = truth
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    unit = np.ptp(vertices, axis=0).max() / 3
    feet, coordinates, _ = closest(vertices, *candidate)
    corners = candidate[1][feet]

    def transferred(values):
        return sum(coordinates[:, k, None] * values[corners[:, k]].reshape(len(vertices), -1) for k in range(3))

    carried, own = [], []
    doubled = igl.doublearea(vertices, faces)
    areas = np.bincount(faces.ravel(), np.repeat(doubled, 3), len(vertices))
    weights = areas if over == "area" else np.ones(len(vertices))
    for sign in (1, -1):
        corner = middle + sign * unit * np.ones(3)
        true, source = distances(corner, *truth)
        for place, into in ((source, carried), (corner, own)):
            found = transferred(distances(place, *candidate)[0])[:, 0]
            into.append(of_distances(found, true, weights))
    true, functions, areas = modes(*truth, SIGMA / unit**2)
    found, others, _ = modes(*candidate, SIGMA / unit**2)
    relative = np.abs(found - true)[1:] / true[1:]
    of_modes = mode_errors(true, functions, transferred(others), areas)
    answer = {"eigenvalues": relative.mean(), "eigenvalues_max": relative.max()}
    answer |= {"modes": of_modes[0], "modes_max": of_modes[1]}
    for name, both in (("carried", carried), ("own", own)):
        (m1, s1, x1), (m2, s2, x2) = both
        answer |= {f"{name}_mean": (m1 + m2) / 2, f"{name}_share": (s1 + s2) / 2, f"{name}_max": max(x1, x2)}
    return answer


print(json.dumps({name: version(name) for name in ("libigl", "pygeodesic", "scipy", "numpy")}), flush=True)
for line in sys.stdin:
    print(json.dumps(protocol(line.strip())), flush=True)
