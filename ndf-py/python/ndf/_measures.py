"""Figures of meshes, winding numbers, closest points."""

from __future__ import annotations

import json
from typing import Any

from numpy.typing import ArrayLike

from ndf import _native
from ndf._arrays import Floats, Ints, count, floats, mesh, takes_meshes


@takes_meshes
def measure(
    vertices: Any,
    faces: Any = None,
    vertices2: Any = None,
    faces2: Any = None,
    *,
    samples: int = 200_000,
    seed: int = 0,
) -> dict[str, Any]:
    """How far a second mesh is from a first, the reference: what ``ndf measure --json`` says, in the units of the meshes.

    ``samples`` points of each mesh are measured, and all vertices.

    Raises
    ------
    NdfError
        If one of the meshes has no area.
    """
    samples, seed = count(samples, "samples", 0, 1_000_000_000), count(seed, "seed", 0, 2**64 - 1)
    figures = _native.measure(*mesh(vertices, faces), *mesh(vertices2, faces2), samples, seed)
    found: dict[str, Any] = json.loads(figures)
    return found


@takes_meshes
def info(vertices: Any, faces: Any = None) -> dict[str, Any]:
    """Counts, topology and defects of a mesh: what ``ndf info --json`` says, but for the format of a file."""
    found: dict[str, Any] = json.loads(_native.info(*mesh(vertices, faces)))
    return found


@takes_meshes
def winding_number(vertices: Any, faces: Any = None, points: ArrayLike | None = None) -> Floats:
    """How often the mesh winds around each of ``points`` ``(k, 3)``: ``(k,)``, 1 inside and 0 outside where it is closed and
    oriented outward, in between where it has holes; nan at points that are not finite.

    Source: Barill et al. (2018).
    """
    return _native.winding_number(*mesh(vertices, faces), floats(points, "points"))


@takes_meshes
def closest_point(
    vertices: Any, faces: Any = None, points: ArrayLike | None = None
) -> tuple[Floats, Ints, Floats]:
    """The point of the mesh closest to each of ``points`` ``(k, 3)``: positions ``(k, 3)``, faces ``(k,)`` and barycentric
    coordinates ``(k, 3)``. The face is -1 where there is none: at points that are not finite, and on meshes without faces."""
    return _native.closest_point(*mesh(vertices, faces), floats(points, "points"))
