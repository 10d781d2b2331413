"""Representations and fields that are written in Python."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest

import ndf
from ndf._arrays import Floats

from .shapes import sphere, torus


class Ball:
    """A sphere of radius 1, with a field."""

    def __init__(self) -> None:
        self.threads: set[int] = set()

    def bounds(self) -> Any:
        return [-1, -1, -1], [1, 1, 1]

    def project(self, points: Floats, normals: Floats) -> tuple[Floats, Floats, Any]:
        assert points.shape == normals.shape and points.shape[1] == 3
        self.threads.add(threading.get_ident())
        length = np.linalg.norm(points, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            feet = points / length[:, None]
        return feet, feet, length > 1e-9

    def field(self, points: Floats) -> Any:
        return np.linalg.norm(points, axis=1) - 1


def test_a_surface_of_ones_own() -> None:
    ball = Ball()
    model = ndf.fit_surface(ball, base_faces=200)
    assert isinstance(ball, ndf.Surface)
    vertices, _ = model.extract(0.2)
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 1.0, atol=0.01)
    again = ndf.fit_surface(Ball(), base_faces=200, threads=1)
    assert again.to_bytes() == model.to_bytes()


def test_without_a_field_it_needs_a_base() -> None:
    class Bare(Ball):
        field = None  # type: ignore[assignment]

    with pytest.raises(ndf.NdfError):
        ndf.fit_surface(Bare())
    assert ndf.fit_surface(Bare(), base=sphere(2)).report["distance_mean"] < 0.01


def test_a_surface_may_call_ndf() -> None:
    vertices, faces = torus(24, 12)

    class OnMesh:
        def bounds(self) -> Any:
            return vertices.min(axis=0), vertices.max(axis=0)

        def project(self, points: Floats, normals: Floats) -> Any:
            feet, face, _ = ndf.closest_point(vertices, faces, points)
            corners = vertices[faces[face]]
            across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            return feet, across, face >= 0

        def field(self, points: Floats) -> Any:
            return 0.5 - ndf.winding_number(vertices, faces, points)

    model = ndf.fit_surface(OnMesh(), base_faces=200, time_limit=60)
    assert model.report["distance_mean"] < 0.02


@pytest.mark.parametrize("threads", [1, 4])
def test_exceptions_come_out_as_they_are(threads: int) -> None:
    class Broken(Ball):
        def project(self, points: Floats, normals: Floats) -> Any:
            raise ZeroDivisionError("in project")

    with pytest.raises(ZeroDivisionError, match="in project"):
        ndf.fit_surface(Broken(), base_faces=200, threads=threads)

    class Dark(Ball):
        def field(self, points: Floats) -> Any:
            raise LookupError("in field")

    with pytest.raises(LookupError, match="in field"):
        ndf.fit_surface(Dark(), base_faces=200, threads=threads)

    def field(points: Floats) -> Any:
        raise KeyError("key")

    with pytest.raises(KeyError, match="key"):
        ndf.marching_cubes(field, ([-1] * 3, [1] * 3), grid=16, threads=threads)


def test_wrong_answers_are_named() -> None:
    with pytest.raises(ndf.NdfError, match="one value for each"):
        ndf.marching_cubes(lambda points: points, ([-1] * 3, [1] * 3), grid=16)

    class Short(Ball):
        def project(self, points: Floats, normals: Floats) -> Any:
            return points[:-1], points[:-1], np.ones(len(points) - 1)

    with pytest.raises(ndf.NdfError, match="project must return"):
        ndf.fit_surface(Short(), base_faces=200)

    class Flat(Ball):
        def bounds(self) -> Any:
            return [0, 0, 0], [1, 1, 0]

    with pytest.raises(ndf.NdfError, match="bounds"):
        ndf.fit_surface(Flat())
    with pytest.raises(AttributeError, match="project"):
        ndf.fit_surface(Partial())  # type: ignore[arg-type]


class Partial:
    def bounds(self) -> Any:
        return [-1] * 3, [1] * 3


def test_values_of_other_types_are_taken() -> None:
    def field(points: Floats) -> Any:
        return (np.linalg.norm(points, axis=1) - 0.5).astype(np.float32).tolist()

    assert len(ndf.marching_cubes(field, ([-1] * 3, [1] * 3), grid=12)[1]) > 100


def test_callbacks_get_large_batches() -> None:
    sizes: dict[str, list[int]] = {"project": [], "field": [], "cubes": []}

    class Counting(Ball):
        def project(self, points: Floats, normals: Floats) -> tuple[Floats, Floats, Any]:
            sizes["project"].append(len(points))
            return super().project(points, normals)

        def field(self, points: Floats) -> Any:
            sizes["field"].append(len(points))
            return super().field(points)

    def field(points: Floats) -> Any:
        sizes["cubes"].append(len(points))
        return np.linalg.norm(points, axis=1) - 0.7

    ndf.fit_surface(Counting(), base_faces=1000)
    ndf.marching_cubes(field, ([-1] * 3, [1] * 3), grid=64)
    for name, found in sizes.items():
        assert np.mean(found) > 2000 and max(found) <= 16_384, (name, np.mean(found), max(found))
