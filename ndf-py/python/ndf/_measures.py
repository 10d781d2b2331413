"""Figures of meshes, winding numbers, closest points."""

from __future__ import annotations

import json
from typing import Any

from numpy.typing import ArrayLike

from ndf import _native
from ndf._arguments import count
from ndf._arrays import Floats, Ints, mesh, queries, takes_meshes
from ndf._warnings import warn


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
    meshes = *mesh(vertices, faces, "first"), *mesh(vertices2, faces2, "second")
    found: dict[str, Any] = json.loads(_native.measure(*meshes, samples, seed))
    left_out = found["area_left_out"]
    for which, share in [("first", left_out["reference"]), ("second", left_out["mesh"])]:
        if share > 0:
            percent = f"{100 * share:.1f} % of the faces of the {which} mesh"
            warn([f"{percent} have corners that are not finite, and are left out"])
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

    Faces with a corner that is not finite are left out, which a warning says.

    Source: Barill et al. (2018).
    """
    found, notes = _native.winding_number(*mesh(vertices, faces), queries(points))
    warn(notes)
    return found


@takes_meshes
def closest_point(
    vertices: Any, faces: Any = None, points: ArrayLike | None = None
) -> tuple[Floats, Ints, Floats]:
    """The point of the mesh closest to each of ``points`` ``(k, 3)``: positions ``(k, 3)``, faces ``(k,)`` and barycentric
    coordinates ``(k, 3)``. The face is -1 where there is none: at points that are not finite, and on meshes without faces.
    Faces with a corner that is not finite are left out, which a warning says."""
    found, notes = _native.closest_point(*mesh(vertices, faces), queries(points))
    warn(notes)
    return found
