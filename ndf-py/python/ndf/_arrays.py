"""What users give, as the arrays that the native part takes: float64 and int64, contiguous, borrowed where they are so already."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from typing import Any, SupportsIndex, TypeAlias, TypeVar, Union, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ndf._native import NdfError

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]

#: A vertex, or a face with three barycentric coordinates.
Place: TypeAlias = Union[SupportsIndex, tuple[SupportsIndex, ArrayLike]]

#: A place or a list of places.
Places: TypeAlias = Union[Place, Sequence[Place], NDArray[np.integer[Any]]]

NativePlace: TypeAlias = tuple[int, Union[tuple[float, float, float], None]]


def _as_array(values: Any, what: str) -> NDArray[Any]:
    try:
        return np.asarray(values)
    except ValueError as error:
        raise NdfError(f"{what} must be an array; its rows differ in length") from error


def floats(values: Any, what: str, columns: int | None = 3) -> Floats:
    """``(n, columns)`` float64, or ``(n,)`` where ``columns`` is None."""
    array = _as_array(values, what)
    shape = "(n,)" if columns is None else f"(n, {columns})"
    if array.size == 0 and columns is not None and array.ndim < 2:
        array = np.empty((0, columns))
    wanted = array.ndim == 1 if columns is None else array.ndim == 2 and array.shape[1] == columns
    if not wanted:
        raise NdfError(f"{what} must have the shape {shape}, not {array.shape}")
    if array.dtype.kind not in "iuf":
        raise NdfError(f"{what} must be numbers, not {array.dtype}")
    return np.require(array, np.float64, ("C", "A"))


def indices(values: Any, what: str, columns: int | None = 3) -> Ints:
    """``(n, columns)`` int64, or ``(n,)`` where ``columns`` is None, of integers of any width."""
    array = _as_array(values, what)
    shape = "(n,)" if columns is None else f"(n, {columns})"
    if array.size == 0 and array.ndim < 2:
        array = np.empty((0,) if columns is None else (0, columns), np.int64)
    wanted = array.ndim == 1 if columns is None else array.ndim == 2 and array.shape[1] == columns
    if not wanted:
        raise NdfError(f"{what} must have the shape {shape}, not {array.shape}")
    if array.size == 0 and array.dtype.kind == "f":
        array = array.astype(np.int64)
    if array.dtype.kind not in "iu":
        raise NdfError(f"{what} must be integers, not {array.dtype}")
    return np.require(array, np.int64, ("C", "A"))


def mesh(vertices: Any, faces: Any) -> tuple[Floats, Ints]:
    """The arrays of a mesh."""
    if faces is None:
        raise NdfError(f"faces are missing, and a {type(vertices).__name__} is no mesh; give vertices and faces")
    return floats(vertices, "vertices"), indices(faces, "faces")


def of_object(thing: Any) -> tuple[Any, Any] | None:
    """Vertices and faces of a mesh of trimesh, meshio or pyvista; None of anything else."""
    if hasattr(thing, "vertices") and hasattr(thing, "faces"):
        return thing.vertices, thing.faces
    if hasattr(thing, "points") and hasattr(thing, "cells_dict"):
        triangles = thing.cells_dict.get("triangle")
        if triangles is None:
            raise NdfError(f"the mesh has no triangles; it has {', '.join(thing.cells_dict) or 'no cells'}")
        return thing.points, triangles
    if hasattr(thing, "points") and hasattr(thing, "regular_faces"):
        surface = thing if thing.is_all_triangles else thing.triangulate()
        return surface.points, surface.regular_faces
    return None


_Function = TypeVar("_Function", bound=Callable[..., Any])


def takes_meshes(function: _Function) -> _Function:
    """Wherever such a function takes vertices and faces by position, it takes one object that has both."""

    @wraps(function)
    def taking(*arguments: Any, **options: Any) -> Any:
        spread: list[Any] = []
        for argument in arguments:
            found = of_object(argument)
            spread.extend([argument] if found is None else found)
        return function(*spread, **options)

    return cast(_Function, taking)


def place(value: Any) -> NativePlace:
    """A vertex as ``(index, None)``, a point of a face as ``(face, coordinates)``."""
    if isinstance(value, (tuple, list)) and len(value) == 2 and np.ndim(value[1]) == 1:
        coordinates = floats(value[1], "barycentric coordinates", None)
        if len(coordinates) != 3:
            raise NdfError(f"a point of a face has three barycentric coordinates, not {len(coordinates)}")
        a, b, c = coordinates.tolist()
        return _index(value[0]), (a, b, c)
    return _index(value), None


def _index(value: Any) -> int:
    array = np.asarray(value)
    if array.ndim != 0 or array.dtype.kind not in "iu":
        raise NdfError(f"a source is a vertex or (face, barycentric coordinates), not {value!r}")
    return int(array)


def places(values: Any) -> list[NativePlace]:
    """A place or a list of places."""
    is_list = isinstance(values, (tuple, list))
    is_point = is_list and len(values) == 2 and np.ndim(values[1]) == 1
    if is_point or (not is_list and np.ndim(values) == 0):
        return [place(values)]
    return [place(value) for value in values]


def face_points(face: Any, bary: Any) -> tuple[Ints, Floats]:
    """Faces ``(k,)`` and barycentric coordinates ``(k, 3)``."""
    faces, coordinates = indices(face, "face", None), floats(bary, "bary")
    if len(faces) != len(coordinates):
        raise NdfError(f"face and bary must be of one length, not {len(faces)} and {len(coordinates)}")
    return faces, coordinates
