"""The same arrays in other libraries."""

from __future__ import annotations

import numpy as np
import pytest

import ndf

from .shapes import sphere, torus

V, F = torus()


def test_distances_of_libigl() -> None:
    igl = pytest.importorskip("igl", reason="libigl is not installed")
    if not hasattr(igl, "exact_geodesic"):
        pytest.skip("this libigl has no exact geodesics")
    vertices = np.arange(len(V))
    none = np.empty(0, np.int64)
    theirs = np.asarray(igl.exact_geodesic(V, F, np.array([0]), none, vertices, none)).ravel()
    np.testing.assert_allclose(ndf.geodesic_distance(V, F, 0), theirs, atol=1e-9)


def test_heat_and_paths_of_potpourri3d() -> None:
    potpourri = pytest.importorskip("potpourri3d", reason="potpourri3d is not installed")
    theirs = potpourri.MeshHeatMethodDistanceSolver(V, F).compute_distance(0)
    ours = ndf.geodesic_distance(V, F, 0, method="heat")
    assert np.abs(ours - theirs).max() < 0.03 * theirs.max()
    path = potpourri.EdgeFlipGeodesicSolver(V, F).find_geodesic_path(0, 300)
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    # Theirs is a geodesic, which need not be the shortest.
    assert ndf.GeodesicSolver(V, F).path(0, 300).length <= length * (1 + 1e-9)


def test_laplacian_of_robust_laplacian() -> None:
    robust = pytest.importorskip("robust_laplacian", reason="robust_laplacian is not installed")
    pytest.importorskip("scipy", reason="SciPy is not installed")
    for vertices, faces in [(V, F), sphere(3)]:
        theirs, their_mass = robust.mesh_laplacian(vertices, faces, mollify_factor=0.0)
        ours, mass = ndf.laplacian(vertices, faces)
        np.testing.assert_allclose(mass.diagonal(), their_mass.diagonal(), rtol=1e-8)
        if vertices is V:
            # Where four corners of a square are on one circle either diagonal is Delaunay, with weight zero.
            np.testing.assert_allclose((ours - theirs).toarray(), 0, atol=1e-6)


def test_spectrum_of_scipy() -> None:
    linalg = pytest.importorskip("scipy.sparse.linalg", reason="SciPy is not installed")
    laplacian, mass = ndf.laplacian(V, F)
    values, modes = ndf.spectrum(V, F, k=12)
    theirs = np.sort(linalg.eigsh(laplacian, 12, mass, sigma=-1e-3, which="LM")[0])
    np.testing.assert_allclose(values, theirs, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(modes.T @ (mass @ modes), np.eye(12), atol=1e-8)
    np.testing.assert_allclose(laplacian @ modes, (mass @ modes) * values, atol=1e-5)


def test_modes_held_at_zero_are_those_of_a_square() -> None:
    side = np.linspace(0, 1, 21)
    x, y = np.meshgrid(side, side, indexing="ij")
    vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    first = (np.arange(20)[:, None] * 21 + np.arange(20)).ravel()
    faces = np.concatenate([first[:, None] + [0, 21, 22], first[:, None] + [0, 22, 1]])
    values, modes = ndf.spectrum(vertices, faces, k=4, boundary="dirichlet")
    np.testing.assert_allclose(values / np.pi**2, [2, 5, 5, 8], rtol=0.02)
    on_boundary = (x * (1 - x) * y * (1 - y)).ravel() == 0
    assert np.all(modes[on_boundary] == 0)
    again, _ = ndf.spectrum(vertices, faces, k=4, boundary="dirichlet", multigrid=True)
    np.testing.assert_allclose(again, values, rtol=1e-9)


@pytest.mark.parametrize("mass", ["lumped", "voronoi", "consistent"])
def test_masses_add_up_to_the_area(mass: str) -> None:
    pytest.importorskip("scipy", reason="SciPy is not installed")
    laplacian, masses = ndf.laplacian(V, F, mass=mass)  # type: ignore[arg-type]
    assert masses.sum() == pytest.approx(ndf.info(V, F)["area"])
    np.testing.assert_allclose(laplacian.sum(axis=1), 0, atol=1e-9)
    assert (laplacian.diagonal() > 0).all()


def test_soup_and_unused_vertices_have_a_laplacian() -> None:
    pytest.importorskip("scipy", reason="SciPy is not installed")
    from .shapes import soup

    vertices, faces = soup()
    vertices = np.vstack([vertices, [[7, 7, 7]]])
    laplacian, mass = ndf.laplacian(vertices, faces)
    assert laplacian.shape == (6, 6) and mass.diagonal()[5] == 0 and mass.sum() == pytest.approx(1.5)


def test_without_scipy_there_are_arrays(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "scipy.sparse", None)
    (data, indices, indptr), _ = ndf.laplacian(V, F)
    assert len(indptr) == len(V) + 1 and len(data) == len(indices) == indptr[-1]
