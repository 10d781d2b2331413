"""Distances and shortest paths over surfaces."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from numpy.typing import ArrayLike

from ndf import _native
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


def _is_heat(method: str, time_step: float | None) -> bool:
    if method not in ("exact", "heat"):
        raise NdfError(f"method must be exact or heat, not {method}")
    if method == "exact" and time_step is not None:
        raise NdfError("time_step is for the heat method")
    return method == "heat"


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
    """

    def __init__(self, vertices: Any, faces: Any = None) -> None:
        arrays = mesh(*(of_object(vertices) or (vertices, faces)))
        self._native = _native.GeodesicSolver(*arrays)

    def distance(
        self,
        sources: Places,
        *,
        method: Literal["exact", "heat"] = "exact",
        time_step: float | None = None,
    ) -> Floats:
        """Distances ``(n,)`` of all vertices from the nearest source; inf where no path leads. See :func:`geodesic_distance`."""
        return self._native.distance(places(sources), _is_heat(method, time_step), time_step)

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
        is_heat = _is_heat(method, time_step)
        return self._native.distance_at(places(sources), *face_points(face, bary), is_heat, time_step)

    def path(self, start: Place, end: Place) -> Path:
        """A shortest path between two places; NdfError if there is none."""
        return Path(*self._native.path(place(start), place(end)))

    def matrix(
        self, vertices: ArrayLike, *, threads: int = 0, progress: Progress = False
    ) -> Floats:
        """Exact distances ``(k, k)`` between all pairs of ``k`` vertices: symmetric, zero on the diagonal. Rows are computed in
        parallel, on all cores with 0 threads."""
        wanted = indices(vertices, "vertices", None).tolist()
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
    """Distances ``(n,)`` over the surface from the nearest source, in the units of the mesh; inf where no path leads.

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

    Source: Mitchell, Mount, Papadimitriou (1987); Crane, Weischedel, Wardetzky (2013).
    """
    if sources is None:
        raise NdfError("sources are missing; give a vertex, (face, barycentric coordinates), or a list of them")
    solver = GeodesicSolver(vertices, faces)
    return solver.distance(sources, method=method, time_step=time_step)
