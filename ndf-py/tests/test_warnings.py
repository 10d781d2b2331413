"""What is left out is told, at the line that calls."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

import ndf

from .shapes import torus

V, F = torus(24, 12)
BROKEN = V.copy()
BROKEN[7] = np.nan


@pytest.mark.parametrize(
    "call",
    [
        lambda: ndf.geodesic_distance(BROKEN, F, 0),
        lambda: ndf.GeodesicSolver(BROKEN, F),
        lambda: ndf.remesh(BROKEN, F, 0.3),
        lambda: ndf.remesh(BROKEN, F, 0.3, method="intrinsic"),
        lambda: ndf.decimate(BROKEN, F, faces=100),
        lambda: ndf.winding_number(BROKEN, F, [[1, 0, 0]]),
        lambda: ndf.closest_point(BROKEN, F, [[1, 0, 0]]),
        lambda: ndf.measure(V, F, BROKEN, F),
        lambda: ndf.spectrum(BROKEN, F, k=3),
        lambda: ndf.heat_kernel_signature(BROKEN, F, [0.1], k=3),
        lambda: ndf.wave_kernel_signature(BROKEN, F, 3, k=5),
        lambda: ndf.fit(BROKEN, F, base_faces=60),
    ],
)
def test_faces_that_are_not_finite_are_told(call: Any) -> None:
    with pytest.warns(ndf.NdfWarning, match="left out") as told:
        call()
    assert all(warning.filename == __file__ for warning in told)


def test_dropped_vertices_are_nan_at_their_places() -> None:
    with pytest.warns(ndf.NdfWarning):
        distances = ndf.geodesic_distance(BROKEN, F, 0)
        modes = ndf.spectrum(BROKEN, F, k=3)[1]
        heat = ndf.geodesic_distance(BROKEN, F, 0, method="heat")
    for values in (distances, heat, modes[:, 0]):
        assert np.flatnonzero(np.isnan(values)).tolist() == [7]
    # The others are those of the mesh without the faces of the vertex.
    rest = np.delete(np.arange(len(V)), 7)
    number = np.full(len(V), -1)
    number[rest] = np.arange(len(rest))
    faces = number[F[(F != 7).all(axis=1)]]
    np.testing.assert_array_equal(distances[rest], ndf.geodesic_distance(V[rest], faces, 0))


def test_sound_meshes_are_quiet() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ndf.geodesic_distance(V, F, 0)
        ndf.remesh(V, F, 0.3)
        ndf.decimate(V, F, faces=100)
        ndf.winding_number(V, F, V)
        ndf.measure(V, F, V, F)
        ndf.spectrum(V, F, k=3)
