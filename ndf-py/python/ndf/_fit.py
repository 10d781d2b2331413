"""Learning a surface."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from os import PathLike
from typing import Any, Literal, Protocol, runtime_checkable

from ndf import _native
from ndf._arrays import Floats, count, floats, mesh, of_object, takes_meshes
from ndf._model import Model
from ndf._native import NdfError
from ndf._progress import Observer, Progress, observer


class NdfWarning(UserWarning):
    """What was left out, changed or is doubtful: the sentences that the program writes to the error stream."""


@runtime_checkable
class Surface(Protocol):
    """A representation of surfaces that is written in Python. It may also have ``field(points) -> values``, ``(k, 3) -> (k,)``:
    a scalar field that is negative inside and zero on the surface, of which a base mesh is made.

    Both are called in batches of at most 16384 points, from threads of Rust: Python runs one at a time, but may go from one call to
    another before the first is done, so that what calls share needs a lock, or ``threads=1``. An exception ends the fit and comes
    out as it is.
    """

    def bounds(self) -> Any:
        """Two corners ``(lo, hi)`` of a box around the surface."""

    def project(self, points: Floats, normals: Floats) -> Any:
        """For each of ``points`` ``(k, 3)`` the closest point of the surface: ``(feet, normals, ok)``, of the shapes ``(k, 3)``,
        ``(k, 3)`` and ``(k,)``. ``normals`` that are given are those of the learned surface, zero where there is none; those
        that are returned point outward. Where ``ok`` is false there is no foot."""


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


def _options(
    preset: str,
    **options: Any,
) -> dict[str, Any]:
    if preset not in ("default", "paper"):
        raise NdfError(f"preset must be default or paper, not {preset}")
    for name, (low, high) in _RANGES.items():
        if options[name] is not None:
            options[name] = count(options[name], name, low, high)
    if options["size"] is not None and options["error"] is not None:
        raise NdfError("give size or error, not both")
    error = options["error"]
    if error is not None and not 0.0 < error < 1.0:
        raise NdfError(f"error must be a share of the diagonal such as 0.0002, not {error}")
    return {"paper": preset == "paper", **options}


def _learned(
    learn: Callable[[Any, dict[str, Any], Observer | None], tuple[_native.Model, str, list[str]]],
    base: Any,
    options: dict[str, Any],
    progress: Progress,
    *,
    depth: int = 3,
) -> Model:
    if base is not None:
        arrays = of_object(base) or base
        if not isinstance(arrays, (tuple, list)) or len(arrays) != 2:
            raise NdfError("base must be vertices and faces, (V, F), or a mesh that has both")
        base = mesh(*arrays)
    with observer(progress) as observing:
        model, report, notes = learn(base, options, observing)
    for note in notes:
        warnings.warn(note, NdfWarning, stacklevel=depth)
    return Model(model, json.loads(report), notes)


@takes_meshes
def fit(
    vertices: Any,
    faces: Any = None,
    *,
    base: Any = None,
    base_faces: int | None = None,
    features: int | None = None,
    preset: Literal["default", "paper"] = "default",
    epochs: int | None = None,
    samples: int | None = None,
    field: Literal["auto", "levels", "network"] = "auto",
    size: int | None = None,
    error: float | None = None,
    seed: int = 0,
    time_limit: float | None = None,
    threads: int | None = None,
    largest_component: bool = False,
    name: str | PathLike[str] | None = None,
    progress: Progress = False,
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
    arrays = mesh(vertices, faces)
    options = _options(
        preset, base_faces=base_faces, features=features, epochs=epochs, samples=samples, field=field,
        size=size, error=error, seed=seed, time_limit=time_limit, threads=threads,
    )  # fmt: skip

    def learn(base: Any, options: dict[str, Any], observing: Observer | None) -> Any:
        return _native.fit_mesh(*arrays, name, largest_component, base, options, observing)

    # What takes meshes as objects is between this and who calls.
    return _learned(learn, base, options, progress, depth=4)


def fit_points(
    points: Any,
    normals: Any = None,
    *,
    base: Any = None,
    base_faces: int | None = None,
    features: int | None = None,
    preset: Literal["default", "paper"] = "default",
    epochs: int | None = None,
    samples: int | None = None,
    field: Literal["auto", "levels", "network"] = "auto",
    size: int | None = None,
    error: float | None = None,
    seed: int = 0,
    time_limit: float | None = None,
    threads: int | None = None,
    name: str | PathLike[str] | None = None,
    progress: Progress = False,
) -> Model:
    """Learns a point cloud: ``points`` ``(n, 3)``, with outward ``normals`` ``(n, 3)`` of any length, or without.

    The other parameters and errors are those of :func:`fit`. Points that are not finite or coincide are left out; normals
    that disagree with their neighbours are not used, which a warning says.
    """
    positions = floats(points, "points")
    directions = None if normals is None else floats(normals, "normals")
    if directions is not None and directions.shape != positions.shape:
        raise NdfError(f"there are {len(directions)} normals for {len(positions)} points")
    options = _options(
        preset, base_faces=base_faces, features=features, epochs=epochs, samples=samples, field=field,
        size=size, error=error, seed=seed, time_limit=time_limit, threads=threads,
    )  # fmt: skip

    def learn(base: Any, options: dict[str, Any], observing: Observer | None) -> Any:
        return _native.fit_points(positions, directions, name, base, options, observing)

    return _learned(learn, base, options, progress)


def fit_file(
    path: str | PathLike[str],
    *,
    kind: str | None = None,
    iso: float | None = None,
    largest_component: bool = False,
    keep_seams: bool = False,
    base: Any = None,
    base_faces: int | None = None,
    features: int | None = None,
    preset: Literal["default", "paper"] = "default",
    epochs: int | None = None,
    samples: int | None = None,
    field: Literal["auto", "levels", "network"] = "auto",
    size: int | None = None,
    error: float | None = None,
    seed: int = 0,
    time_limit: float | None = None,
    threads: int | None = None,
    progress: Progress = False,
) -> Model:
    """Learns whatever the program reads: meshes, scans, neural fields, Gaussian splats.

    ``kind`` is ``mesh``, ``oriented-cloud``, ``cloud``, ``neural-sdf``, ``neus``, ``nerf`` or ``splats`` where the content of
    the file should not decide (``--as`` of the program), ``iso`` the level of the surface in a density, ``keep_seams`` leaves
    vertices in one place apart. The other parameters and errors are those of :func:`fit`.
    """
    options = _options(
        preset, base_faces=base_faces, features=features, epochs=epochs, samples=samples, field=field,
        size=size, error=error, seed=seed, time_limit=time_limit, threads=threads,
    )  # fmt: skip

    def learn(base: Any, options: dict[str, Any], observing: Observer | None) -> Any:
        return _native.fit_file(
            path, kind, iso, largest_component, keep_seams, base, options, observing
        )

    return _learned(learn, base, options, progress)


def fit_surface(
    surface: Surface,
    *,
    base: Any = None,
    base_faces: int | None = None,
    features: int | None = None,
    preset: Literal["default", "paper"] = "default",
    epochs: int | None = None,
    samples: int | None = None,
    field: Literal["auto", "levels", "network"] = "auto",
    size: int | None = None,
    error: float | None = None,
    seed: int = 0,
    time_limit: float | None = None,
    threads: int | None = None,
    progress: Progress = False,
) -> Model:
    """Learns a representation that is written in Python, a :class:`Surface`. Without ``surface.field`` it needs a ``base``.

    The other parameters and errors are those of :func:`fit`.
    """
    options = _options(
        preset, base_faces=base_faces, features=features, epochs=epochs, samples=samples, field=field,
        size=size, error=error, seed=seed, time_limit=time_limit, threads=threads,
    )  # fmt: skip

    def learn(base: Any, options: dict[str, Any], observing: Observer | None) -> Any:
        return _native.fit_surface(surface, base, options, observing)

    return _learned(learn, base, options, progress)
