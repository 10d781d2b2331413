"""Meshes of meshes and of fields."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

from ndf import _native
from ndf._arguments import choice, count, number, positive
from ndf._arrays import Floats, Ints, floats, mesh, takes_meshes
from ndf._native import NdfError
from ndf._progress import Progress, observer
from ndf._warnings import warn


@takes_meshes
def remesh(
    vertices: Any,
    faces: Any = None,
    edge_length: float | None = None,
    *,
    method: Literal["isotropic", "intrinsic"] = "isotropic",
    rounds: int = 10,
    progress: Progress = False,
) -> tuple[Floats, Ints]:
    """A mesh ``(n2, 3)``, ``(m2, 3)`` of another resolution whose vertices lie on the surface of a mesh. The topology stays.

    Parameters
    ----------
    vertices, faces
        ``(n, 3)`` and ``(m, 3)``, or one object with both.
    edge_length
        The length of edges, in the units of the mesh.
    method
        ``isotropic``: even triangles whose edges are about so long, in ``rounds``; borders stay, their edges are only split.
        ``intrinsic``: all vertices stay, and others are inserted where the intrinsic Delaunay triangulation has angles below
        25° or circles wider than those around equilateral triangles with such edges.

    Raises
    ------
    NdfError
        If the mesh cannot be repaired to a manifold, the length is not positive, or ``intrinsic`` edges would join two
        vertices twice or need some ten million vertices or more.

    Warns
    -----
    NdfWarning
        If something was repaired: of vertices that are not finite the faces are left out.

    Source: Botsch and Kobbelt (2004); Sharp, Soliman and Crane (2019).
    """
    if edge_length is None:
        raise NdfError("edge_length is missing; give the length that edges should have, in the units of the mesh")
    edge_length = positive(edge_length, "edge_length")
    choice(method, "method", "isotropic", "intrinsic")
    rounds = count(rounds, "rounds", 0, 1000)
    arrays = mesh(vertices, faces)
    with observer(progress) as observing:
        if method == "intrinsic":
            found, notes = _native.remesh_intrinsically(*arrays, edge_length, observing)
        else:
            found, notes = _native.remesh(*arrays, edge_length, rounds, observing)
    warn(notes)
    return found


@takes_meshes
def decimate(
    vertices: Any,
    triangles: Any = None,
    faces: int | None = None,
    *,
    progress: Progress = False,
) -> tuple[Floats, Ints, Ints]:
    """A mesh with ``faces`` faces, or a few more where its topology needs them: ``V2``, ``F2`` and ``J`` ``(m2,)``, the face of
    the input that each of its faces has been.

    Raises
    ------
    NdfError
        If the mesh cannot be repaired to a manifold.

    Source: quadric error metrics, Garland and Heckbert (1997).
    """
    if faces is None:
        raise NdfError("faces is missing; give the number of faces to reach")
    faces = count(faces, "faces", 4, 2**32 - 1)
    with observer(progress) as observing:
        found, births, notes = _native.decimate(*mesh(vertices, triangles), faces, observing)
    warn(notes)
    return *found, births


def marching_cubes(
    field: Callable[[Floats], Any],
    bounds: Any,
    grid: int = 128,
    *,
    level: float = 0.0,
    inside: Literal["below", "above"] = "below",
    threads: int | None = None,
    progress: Progress = False,
) -> tuple[Floats, Ints]:
    """The isosurface of a field as a manifold mesh, ``(n, 3)`` and ``(m, 3)``, oriented outward.

    Parameters
    ----------
    field
        A callable from points ``(k, 3)`` to values ``(k,)``, called in batches of up to 16384 points from threads of Rust.
        Calls may overlap as those of Python's threads do; ``threads=1`` has one after the other. An exception comes out as it
        is.
    bounds
        Two corners ``(lo, hi)`` of the box to look in.
    grid
        Cells along its longest side.
    level, inside
        The value of the surface, and the side that is inside: ``below`` for distances, ``above`` for densities.

    Raises
    ------
    NdfError
        If the field has only one side at the corners of the grid, or returns another shape.

    Source: Lorensen and Cline (1987), with the cases of Chernyaev (1995) that keep it manifold.
    """
    if not callable(field):
        raise NdfError(f"field must be a callable from points (k, 3) to values (k,), not {field!r}")
    is_above = choice(inside, "inside", "below", "above") == "above"
    grid, level = count(grid, "grid", 1, 2048), number(level, "level")
    threads = None if threads is None else count(threads, "threads", 0, 1024)
    box = floats(bounds, "bounds")
    if len(box) != 2:
        raise NdfError(f"bounds must be two corners, (lo, hi), not {len(box)}")
    with observer(progress) as observing:
        return _native.marching_cubes(field, box, grid, level, is_above, threads, observing)
