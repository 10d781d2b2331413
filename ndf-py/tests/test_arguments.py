"""Arguments of wrong types and values are refused by their names, before any work."""

from __future__ import annotations

import inspect
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ndf

from .shapes import sphere, torus

V, F = torus(16, 8)
BALL = [-1, -1, -1], [1, 1, 1]


@pytest.fixture(scope="module")
def model() -> ndf.Model:
    return ndf.fit(V, F, base_faces=60)


#: What is wrong for every argument that is an array of numbers.
NO_ARRAYS: list[Any] = [None, "abc", {}, 3.5, np.array([None, V], object), V.astype(complex), V > 0, [["a", "b", "c"]]]

#: What is wrong for every whole number, and for every number.
NO_COUNTS: list[Any] = ["3", 2.5, True, [3], np.nan, 1j]
NO_NUMBERS: list[Any] = ["3", True, [3.0], np.nan, np.inf, 1j]


def refused(words: str, call: Any, *arguments: Any, **options: Any) -> None:
    with pytest.raises(ndf.NdfError, match=words):
        call(*arguments, **options)


@pytest.mark.parametrize("wrong", NO_ARRAYS, ids=lambda value: type(value).__name__)
def test_arrays(wrong: Any, model: ndf.Model) -> None:
    functions: list[Any] = [
        ndf.fit, ndf.info, ndf.laplacian, ndf.spectrum, ndf.GeodesicSolver, ndf.measure, ndf.closest_point, ndf.show,
    ]  # fmt: skip
    for function in functions:
        refused("vertices|mesh is missing", function, wrong, F)
        if wrong is not None:
            refused("faces", function, V, wrong)
    refused("points", ndf.winding_number, V, F, wrong)
    refused("points", ndf.closest_point, V, F, wrong)
    refused("points", ndf.fit_points, wrong)
    refused("bounds", ndf.marching_cubes, lambda p: p[:, 0], wrong)
    refused("times", ndf.heat_kernel_signature, V, F, wrong)
    refused("face", model.evaluate, wrong, [[1, 0, 0]])
    refused("bary", model.normals, [0], wrong)
    refused("scalar t", model.add_scalars, {"t": wrong}, V, F)
    if wrong is not None:
        refused("normals", ndf.fit_points, V, wrong)
        refused("base", ndf.fit, V, F, base=wrong)
        refused("base", ndf.fit, V, F, base=(wrong, F))
        refused("source", ndf.show, V, F, source=wrong)


def test_places() -> None:
    solver = ndf.GeodesicSolver(V, F)
    wrong: list[Any] = [None, "ab", 1.5, True, {}, [[0, 1]], (0, "abc"), (0.5, [1, 0, 0]), np.array([0.0])]
    for place in wrong:
        refused("source|barycentric", solver.distance, place)
    refused("start", solver.path, "a", 1)
    refused("end", solver.path, 0, 1.5)
    refused("vertices", solver.matrix, None)
    refused("threads", solver.matrix, [0, 1], threads=-1)


@pytest.mark.parametrize("wrong", NO_COUNTS, ids=repr)
def test_whole_numbers(wrong: Any, model: ndf.Model) -> None:
    for name in ["base_faces", "features", "epochs", "samples", "size", "seed", "threads"]:
        refused(f"{name} must be a whole number", ndf.fit, V, F, **{name: wrong})
    refused("k must be", ndf.spectrum, V, F, k=wrong)
    refused("energies must be", ndf.wave_kernel_signature, V, F, wrong)
    refused("faces must be", ndf.decimate, V, F, faces=wrong)
    refused("rounds must be", ndf.remesh, V, F, 0.1, rounds=wrong)
    refused("grid must be", ndf.marching_cubes, lambda p: p[:, 0], BALL, grid=wrong)
    refused("threads must be", ndf.marching_cubes, lambda p: p[:, 0], BALL, threads=wrong)
    refused("samples must be", ndf.measure, V, F, V, F, samples=wrong)
    refused("seed must be", ndf.measure, V, F, V, F, seed=wrong)
    refused("threads must be", ndf.GeodesicSolver(V, F).matrix, [0], threads=wrong)
    refused("size must be", model.add_scalars, {"t": V[:, 0]}, V, F, size=wrong)
    refused("seed must be", model.add_scalars, {"t": V[:, 0]}, V, F, seed=wrong)


@pytest.mark.parametrize("wrong", NO_NUMBERS, ids=repr)
def test_numbers(wrong: Any, model: ndf.Model) -> None:
    refused("edge_length must be", ndf.remesh, V, F, wrong)
    refused("edge_length must be", model.extract, wrong)
    refused("relative_edge_length must be", model.extract, relative_edge_length=wrong)
    refused("edge_length must be", model.show, wrong)
    refused("time_step must be", ndf.geodesic_distance, V, F, 0, method="heat", time_step=wrong)
    refused("level must be", ndf.marching_cubes, lambda p: p[:, 0], BALL, level=wrong)
    refused("error must be", ndf.fit, V, F, error=wrong)
    refused("error must be", model.add_scalars, {"t": V[:, 0]}, V, F, error=wrong)
    refused("time_limit must be", ndf.fit, V, F, time_limit=wrong)
    refused("iso must be", ndf.fit_file, "a.ply", iso=wrong)


def test_numbers_are_said_as_they_were_given(model: ndf.Model) -> None:
    refused("edge_length must be a positive number, not -1$", model.extract, -1)
    refused("relative_edge_length must be a positive number, not 0$", model.extract, relative_edge_length=0)
    refused("time_step must be a positive number, not -2", ndf.geodesic_distance, V, F, 0, method="heat", time_step=-2)
    refused("edge_length must be a positive number, not -1$", ndf.remesh, V, F, -1, method="intrinsic")


@pytest.mark.parametrize("wrong", [None, 3, "maybe", [True]], ids=repr)
def test_words_flags_and_callables(wrong: Any, model: ndf.Model, tmp_path: Path) -> None:
    refused("preset must be default or paper", ndf.fit, V, F, preset=wrong)
    refused("field must be auto, levels or network", ndf.fit, V, F, field=wrong)
    refused("method must be exact or heat", ndf.geodesic_distance, V, F, 0, method=wrong)
    refused("method must be isotropic or intrinsic", ndf.remesh, V, F, 0.1, method=wrong)
    refused("mass must be lumped, voronoi or consistent", ndf.laplacian, V, F, mass=wrong)
    refused("boundary must be neumann or dirichlet", ndf.spectrum, V, F, boundary=wrong)
    refused("inside must be below or above", ndf.marching_cubes, lambda p: p[:, 0], BALL, inside=wrong)
    refused("delaunay must be True or False", ndf.spectrum, V, F, delaunay=wrong)
    refused("largest_component must be True or False", ndf.fit, V, F, largest_component=wrong)
    refused("keep_seams must be True or False", ndf.fit_file, "a.ply", keep_seams=wrong)
    refused("report must be True or False", model.extract, report=wrong)
    refused("progress must be True, False or callable", ndf.spectrum, V, F, progress=wrong)
    refused("progress must be True, False or callable", ndf.fit, V, F, progress=wrong)
    refused("field must be a callable", ndf.marching_cubes, wrong, BALL)
    if wrong != "maybe":
        paths: list[Any] = [ndf.fit_file, ndf.Model.load, model.save]
        for function in paths:
            refused("path must be the name of a file", function, wrong)
        refused("name must be a string", model.show, name=wrong)
        refused("name must be a string", model.eval_scalars, wrong, [0], [[1, 0, 0]])
    if wrong not in (None, "maybe"):
        refused("kind must be a string", ndf.fit_file, "a.ply", kind=wrong)
        refused("name must be the name of a file", ndf.fit, V, F, name=wrong)
        refused("scalar must be a string", model.show, scalar=wrong)
    refused("values must be a dict", model.add_scalars, wrong, V, F)


def test_what_is_missing() -> None:
    refused("points are missing", ndf.winding_number, V, F)
    refused("points are missing", ndf.closest_point, V, F)
    refused("second mesh is missing", ndf.measure, V, F)
    refused("faces of the second mesh are missing", ndf.measure, V, F, V)
    data: Any = 5
    refused("bytes of a model file, not a int", ndf.Model.from_bytes, data)


def test_places_of_files(model: ndf.Model, tmp_path: Path) -> None:
    folder = tmp_path / "none"
    refused(f"cannot write {folder / 'a.ndf'}: there is no folder {folder}$", model.save, folder / "a.ndf")
    refused("cannot write .*a.html: No such file", model._view(None, None, None, "a").save, folder / "a.html")


def test_answers_of_callbacks() -> None:
    def cubes(answer: Any) -> Any:
        return lambda: ndf.marching_cubes(lambda p: answer(p), BALL, grid=8)

    rule = "a field must return one value for each of its points"
    refused(rf"{rule}: an array of shape \(\d+,\) was expected, not \(\)", cubes(lambda p: None))
    refused(f"{rule}: could not convert", cubes(lambda p: ["a"] * len(p)))
    refused(f"{rule}: real numbers were expected", cubes(lambda p: p[:, 0] + 1j))

    class Two:
        def bounds(self) -> Any:
            return BALL

        def project(self, points: Any, normals: Any) -> Any:
            return points, points

    refused("project must return feet and normals", ndf.fit_surface, Two(), base=sphere(1))

    class Point(Two):
        def bounds(self) -> Any:
            return [0, 0, 0]

    refused(r"bounds are two corners.*shape \(2, 3\) was expected, not \(3,\)", ndf.fit_surface, Point())
    corners: Any = [[1, 2, 3]]
    refused("bounds must be two corners", ndf.marching_cubes, lambda p: p[:, 0], corners)


def test_times() -> None:
    for times, words in [([], "empty"), ([-1.0], "not negative, not -1"), ([0.1, np.nan], "not nan"), ([np.inf], "not inf")]:
        refused(words, ndf.heat_kernel_signature, V, F, times)


def test_options_of_learning_have_one_signature() -> None:
    functions: list[Any] = [ndf.fit, ndf.fit_points, ndf.fit_file, ndf.fit_surface]
    for function in functions:
        parameters = inspect.signature(function).parameters
        assert "options" not in parameters
        assert {name: parameters[name].default for name in ("base_faces", "seed", "preset", "field", "progress")} == {
            "base_faces": None, "seed": 0, "preset": "default", "field": "auto", "progress": False,
        }  # fmt: skip
        with pytest.raises(TypeError, match=rf"{function.__name__}\(\) got an unexpected keyword argument 'epoch'"):
            function(V, epoch=3)


def test_a_base_mesh_in_another_place_or_unit() -> None:
    base = ndf.decimate(V, F, faces=60)[:2]
    for vertices in [base[0] + [10.0, 0.0, 0.0], base[0] * 1000.0, base[0] * 0.001]:
        for options in [{}, {"features": 4, "epochs": 5, "samples": 512}]:
            refused("the base mesh is .* from the surface", ndf.fit, V, F, base=(vertices, base[1]), **options)


def test_lengths_that_take_too_long_are_refused_at_once() -> None:
    started = time.monotonic()
    words = "edge_length of 1e-5 needs some 3e11 vertices, and ten million are made at most; choose 1.9e-3 or more"
    refused(words, ndf.remesh, V, F, 1e-5, method="intrinsic")
    assert time.monotonic() - started < 10


def test_scalars_that_single_precision_cannot_hold(model: ndf.Model) -> None:
    ones = np.ones(len(V))
    wrong = [1e-50 * V[:, 0], 1e-50 * ones, 1e39 * ones, 1e9 + 1e-3 * V[:, 0]]
    for values in wrong:
        refused("scalar t is stored in single precision", model.add_scalars, {"t": values}, V, F)
        refused("scalar t is stored in single precision", ndf.show, V, F, scalars={"t": values})
    # What is small beside the rest may become zero.
    again = ndf.Model.from_bytes(model.to_bytes())
    again.add_scalars({"t": np.where(V[:, 0] > 0, V[:, 0], 1e-50)}, V, F)
    assert set(again.scalars) == {"t"}


def test_budgets_of_scalars(model: ndf.Model) -> None:
    t = {"t": V[:, 2]}
    refused("size must be at least 100, not 1", model.add_scalars, t, V, F, size=1)
    refused("size must be at most", model.add_scalars, t, V, F, size=10**9)
    for error in (0.0, -1.0, 1.0, 7):
        refused("error must be a share between 0 and 1", model.add_scalars, t, V, F, error=error)
    refused("not both", model.add_scalars, t, V, F, size=1000, error=0.01)
    with pytest.warns(ndf.NdfWarning, match="off by .* % of their ranges rms, not 0.000 %"):
        ndf.Model.from_bytes(model.to_bytes()).add_scalars({"t": np.sin(40 * V[:, 0])}, V, F, error=1e-9)


def test_names_of_scalars_in_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("webbrowser.open", lambda url: True)
    names = ["heat flow", "heat_flow", "Höhe", "x", "", "a\nb"]
    for name in names:
        page = ndf.show(V, F, scalars={other: V[:, 2] for other in names}, scalar=name)
        assert page.html.startswith("<!DOCTYPE html>")
    assert '"scalar":"heat_flow_2"' in ndf.show(V, F, scalars={n: V[:, 0] for n in names}, scalar="heat_flow").html
