"""Every call of the contract, on the arrays that users have."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ndf

from .shapes import soup, sphere, square, torus

V, F = torus()


@pytest.fixture(scope="module")
def model() -> ndf.Model:
    return ndf.fit(V, F, base_faces=300)


def test_fit_and_its_report(model: ndf.Model) -> None:
    assert model.report["kind"] == "mesh" and model.report["base_faces"] <= 300
    assert model.report["distance_mean"] < 0.01
    assert {"output", "seconds", "seconds_reading", "model_bytes", "bytes"} <= set(model.report)
    vertices, faces = model.base
    assert vertices.dtype == np.float64 and faces.dtype == np.int64 and len(faces) <= 300


def test_files_and_bytes(model: ndf.Model, tmp_path: Path) -> None:
    place = tmp_path / "a.ndf"
    model.save(place)
    assert place.read_bytes() == model.to_bytes() and model.nbytes == place.stat().st_size
    again = ndf.Model.load(place)
    assert again.to_bytes() == model.to_bytes() == ndf.Model.from_bytes(model.to_bytes()).to_bytes()
    assert pickle.loads(pickle.dumps(model)).to_bytes() == model.to_bytes()
    (tmp_path / "b.ndf").write_text("no model")
    for wrong in ["missing.ndf", "b.ndf"]:
        with pytest.raises(ndf.NdfError, match=wrong):
            ndf.Model.load(tmp_path / wrong)
    with pytest.raises(ndf.NdfError, match="nowhere"):
        model.save(tmp_path / "nowhere" / "a.ndf")


def test_extract(model: ndf.Model) -> None:
    vertices, faces, report = model.extract(edge_length=0.1, report=True)
    assert report["faces"] == len(faces) and report["manifold"] and report["target_edge_length"] == 0.1
    assert vertices.shape == (report["vertices"], 3) and faces.dtype == np.int64
    assert len(model.extract(relative_edge_length=0.2)[1]) < len(model.extract(0.05)[1])
    with pytest.raises(ndf.NdfError):
        model.extract(edge_length=-1.0)
    with pytest.raises(ndf.NdfError, match="not both"):
        model.extract(0.1, relative_edge_length=0.1)


def test_places_of_vertices(model: ndf.Model) -> None:
    vertices, faces, face, bary = model.extract_places(edge_length=0.1)
    again = model.extract(edge_length=0.1)
    assert np.array_equal(vertices, again[0]) and np.array_equal(faces, again[1])
    assert np.abs(model.evaluate(face, bary) - vertices).max() < 1e-12


def test_evaluate_and_normals(model: ndf.Model) -> None:
    face = np.arange(40)
    bary = np.random.default_rng(0).dirichlet([1, 1, 1], 40)
    points, normals = model.evaluate(face, bary), model.normals(face, bary)
    assert points.shape == normals.shape == (40, 3)
    distance = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1.0, points[:, 2])
    assert np.abs(distance - 0.4).max() < 0.05
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-12)
    assert model.evaluate([], np.empty((0, 3))).shape == (0, 3)
    with pytest.raises(ndf.NdfError, match="no face 100000"):
        model.evaluate([100000], [[1, 0, 0]])
    for wrong in ([1.0, 1.0, 1.0], [2.0, -1.0, 0.0], [np.nan, 0.0, 1.0]):
        with pytest.raises(ndf.NdfError, match="add up to one"):
            model.evaluate([0], [wrong])
    with pytest.raises(ndf.NdfError, match="one length"):
        model.evaluate([0, 1], [[1, 0, 0]])


def test_scalars(model: ndf.Model) -> None:
    model = ndf.Model.from_bytes(model.to_bytes())
    assert model.scalars == {}
    figures = model.add_scalars({"height": V[:, 2], "side": V[:, 0]}, V, F)
    assert figures["rms_error"] < 0.02 and set(model.scalars) == {"height", "side"}
    assert model.scalars["height"]["max"] == pytest.approx(0.4, abs=0.02)
    face, bary = np.arange(30), np.full((30, 3), 1 / 3)
    heights = model.eval_scalars("height", face, bary)
    np.testing.assert_allclose(heights, model.evaluate(face, bary)[:, 2], atol=0.05)
    with pytest.raises(ndf.NdfError, match="height, side"):
        model.eval_scalars("width", face, bary)
    with pytest.raises(ndf.NdfError, match="3 values for"):
        model.add_scalars({"t": [1, 2, 3]}, V, F)


def test_points_and_files(tmp_path: Path) -> None:
    points, faces = sphere(4)
    model = ndf.fit_points(points, normals=points, base_faces=200)
    assert model.report["kind"] == "oriented-cloud" and model.report["distance_mean"] < 0.01
    place = tmp_path / "ball.xyz"
    np.savetxt(place, np.hstack([points, points]))
    assert ndf.fit_file(place, base_faces=200).report["kind"] == "oriented-cloud"
    assert ndf.fit_points(points, normals=None, base_faces=200).report["kind"] == "cloud"
    with pytest.raises(ndf.NdfError, match="kinds are mesh"):
        ndf.fit_file(place, kind="nurbs")
    with pytest.raises(ndf.NdfError, match="missing.ply"):
        ndf.fit_file(tmp_path / "missing.ply")
    with pytest.raises(ndf.NdfError, match="2 normals for"):
        ndf.fit_points(points, normals=points[:2])


def test_options_of_fit() -> None:
    network = ndf.fit(V, F, base_faces=200, features=4, epochs=5, samples=512)
    assert network.report["epochs"] >= 5 and network.report["bytes"] != {}
    base = ndf.decimate(V, F, faces=250)[:2]
    brought = ndf.fit(V, F, base=base)
    assert brought.report["base"] is None and len(brought.base[1]) == len(base[1])
    small = ndf.fit(V, F, size=1500)
    assert small.nbytes < 2500
    failing: list[dict[str, Any]] = [
        {"preset": "best"},
        {"field": "both"},
        {"base_faces": 2},
        {"epochs": 0},
        {"seed": -1},
        {"error": 7.0},
        {"time_limit": -1.0},
        {"threads": 5000},
        {"base_faces": 10.5},
    ]
    for wrong in failing:
        with pytest.raises(ndf.NdfError, match=next(iter(wrong))):
            ndf.fit(V, F, **wrong)
    with pytest.raises(ndf.NdfError, match="size and error"):
        ndf.fit(V, F, field="network", size=2000)


def test_distances() -> None:
    points, faces = square()
    np.testing.assert_allclose(ndf.geodesic_distance(points, faces, 1), [1, 0, 1, 2**0.5])
    np.testing.assert_allclose(ndf.geodesic_distance(points, faces, [0, 2]), [0, 1, 0, 1])
    middle = (0, [0.5, 0.0, 0.5])
    np.testing.assert_allclose(ndf.geodesic_distance(points, faces, middle), np.full(4, 0.5**0.5))
    pairs: list[Any] = [[middle, 0], [0, middle], [middle, middle], (0, middle)]
    for two in pairs:
        assert ndf.geodesic_distance(points, faces, two)[0] == pytest.approx(0.0 if 0 in two else 0.5**0.5)
    np.testing.assert_allclose(ndf.geodesic_distance(points, faces, np.array([0, 2])), [0, 1, 0, 1])
    np.testing.assert_allclose(ndf.geodesic_distance(points, faces, np.int32(1)), [1, 0, 1, 2**0.5])
    heat = ndf.geodesic_distance(V, F, 0, method="heat")
    exact = ndf.geodesic_distance(V, F, 0)
    assert np.abs(heat - exact).mean() < 0.02 * exact.max()
    beyond: list[Any] = [4, -1, [0, 99]]
    for wrong in beyond:
        with pytest.raises(ndf.NdfError, match="the vertices are 0 to 3"):
            ndf.geodesic_distance(points, faces, wrong)
    with pytest.raises(ndf.NdfError):
        ndf.geodesic_distance(points, faces, [])
    nowhere: list[Any] = [2**64, [0, (1, [0.5, "a", 0.5])]]
    for wrong in nowhere:
        with pytest.raises(ndf.NdfError):
            ndf.geodesic_distance(points, faces, wrong)
    with pytest.raises(ndf.NdfError, match="lengths cannot be computed"):
        ndf.geodesic_distance(points * 1e80, faces, 0)
    with pytest.raises(ndf.NdfError, match="sources are missing"):
        ndf.geodesic_distance(points, faces)
    with pytest.raises(ndf.NdfError):
        ndf.geodesic_distance(*soup(), 0)


def test_two_parts_and_unused_vertices() -> None:
    points, faces = square()
    two = np.vstack([points, points + 5, [[9, 9, 9]]]), np.vstack([faces, faces + 4])
    distances = ndf.geodesic_distance(*two, 0)
    assert np.isfinite(distances[:4]).all() and np.isinf(distances[4:]).all() and len(distances) == 9
    with pytest.raises(ndf.NdfError):
        ndf.GeodesicSolver(*two).path(0, 5)


def test_solver() -> None:
    solver = ndf.GeodesicSolver(V, F)
    np.testing.assert_array_equal(solver.distance(5), ndf.geodesic_distance(V, F, 5))
    corners = solver.distance_at(5, [0, 1], [[1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(corners, solver.distance(5)[[F[0, 0], F[1, 2]]])
    path = solver.path(5, 700)
    assert isinstance(path, ndf.Path)
    steps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    assert path.length == pytest.approx(steps.sum()) == pytest.approx(solver.distance(5)[700])
    np.testing.assert_allclose(path.points[[0, -1]], V[[5, 700]], atol=1e-12)
    on_faces = np.einsum("kc,kcx->kx", path.bary, V[F[path.faces]])
    np.testing.assert_allclose(on_faces, path.points, atol=1e-12)
    vertices = [0, 10, 200, 900, 10]
    matrix = solver.matrix(vertices)
    np.testing.assert_array_equal(matrix, matrix.T)
    for vertex, row in zip(vertices, matrix):
        np.testing.assert_allclose(row, solver.distance(vertex)[vertices], rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(matrix, solver.matrix(vertices, threads=2))
    assert solver.matrix([]).shape == (0, 0)


def test_spectra() -> None:
    points, faces = sphere(4)
    values, modes = ndf.spectrum(points, faces, k=9)
    assert values.shape == (9,) and modes.shape == (len(points), 9)
    np.testing.assert_allclose(values, [0, 2, 2, 2, 6, 6, 6, 6, 6], atol=0.1)
    times = [0.1, 1.0]
    heat = ndf.heat_kernel_signature(points, faces, times)
    assert heat.shape == (len(points), 2) and (heat[:, 0] > heat[:, 1]).all()
    waves = ndf.wave_kernel_signature(points, faces, 12, k=40)
    assert waves.shape == (len(points), 12) and np.isfinite(waves).all()
    with pytest.raises(ndf.NdfError, match="4 vertices"):
        ndf.spectrum(*square(), k=5)
    with pytest.raises(ndf.NdfError, match="mass"):
        ndf.spectrum(points, faces, mass="heavy")  # type: ignore[arg-type]


def test_heat_kernel_signature_is_its_formula() -> None:
    points, faces = sphere(2)
    values, modes = ndf.spectrum(points, faces, k=30)
    expected = np.stack([(np.exp(-values * t) * modes**2).sum(axis=1) for t in [0.1, 0.7]], axis=1)
    np.testing.assert_allclose(ndf.heat_kernel_signature(points, faces, [0.1, 0.7], k=30), expected, rtol=1e-6)


def test_meshing() -> None:
    vertices, faces = ndf.remesh(V, F, 0.2, method="intrinsic")
    assert np.array_equal(vertices[: len(V)], V) and len(faces) >= len(F)
    with pytest.raises(ndf.NdfError, match="isotropic"):
        ndf.remesh(V, F, 0.2, method="other")  # type: ignore[arg-type]
    with pytest.raises(ndf.NdfError, match="positive"):
        ndf.remesh(V, F, -1, method="intrinsic")
    vertices, faces = ndf.remesh(V, F, 0.1)
    lengths = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, 1, axis=1)], axis=2)
    assert 0.08 < lengths.mean() < 0.12 and ndf.info(vertices, faces)["genus"] == 1
    coarse, few, births = ndf.decimate(V, F, faces=200)
    assert len(few) <= 200 and births.shape == (len(few),) and len(np.unique(births)) == len(few)
    shift = np.linalg.norm(coarse[few].mean(axis=1) - V[F[births]].mean(axis=1), axis=1)
    assert shift.max() < 1.0

    def ball(points: ndf._arrays.Floats) -> ndf._arrays.Floats:
        distance: ndf._arrays.Floats = np.linalg.norm(points, axis=1) - 0.7
        return distance

    vertices, faces = ndf.marching_cubes(ball, ([-1, -1, -1], [1, 1, 1]), grid=24)
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 0.7, atol=1e-4)
    assert ndf.info(vertices, faces)["volume"] > 0
    dense = ndf.marching_cubes(lambda p: -ball(p), ([-1] * 3, [1] * 3), 24, inside="above")
    np.testing.assert_array_equal(dense[1], faces)
    with pytest.raises(ndf.NdfError):
        ndf.marching_cubes(ball, ([2, 2, 2], [3, 3, 3]), grid=8)
    with pytest.raises(ndf.NdfError, match="lo below hi"):
        ndf.marching_cubes(ball, ([1, 1, 1], [-1, -1, -1]))
    with pytest.raises(ndf.NdfError, match="grid"):
        ndf.marching_cubes(ball, ([-1] * 3, [1] * 3), grid=0)
    with pytest.raises(ndf.NdfError, match="edge_length"):
        ndf.remesh(V, F)
    with pytest.raises(ndf.NdfError, match="at least 4"):
        ndf.decimate(V, F, faces=2)


def test_measures() -> None:
    near = ndf.measure(V, F, V + [0.0, 0.0, 0.01], F)
    assert near["hausdorff"] == pytest.approx(0.01, abs=1e-3) and near["unit"] == "input"
    facts = ndf.info(V, F)
    assert facts["genus"] == 1 and facts["closed"] and facts["vertices"] == len(V)
    winding = ndf.winding_number(V, F, [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [np.nan, 0.0, 0.0]])
    np.testing.assert_allclose(winding[:2], [1, 0], atol=1e-2)
    assert np.isnan(winding[2])
    feet, faces, bary = ndf.closest_point(V, F, [[2.0, 0.0, 0.0], [np.nan, 0.0, 0.0]])
    np.testing.assert_allclose(feet[0], [1.4, 0, 0], atol=1e-12)
    np.testing.assert_allclose(bary[0] @ V[F[faces[0]]], feet[0], atol=1e-12)
    assert faces[1] == -1 and np.isnan(feet[1]).all()
    with pytest.raises(ndf.NdfError):
        ndf.measure(V, F, V, F[:0])


def test_pages(model: ndf.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []

    def open_page(url: str) -> bool:
        opened.append(url)
        return True

    monkeypatch.setattr("webbrowser.open", open_page)
    page = model.show(edge_length=0.1, name="a <torus>")
    assert opened and opened[0].startswith("file:") and page.html.startswith("<!DOCTYPE html>")
    page.save(tmp_path / "a.html")
    assert (tmp_path / "a.html").read_text(encoding="utf-8") == page.html
    assert "srcdoc" in model._repr_html_() and len(page.html) < 1_000_000
    mesh = ndf.show(V, F, scalars={"height": V[:, 2], "depth": V[:, 0]}, source=[1, 0, 0])
    assert len(opened) == 2 and "srcdoc" in mesh._repr_html_()
    with pytest.raises(ndf.NdfError, match="height"):
        ndf.show(V, F, scalars={"height": V[:, 2]}, scalar="depth")
    with pytest.raises(ndf.NdfError, match="3 values"):
        ndf.show(V, F, scalars={"height": [1, 2, 3]})
    with pytest.raises(ndf.NdfError, match="place"):
        ndf.show(V, F, source=[1, 2])
    with pytest.raises(ndf.NdfError, match="waves"):
        model.show(scalar="waves")
    assert len(opened) == 2
    monkeypatch.setattr("webbrowser.open", lambda url: False)
    with pytest.warns(ndf.NdfWarning, match="no browser"):
        page.open()
