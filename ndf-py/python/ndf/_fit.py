"""Learning a surface."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable
from functools import wraps
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypedDict, TypeVar, cast, runtime_checkable

from ndf import _native
from ndf._arguments import choice, count, file_path, flag, number, share, text
from ndf._arrays import Floats, floats, mesh, of_object, takes_meshes
from ndf._model import Model
from ndf._native import NdfError
from ndf._progress import Observer, Progress, observer
from ndf._warnings import warn

if TYPE_CHECKING:
    from typing_extensions import Unpack


@runtime_checkable
class Surface(Protocol):
    """A representation of surfaces that is written in Python. It may also have ``field(points) -> values``, ``(k, 3) -> (k,)``:
    a scalar field that is negative inside and zero on the surface, of which a base mesh is made.

    Both are called in batches of up to 16384 points, from threads of Rust: Python runs one at a time, but may go from one call to
    another before the first is done, so that what calls share needs a lock, or ``threads=1``. An exception ends the fit and comes
    out as it is.
    """

    def bounds(self) -> Any:
        """Two corners ``(lo, hi)`` of a box around the surface."""

    def project(self, points: Floats, normals: Floats) -> Any:
        """For each of ``points`` ``(k, 3)`` the closest point of the surface: ``(feet, normals, ok)``, of the shapes ``(k, 3)``,
        ``(k, 3)`` and ``(k,)``. ``normals`` that are given are those of the learned surface, zero where there is none; those
        that are returned point outward. Where ``ok`` is false there is no foot."""


class FitOptions(TypedDict, total=False):
    """The keywords that all ways to learn share; :func:`fit` says what they mean."""

    base: Any
    base_faces: int | None
    features: int | None
    preset: Literal["default", "paper"]
    epochs: int | None
    samples: int | None
    field: Literal["auto", "levels", "network"]
    size: int | None
    error: float | None
    seed: int
    time_limit: float | None
    threads: int | None
    progress: Progress


#: Those of them that are not None where nothing is given.
_DEFAULTS: FitOptions = {"preset": "default", "field": "auto", "seed": 0, "progress": False}

#: What numbers may be: as the program has it.
_RANGES = {
    "base_faces": (4, 10_000_000),
    "features": (0, 4096),
    "epochs": (1, 2**32 - 1),
    "samples": (1, 2**32 - 1),
    "size": (1000, 2_000_000),
    "seed": (0, 2**64 - 1),
    "threads": (0, 1024),
}

_Function = TypeVar("_Function", bound=Callable[..., Model])


def _takes_options(function: _Function) -> _Function:
    """Gives a function that takes :class:`FitOptions` the signature with their names, and has Python check them."""
    own = inspect.signature(function)
    named: list[inspect.Parameter] = []
    for name, note in FitOptions.__annotations__.items():
        kind, default = inspect.Parameter.KEYWORD_ONLY, cast("dict[str, Any]", _DEFAULTS).get(name)
        named.append(inspect.Parameter(name, kind, default=default, annotation=getattr(note, "__forward_arg__", note)))
    parameters = [p for p in own.parameters.values() if p.kind is not p.VAR_KEYWORD]
    full = own.replace(parameters=[*parameters, *named])

    @wraps(function)
    def checked(*arguments: Any, **options: Any) -> Model:
        try:
            bound = full.bind(*arguments, **options)
        except TypeError as error:
            raise TypeError(f"{function.__name__}() {error}") from None
        bound.apply_defaults()
        return function(*bound.args, **bound.kwargs)

    checked.__signature__ = full  # type: ignore[attr-defined]
    return cast(_Function, checked)


def _native_options(options: dict[str, Any]) -> dict[str, Any]:
    """The options as the native part takes them."""
    found = {name: options[name] for name in FitOptions.__annotations__ if name not in ("base", "progress")}
    found["paper"] = choice(found.pop("preset"), "preset", "default", "paper") == "paper"
    choice(found["field"], "field", "auto", "levels", "network")
    for name, (low, high) in _RANGES.items():
        if found[name] is not None:
            found[name] = count(found[name], name, low, high)
    if found["size"] is not None and found["error"] is not None:
        raise NdfError("give size or error, not both")
    if found["error"] is not None:
        found["error"] = share(found["error"], "error", "0.0002, of the diagonal")
    if found["time_limit"] is not None:
        found["time_limit"] = number(found["time_limit"], "time_limit")
    return found


def _learned(
    learn: Callable[[Any, dict[str, Any], Observer | None], tuple[_native.Model, str, list[str]]],
    options: FitOptions,
) -> Model:
    given = cast("dict[str, Any]", options)
    base, native = given["base"], _native_options(given)
    if base is not None:
        arrays = of_object(base) or base
        if not isinstance(arrays, (tuple, list)) or len(arrays) != 2:
            raise NdfError("base must be vertices and faces, (V, F), or a mesh that has both")
        base = mesh(arrays[0], arrays[1], "base")
    with observer(given["progress"]) as observing:
        model, report, notes = learn(base, native, observing)
    warn(notes)
    return Model(model, json.loads(report), notes)


@takes_meshes
@_takes_options
def fit(
    vertices: Any,
    faces: Any = None,
    *,
    largest_component: bool = False,
    name: str | PathLike[str] | None = None,
    **options: Unpack[FitOptions],
) -> Model:
    """Learns a mesh of any quality: what the program ``ndf fit`` does, with its defaults.

    Parameters
    ----------
    vertices, faces
        ``(n, 3)`` numbers and ``(m, 3)`` integers, or one object with both.
    base
        A base mesh ``(V, F)`` in the units of the surface, a manifold, instead of one that is made.
    base_faces
        Faces of the base mesh; 4000, or as many as suit ``size`` or ``error``.
    features, preset, epochs, samples
        Settings of a network. Each of them makes a network of the model, unless ``field`` says otherwise; ``features`` is 8.
    field
        ``levels`` of displacements along the normal, or the ``network`` of the paper.
    size, error
        About how many bytes the model may have, or the mean distance it may have from the surface, a share of its
        diagonal. For levels.
    seed
        Seed of everything random. The same seed gives the same bytes as the program, with any number of threads.
    time_limit
        Seconds after which training ends with what is learned by then.
    threads
        Number of threads; all cores if None.
    largest_component
        Learns the component with the largest area alone.
    name
        The name of the file that the mesh comes from, if the model should tell of it.
    progress
        True for a bar of tqdm, or ``callable(stage, fraction)``, which is called on this thread.

    Returns
    -------
    Model
        The model, with ``report`` as ``ndf fit --json`` has it.

    Raises
    ------
    NdfError
        If the mesh has no area, no base mesh can be made of it, or training fails.
    KeyboardInterrupt
        On Ctrl-C.

    Source: the paper on neural displacement fields; the levels are this project's own.
    """
    arrays, named = mesh(vertices, faces), None if name is None else file_path(name, "name")
    is_largest = flag(largest_component, "largest_component")

    def learn(base: Any, options: dict[str, Any], observing: Observer | None) -> Any:
        return _native.fit_mesh(*arrays, named, is_largest, base, options, observing)

    return _learned(learn, options)


@_takes_options
def fit_points(
    points: Any,
    normals: Any = None,
    *,
    name: str | PathLike[str] | None = None,
    **options: Unpack[FitOptions],
) -> Model:
    """Learns a point cloud: ``points`` ``(n, 3)``, with outward ``normals`` ``(n, 3)`` of any length, or without.

    The other parameters and errors are those of :func:`fit`. Points that are not finite or coincide are left out; normals
    that disagree with their neighbours are not used, which a warning says.
    """
    positions = floats(points, "points")
    directions = None if normals is None else floats(normals, "normals")
    if directions is not None and directions.shape != positions.shape:
        raise NdfError(f"there are {len(directions)} normals for {len(positions)} points")
    named = None if name is None else file_path(name, "name")

    def learn(base: Any, options: dict[str, Any], observing: Observer | None) -> Any:
        return _native.fit_points(positions, directions, named, base, options, observing)

    return _learned(learn, options)


@_takes_options
def fit_file(
    path: str | PathLike[str],
    *,
    kind: str | None = None,
    iso: float | None = None,
    largest_component: bool = False,
    keep_seams: bool = False,
    **options: Unpack[FitOptions],
) -> Model:
    """Learns whatever the program reads: meshes, scans, neural fields, Gaussian splats.

    ``kind`` is ``mesh``, ``oriented-cloud``, ``cloud``, ``neural-sdf``, ``neus``, ``nerf`` or ``splats`` where the content of
    the file should not decide (``--as`` of the program), ``iso`` the level of the surface in a density, ``keep_seams`` leaves
    vertices in one place apart. The other parameters and errors are those of :func:`fit`.
    """
    place, level = file_path(path, "path"), None if iso is None else number(iso, "iso")
    wanted = None if kind is None else text(kind, "kind")
    is_largest, is_apart = flag(largest_component, "largest_component"), flag(keep_seams, "keep_seams")

    def learn(base: Any, options: dict[str, Any], observing: Observer | None) -> Any:
        return _native.fit_file(place, wanted, level, is_largest, is_apart, base, options, observing)

    return _learned(learn, options)


@_takes_options
def fit_surface(surface: Surface, **options: Unpack[FitOptions]) -> Model:
    """Learns a representation that is written in Python, a :class:`Surface`. Without ``surface.field`` it needs a ``base``.

    The other parameters and errors are those of :func:`fit`.
    """

    def learn(base: Any, options: dict[str, Any], observing: Observer | None) -> Any:
        return _native.fit_surface(surface, base, options, observing)

    return _learned(learn, options)
