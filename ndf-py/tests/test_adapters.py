"""Other packages, where they are installed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import ndf

from .shapes import torus

V, F = torus(24, 12)


@pytest.fixture(scope="module")
def model() -> ndf.Model:
    return ndf.fit(V, F, base_faces=100)


def test_trimesh(model: ndf.Model) -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    mesh = model.to_trimesh(edge_length=0.2)
    assert mesh.is_watertight
    assert len(ndf.geodesic_distance(mesh, 0)) == len(mesh.vertices)
    assert ndf.fit(trimesh.Trimesh(V, F), base_faces=100).report["kind"] == "mesh"


def test_meshio() -> None:
    meshio = pytest.importorskip("meshio", reason="meshio is not installed")
    assert ndf.info(meshio.Mesh(V, {"triangle": F}))["genus"] == 1


def test_pyvista(model: ndf.Model, tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista", "0.48", reason="pyvista 0.48 is not installed")
    mesh = model.to_pyvista(edge_length=0.2)
    assert len(mesh.ndf.geodesic(0)) == mesh.n_points
    assert mesh.ndf.spectrum(4)[1].shape == (mesh.n_points, 4)
    assert mesh.ndf.remesh(0.3).n_cells > 0 and mesh.ndf.decimate(80).n_cells <= 80
    place = tmp_path / "a.ndf"
    model.save(place)
    assert pyvista.read(place).n_cells == model.to_pyvista().n_cells


def test_polyscope(model: ndf.Model) -> None:
    polyscope = pytest.importorskip("polyscope", reason="polyscope is not installed")
    try:
        polyscope.init("openGL_mock")
    except Exception as error:  # it has no display and no mock here
        pytest.skip(f"polyscope does not start: {error}")
    assert model.to_polyscope("a", edge_length=0.3).n_vertices() > 0


def test_pygeodesic() -> None:
    from ndf.compat.pygeodesic import geodesic as ours

    solver = ours.PyGeodesicAlgorithmExact(V, F)
    distances, nearest = solver.geodesicDistances([0, 100], None)
    assert distances.shape == nearest.shape == (len(V),) and nearest[100] == 1
    theirs = pytest.importorskip("pygeodesic.geodesic", reason="pygeodesic is not installed")
    other = theirs.PyGeodesicAlgorithmExact(V, F)
    their_distances, their_nearest = other.geodesicDistances(np.array([0, 100]), None)
    np.testing.assert_allclose(distances, their_distances, atol=1e-9)
    alone = np.abs(solver._solver.distance(0) - solver._solver.distance(100)) > 1e-9
    np.testing.assert_array_equal(nearest[alone], their_nearest[alone])
    length, path = solver.geodesicDistance(0, 200)
    their_length, their_path = other.geodesicDistance(0, 200)
    assert length == pytest.approx(their_length)
    np.testing.assert_allclose(path[[0, -1]], their_path[[0, -1]], atol=1e-9)
