"""What users give, as the arrays that the native part takes: float64 and int64, contiguous, borrowed where they are so already."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from inspect import signature
from typing import Any, SupportsIndex, TypeAlias, TypeVar, Union, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ndf._arguments import text
from ndf._native import NdfError

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]

#: A vertex, or a face with three barycentric coordinates.
Place: TypeAlias = Union[SupportsIndex, tuple[SupportsIndex, ArrayLike]]

#: A place or a list of places.
Places: TypeAlias = Union[Place, Sequence[Place], NDArray[np.integer[Any]]]

NativePlace: TypeAlias = tuple[int, Union[tuple[float, float, float], None]]


def _as_array(values: Any, what: str, shape: str) -> NDArray[Any]:
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise NdfError(f"{what} must be an array; its rows differ in length") from error
    if array.ndim == 0:
        raise NdfError(f"{what} must be an array of the shape {shape}, not {_named(values)}")
    return array


def _named(value: Any) -> str:
    """What was given, in few words."""
    said = repr(value)
    return said if len(said) <= 60 else f"a {type(value).__name__}"


def floats(values: Any, what: str, columns: int | None = 3) -> Floats:
    """``(n, columns)`` float64, or ``(n,)`` where ``columns`` is None."""
    shape = "(n,)" if columns is None else f"(n, {columns})"
    array = _as_array(values, what, shape)
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
    shape = "(n,)" if columns is None else f"(n, {columns})"
    array = _as_array(values, what, shape)
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


def mesh(vertices: Any, faces: Any, which: str = "") -> tuple[Floats, Ints]:
    """The arrays of a mesh. ``which`` tells it from others in errors."""
    of = f" of the {which} mesh" if which else ""
    if vertices is None and faces is None:
        raise NdfError(f"the {which or 'only'} mesh is missing; give vertices and faces")
    if faces is None:
        kind = type(vertices).__name__
        raise NdfError(f"faces{of} are missing, and a {kind} is no mesh; give vertices and faces")
    return floats(vertices, f"vertices{of}"), indices(faces, f"faces{of}")


def queries(points: Any) -> Floats:
    """Places ``(k, 3)``."""
    if points is None:
        raise NdfError("points are missing; give the places to ask at, (k, 3)")
    return floats(points, "points")


def columns_of(values: Any, what: str, vertices: int) -> dict[str, Floats]:
    """Scalars ``(n,)`` at so many vertices, by name."""
    if not isinstance(values, Mapping):
        raise NdfError(f"{what} must be a dict of names and values, not {_named(values)}")
    columns = {text(name, "the name of a scalar"): floats(column, f"scalar {name}", None) for name, column in values.items()}
    for name, column in columns.items():
        if len(column) != vertices:
            raise NdfError(f"scalar {name} has {len(column)} values for {vertices} vertices")
    return columns


def of_object(thing: Any) -> tuple[Any, Any] | None:
    """Vertices and faces of a mesh of trimesh, meshio or pyvista; None of anything else."""
    if hasattr(thing, "vertices") and hasattr(thing, "faces"):
        return thing.vertices, thing.faces
    if hasattr(thing, "points") and hasattr(thing, "cells_dict"):
        triangles = thing.cells_dict.get("triangle")
        if triangles is None:
            # Keys are names in meshio, and numbers of VTK in pyvista, where 5 is a triangle.
            triangles = thing.cells_dict.get(5)
        if triangles is None:
            kinds = ", ".join(map(str, thing.cells_dict))
            raise NdfError(f"the mesh has no triangles; it has {kinds or 'no cells'}")
        return thing.points, triangles
    if hasattr(thing, "points") and hasattr(thing, "regular_faces"):
        surface = thing if thing.is_all_triangles else thing.triangulate()
        return surface.points, surface.regular_faces
    return None


_Function = TypeVar("_Function", bound=Callable[..., Any])


def takes_meshes(function: _Function) -> _Function:
    """Wherever such a function takes vertices and faces by position, it takes one object that has both; and as its first named
    argument."""
    first, second = list(signature(function).parameters)[:2]

    @wraps(function)
    def taking(*arguments: Any, **options: Any) -> Any:
        if options.get(second) is None and (found := of_object(options.get(first))) is not None:
            options[first], options[second] = found
        spread: list[Any] = []
        for argument in arguments:
            found = of_object(argument)
            spread.extend([argument] if found is None else found)
        return function(*spread, **options)

    return cast(_Function, taking)


def _is_face_point(value: Any) -> bool:
    """Whether this is a face and its coordinates, and not two places."""
    if not isinstance(value, (tuple, list)) or len(value) != 2 or isinstance(value[0], (tuple, list)):
        return False
    second = value[1]
    if isinstance(second, (tuple, list)):
        # A point of a face in the second place has coordinates of its own.
        return all(np.ndim(number) == 0 for number in second)
    return bool(np.ndim(second) == 1)


def place(value: Any, what: str = "a source") -> NativePlace:
    """A vertex as ``(index, None)``, a point of a face as ``(face, coordinates)``."""
    if _is_face_point(value):
        coordinates = floats(value[1], "barycentric coordinates", None)
        if len(coordinates) != 3:
            raise NdfError(f"a point of a face has three barycentric coordinates, not {len(coordinates)}")
        a, b, c = coordinates.tolist()
        return _index(value[0], what), (a, b, c)
    return _index(value, what), None


def _index(value: Any, what: str) -> int:
    array = np.empty(0) if isinstance(value, (tuple, list)) else np.asarray(value)
    if array.ndim != 0 or array.dtype.kind not in "iu":
        raise NdfError(f"{what} must be a vertex or (face, barycentric coordinates), not {_named(value)}")
    number = int(array)
    if number >= 2**63:
        raise NdfError(f"there is no vertex or face {number}")
    return number


def places(values: Any) -> list[NativePlace]:
    """A place or a list of places."""
    if _is_face_point(values) or (not isinstance(values, (tuple, list)) and np.ndim(values) == 0):
        return [place(values)]
    return [place(value) for value in values]


def face_points(face: Any, bary: Any) -> tuple[Ints, Floats]:
    """Faces ``(k,)`` and barycentric coordinates ``(k, 3)``."""
    faces, coordinates = indices(face, "face", None), floats(bary, "bary")
    if len(faces) != len(coordinates):
        raise NdfError(f"face and bary must be of one length, not {len(faces)} and {len(coordinates)}")
    return faces, coordinates
