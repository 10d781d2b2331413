"""Distances and shortest paths over surfaces."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from numpy.typing import ArrayLike

from ndf import _native
from ndf._arguments import choice, count, positive
from ndf._arrays import (
    Floats,
    Ints,
    Place,
    Places,
    face_points,
    indices,
    mesh,
    of_object,
    place,
    places,
    takes_meshes,
)
from ndf._native import NdfError
from ndf._progress import Progress, observer
from ndf._warnings import warn


class Path(NamedTuple):
    """A shortest path: straight in a face between each two of its points."""

    #: The corners of the polyline, ``(k, 3)``.
    points: Floats
    #: A face that each of them is on, ``(k,)``.
    faces: Ints
    #: Where on that face, ``(k, 3)``.
    bary: Floats
    #: The length of the path.
    length: float


def _method(method: str, time_step: float | None) -> tuple[bool, float | None]:
    """Whether it is the heat method, and its time step."""
    is_heat = choice(method, "method", "exact", "heat") == "heat"
    if not is_heat and time_step is not None:
        raise NdfError('time_step is for the heat method; give method="heat" with it')
    return is_heat, None if time_step is None else positive(time_step, "time_step")


class GeodesicSolver:
    """A mesh that is prepared for distances and paths: lengths, the tree of faces and the factors of the heat method are made
    once.

    ``vertices`` ``(n, 3)`` and ``faces`` ``(m, 3)``, or one object with both. The mesh may have borders, several components,
    faces without area, and vertices in one place, which are joined; a surface that cannot be oriented is measured as it is.
    A place is a vertex, or ``(face, barycentric coordinates)``.

    Raises
    ------
    NdfError
        If an edge has three faces, or the arrays are no mesh.

    Warns
    -----
    NdfWarning
        If something was repaired: faces left out, vertices in one place joined.
    """

    def __init__(self, vertices: Any, faces: Any = None) -> None:
        arrays = mesh(*(of_object(vertices) or (vertices, faces)))
        self._native = _native.GeodesicSolver(*arrays)
        warn(self._native.notes())

    def distance(
        self,
        sources: Places,
        *,
        method: Literal["exact", "heat"] = "exact",
        time_step: float | None = None,
    ) -> Floats:
        """Distances ``(n,)`` of all vertices from the nearest source; inf where no path leads. See :func:`geodesic_distance`."""
        return self._native.distance(places(sources), *_method(method, time_step))

    def distance_at(
        self,
        sources: Places,
        face: ArrayLike,
        bary: ArrayLike,
        *,
        method: Literal["exact", "heat"] = "exact",
        time_step: float | None = None,
    ) -> Floats:
        """Distances ``(k,)`` of points of faces, ``(k,)`` and ``(k, 3)``, from the nearest source: exact inside of faces, too."""
        at = face_points(face, bary)
        return self._native.distance_at(places(sources), *at, *_method(method, time_step))

    def path(self, start: Place, end: Place) -> Path:
        """A shortest path between two places; NdfError if there is none."""
        return Path(*self._native.path(place(start, "start"), place(end, "end")))

    def matrix(
        self, vertices: ArrayLike, *, threads: int = 0, progress: Progress = False
    ) -> Floats:
        """Exact distances ``(k, k)`` between all pairs of ``k`` vertices: exactly symmetric, zero on the diagonal. Each pair is
        computed once, from the one that comes first, and mirrored. Rows are computed in parallel, on all cores with 0 threads."""
        wanted = indices(vertices, "vertices", None).tolist()
        threads = count(threads, "threads", 0, 1024)
        with observer(progress) as observing:
            return self._native.matrix(wanted, threads, observing)


@takes_meshes
def geodesic_distance(
    vertices: Any,
    faces: Any = None,
    sources: Places | None = None,
    *,
    method: Literal["exact", "heat"] = "exact",
    time_step: float | None = None,
) -> Floats:
    """Distances ``(n,)`` over the surface from the nearest source, in the units of the mesh; inf where no path leads, and nan at
    vertices that are not finite, whose faces are left out.

    Parameters
    ----------
    vertices, faces
        ``(n, 3)`` and ``(m, 3)``, or one object with both.
    sources
        A vertex, ``(face, barycentric coordinates)``, or a list of them.
    method
        ``exact`` distances on the triangles, or ``heat``: smooth, about one per cent off on fine, even meshes.
    time_step
        Of the heat method, in squared mean edge lengths; if None 1, or the least power of four that reaches every vertex.

    Raises
    ------
    NdfError
        If an edge has three faces, or a source is not on the mesh.

    Warns
    -----
    NdfWarning
        If something was repaired: faces left out, vertices in one place joined.

    Source: Mitchell, Mount, Papadimitriou (1987); Crane, Weischedel, Wardetzky (2013).
    """
    if sources is None:
        raise NdfError("sources are missing; give a vertex, (face, barycentric coordinates), or a list of them")
    solver = GeodesicSolver(vertices, faces)
    return solver.distance(sources, method=method, time_step=time_step)
