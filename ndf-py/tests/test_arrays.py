"""Arrays of every type and layout, objects of other packages, and what is no mesh."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import ndf

from .shapes import square, torus

V, F = torus(16, 8)
EXPECTED = ndf.geodesic_distance(V, F, 0)


@pytest.mark.parametrize("width", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", ">i4", "<i8"])
def test_integers_of_any_width(width: str) -> None:
    faces = F if np.iinfo(width).max > F.max() else F
    if np.iinfo(width).max <= F.max():
        pytest.skip("the mesh has more vertices than this type can count")
    np.testing.assert_array_equal(ndf.geodesic_distance(V, faces.astype(width), 0), EXPECTED)


@pytest.mark.parametrize(
    "layout",
    [
        np.asfortranarray,
        lambda a: np.repeat(a, 2, axis=0)[::2],
        lambda a: np.hstack([a, a])[:, :3],
        lambda a: a[::-1].copy()[::-1],
        lambda a: a.tolist(),
        lambda a: tuple(map(tuple, a.tolist())),
    ],
)
def test_layouts(layout: Any) -> None:
    np.testing.assert_array_equal(ndf.geodesic_distance(layout(V), layout(F), 0), EXPECTED)


def test_arrays_stay_as_they_are() -> None:
    vertices, faces = V.copy(), F.copy()
    vertices.flags.writeable = faces.flags.writeable = False
    ndf.fit(vertices, faces, base_faces=60)
    ndf.remesh(vertices, faces, 0.3)
    np.testing.assert_array_equal(vertices, V)
    np.testing.assert_array_equal(faces, F)


def test_unaligned_and_single_precision() -> None:
    raw = np.empty(V.nbytes + 1, np.uint8)
    shifted = raw[1:].view(np.float64).reshape(V.shape)
    shifted[:] = V
    np.testing.assert_array_equal(ndf.geodesic_distance(shifted, F, 0), EXPECTED)
    np.testing.assert_allclose(ndf.geodesic_distance(V.astype(np.float32), F, 0), EXPECTED, rtol=1e-5)


def test_objects_of_other_packages() -> None:
    like_trimesh = SimpleNamespace(vertices=V, faces=F)
    like_meshio = SimpleNamespace(points=V, cells_dict={"triangle": F, "line": F[:, :2]})
    for thing in [like_trimesh, like_meshio]:
        np.testing.assert_array_equal(ndf.geodesic_distance(thing, 0), EXPECTED)  # by position
        np.testing.assert_array_equal(ndf.geodesic_distance(thing, sources=0), EXPECTED)
        np.testing.assert_array_equal(ndf.GeodesicSolver(thing).distance(0), EXPECTED)
        assert ndf.measure(thing, thing)["hausdorff"] < 1e-12
        assert ndf.info(thing)["faces"] == len(F)
        assert len(ndf.decimate(thing, faces=50)[1]) <= 50
        assert ndf.fit(thing, base_faces=60).report["kind"] == "mesh"
    with pytest.raises(ndf.NdfError, match="no triangles; it has quad"):
        ndf.info(SimpleNamespace(points=V, cells_dict={"quad": F}))
    with pytest.raises(ndf.NdfError, match="faces are missing"):
        ndf.info(V)


@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        (V[:, :2], F, r"vertices must have the shape \(n, 3\), not \(128, 2\)"),
        (V.ravel(), F, r"not \(384,\)"),
        (V, F[:, :2], r"faces must have the shape \(n, 3\), not \(256, 2\)"),
        (V, F.astype(float), "faces must be integers, not float64"),
        (V, F > 0, "faces must be integers, not bool"),
        (V.astype(complex), F, "vertices must be numbers, not complex128"),
        (V.astype(str), F, "vertices must be numbers"),
        ([[0, 0, 0], [1, 1]], F, "rows differ"),
        (V, F + 1000, "the vertices are 0 to 127"),
        (V, F - 1, "vertex -1"),
        (V[:0], F, "0 to -1"),
    ],
)
def test_what_is_no_mesh(vertices: Any, faces: Any, words: str) -> None:
    functions: list[Any] = [ndf.info, ndf.fit, ndf.laplacian, ndf.GeodesicSolver]
    for function in functions:
        with pytest.raises(ndf.NdfError, match=words):
            function(vertices, faces)


def test_empty_meshes() -> None:
    none: Any = []
    assert ndf.info(none, none)["faces"] == 0
    assert ndf.info(np.empty((0, 3)), np.empty((0, 3), np.int32))["vertices"] == 0
    assert ndf.winding_number(none, none, V[:2]).tolist() == [0, 0]
    assert ndf.closest_point(none, none, V[:2])[1].tolist() == [-1, -1]
    assert ndf.closest_point(V, F, none)[0].shape == (0, 3)
    functions: list[Any] = [ndf.fit, ndf.spectrum, ndf.wave_kernel_signature]
    for function in functions:
        with pytest.raises(ndf.NdfError):
            function(none, none)


def test_nan() -> None:
    vertices = V.copy()
    vertices[3] = np.nan
    functions: list[Any] = [ndf.laplacian, ndf.GeodesicSolver, ndf.fit, ndf.spectrum]
    for function in functions:
        try:
            function(vertices, F)
        except ndf.NdfError:
            pass
    assert ndf.info(vertices, F)["nonfinite_vertices"] == 1


def test_errors_are_value_errors() -> None:
    assert issubclass(ndf.NdfError, ValueError)
    with pytest.raises(ValueError, match="faces"):
        ndf.info(*square()[:1])
