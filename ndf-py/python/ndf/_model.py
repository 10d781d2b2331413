"""Models."""

from __future__ import annotations

import json
from collections.abc import Mapping
from os import PathLike
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from ndf import _native
from ndf._arguments import count, file_path, flag, positive, share, text
from ndf._arrays import Floats, Ints, columns_of, face_points, mesh, of_object
from ndf._native import NdfError
from ndf._progress import Progress, observer
from ndf._warnings import warn

if TYPE_CHECKING:
    from ndf._show import View


class Model:
    """A learned surface: a base mesh and what displaces it, some 20 kB in a file. Lengths are in the units of the input.

    Points are given as faces ``(k,)`` of the base mesh and barycentric coordinates ``(k, 3)``, which are in the order of the
    corners of the face and add up to one.
    """

    #: What `ndf fit --json` says of the training; empty where the model was loaded.
    report: dict[str, Any]
    #: What was left out or is doubtful, in sentences.
    notes: list[str]

    def __init__(self, native: _native.Model, report: dict[str, Any], notes: list[str]) -> None:
        self._native = native
        self.report = report
        self.notes = notes

    def __repr__(self) -> str:
        vertices, faces = self.base
        return f"<ndf.Model: {len(faces)} base faces, {self.nbytes} bytes, scalars {list(self.scalars)}>"

    def __reduce__(self) -> Any:
        return _restored, (self.to_bytes(), self.report, self.notes)

    @staticmethod
    def load(path: str | PathLike[str]) -> Model:
        """Reads a model file.

        Raises
        ------
        NdfError
            If it cannot be read, or is no model.
        """
        place = file_path(path, "path")
        try:
            data = FilePath(place).read_bytes()
        except OSError as error:
            raise NdfError(f"cannot read {place}: {error.strerror}") from error
        try:
            return Model.from_bytes(data)
        except NdfError as error:
            raise NdfError(f"{place} is no usable model: {error}") from error

    def save(self, path: str | PathLike[str]) -> None:
        """Writes a model file. The file appears when it is whole.

        Raises
        ------
        NdfError
            If it cannot be written.
        """
        place = file_path(path, "path")
        self._native.save(place)
        if self.report:
            self.report["output"] = place

    @staticmethod
    def from_bytes(data: bytes) -> Model:
        """The model of the bytes of a file; NdfError if they are none."""
        if not isinstance(data, (bytes, bytearray, memoryview)):
            raise NdfError(f"data must be the bytes of a model file, not a {type(data).__name__}")
        return Model(_native.Model.from_bytes(bytes(data)), {}, [])

    def to_bytes(self) -> bytes:
        """The bytes of the file."""
        return self._native.to_bytes()

    @property
    def nbytes(self) -> int:
        """How many bytes the file has."""
        return len(self.to_bytes())

    @property
    def base(self) -> tuple[Floats, Ints]:
        """The base mesh, ``(n, 3)`` and ``(m, 3)``; of a model with levels the control mesh, which lies around the surface."""
        return self._native.base()

    @overload
    def extract(
        self,
        edge_length: float | None = None,
        *,
        relative_edge_length: float | None = None,
        report: Literal[False] = False,
        progress: Progress = False,
    ) -> tuple[Floats, Ints]: ...
    @overload
    def extract(
        self,
        edge_length: float | None = None,
        *,
        relative_edge_length: float | None = None,
        report: Literal[True],
        progress: Progress = False,
    ) -> tuple[Floats, Ints, dict[str, Any]]: ...
    def extract(
        self,
        edge_length: float | None = None,
        *,
        relative_edge_length: float | None = None,
        report: bool = False,
        progress: Progress = False,
    ) -> tuple[Floats, Ints] | tuple[Floats, Ints, dict[str, Any]]:
        """A manifold mesh that is near to Delaunay, ``(n, 3)`` and ``(m, 3)``; its topology is that of the base mesh.

        Parameters
        ----------
        edge_length
            About how long edges are, in the units of the input; a quarter of those of the base mesh if nothing is given.
        relative_edge_length
            The same in the box [-1.5, 1.5]³ that the base mesh fills.
        report
            Also return what ``ndf extract --json`` says of the mesh.

        Raises
        ------
        NdfError
            If the length is not positive, or would make more than 50 million faces.
        """
        lengths, reported = _lengths(edge_length, relative_edge_length), flag(report, "report")
        with observer(progress) as observing:
            (vertices, faces), _, figures = self._native.extract(*lengths, reported, observing)
        return (vertices, faces) if figures is None else (vertices, faces, json.loads(figures))

    def extract_places(
        self,
        edge_length: float | None = None,
        *,
        relative_edge_length: float | None = None,
        progress: Progress = False,
    ) -> tuple[Floats, Ints, Ints, Floats]:
        """What :meth:`extract` gives, and where over the base mesh the vertices are: faces ``(n,)`` and barycentric coordinates
        ``(n, 3)``, at which :meth:`evaluate`, :meth:`normals` and :meth:`eval_scalars` say what is there."""
        lengths = _lengths(edge_length, relative_edge_length)
        with observer(progress) as observing:
            mesh, places, _ = self._native.extract(*lengths, False, observing)
        return *mesh, *places

    def evaluate(self, face: ArrayLike, bary: ArrayLike) -> Floats:
        """Points of the surface, ``(k, 3)``, over points of the base mesh, ``(k,)`` and ``(k, 3)``."""
        return self._native.evaluate(*face_points(face, bary))

    def normals(self, face: ArrayLike, bary: ArrayLike) -> Floats:
        """Unit normals of the surface, ``(k, 3)``, over points of the base mesh; zero where it is degenerate."""
        return self._native.normals(*face_points(face, bary))

    @property
    def scalars(self) -> dict[str, dict[str, float]]:
        """The stored scalars: a dict of names, each with its ``min`` and ``max``."""
        found: dict[str, dict[str, float]] = json.loads(self._native.scalars())
        return found

    def add_scalars(
        self,
        values: Mapping[str, ArrayLike],
        vertices: Any,
        faces: Any = None,
        *,
        size: int | None = None,
        error: float | None = None,
        seed: int = 0,
        progress: Progress = False,
    ) -> dict[str, Any]:
        """Stores scalars, in the place of earlier ones of the same names, as integers on levels of nodes.

        Parameters
        ----------
        values
            By name, the values ``(n,)`` at the vertices of a mesh. They are stored in single precision at most.
        vertices, faces
            That mesh, near the surface and in its units.
        size, error
            At most how many bytes they may take, or which root mean square error, a share of their ranges, they may have.

        Returns
        -------
        dict
            The errors, as ``ndf scalars fit --json`` has them.

        Raises
        ------
        NdfError
            If there are not as many values as vertices, they are not finite, or single precision cannot hold them; the model is
            then as it was.
        """
        place = mesh(*(of_object(vertices) or (vertices, faces)))
        columns = columns_of(values, "values", len(place[0]))
        size = None if size is None else count(size, "size", 100, 10_000_000)
        error = None if error is None else share(error, "error", "0.005, of the ranges of the scalars")
        seed = count(seed, "seed", 0, 2**64 - 1)
        if not columns:
            raise NdfError("there are no scalars to store; give a dict of names and values")
        rows = np.ascontiguousarray(np.stack(list(columns.values())))
        with observer(progress) as observing:
            figures = self._native.add_scalars(
                list(columns), rows, *place, size, error, seed, observing
            )
        found: dict[str, Any] = json.loads(figures)
        if size is not None and found["bytes"] > size:
            warn([f"the scalars take {found['bytes']} bytes, not {size}: so much do their parts need"])
        if error is not None and found["rms_error"] > error:
            share_found, share_asked = 100 * found["rms_error"], 100 * error
            off = f"off by {share_found:.3f} % of their ranges rms, not {share_asked:.3f} %"
            warn([f"the scalars are {off}: finer levels would not fit"])
        return found

    def eval_scalars(self, name: str, face: ArrayLike, bary: ArrayLike) -> Floats:
        """Values ``(k,)`` of a stored scalar over points of the base mesh, computed in single precision."""
        return self._native.eval_scalars(text(name, "name"), *face_points(face, bary))

    def show(
        self,
        edge_length: float | None = None,
        *,
        scalar: str | None = None,
        source: ArrayLike | None = None,
        name: str = "model",
    ) -> View:
        """Shows the surface: in a notebook as the value of a cell, elsewhere in a browser. There it is cut to any edge length.

        ``edge_length`` is the one at first, ``scalar`` the name of the stored scalar that colours it at first, ``source`` a place
        ``(3,)`` from whose next vertex exact distances are shown at first, ``name`` the title. :meth:`View.save` writes the page.
        """
        from ndf._show import shown

        return shown(self._view(edge_length, scalar, source, name))

    def _repr_html_(self) -> str:
        return self._view(None, None, None, "model")._repr_html_()

    def _view(
        self,
        edge_length: float | None,
        scalar: str | None,
        source: ArrayLike | None,
        name: str,
    ) -> View:
        from ndf._show import model_view

        return model_view(self._native, self.scalars, scalar, source, edge_length, name)

    def to_trimesh(
        self, edge_length: float | None = None, *, relative_edge_length: float | None = None, **options: Any
    ) -> Any:
        """A ``trimesh.Trimesh`` with these edges; ``options`` go to it."""
        import trimesh

        vertices, faces = self.extract(edge_length, relative_edge_length=relative_edge_length)
        return trimesh.Trimesh(vertices, faces, process=False, **options)

    def to_pyvista(
        self, edge_length: float | None = None, *, relative_edge_length: float | None = None
    ) -> Any:
        """A ``pyvista.PolyData`` with these edges."""
        from ndf._pyvista import surface

        return surface(*self.extract(edge_length, relative_edge_length=relative_edge_length))

    def to_polyscope(
        self,
        name: str,
        edge_length: float | None = None,
        *,
        relative_edge_length: float | None = None,
        **options: Any,
    ) -> Any:
        """Registers a surface mesh of polyscope under a name; ``options`` go to it."""
        import polyscope

        vertices, faces = self.extract(edge_length, relative_edge_length=relative_edge_length)
        return polyscope.register_surface_mesh(name, vertices, faces, **options)


def _lengths(edge_length: Any, relative_edge_length: Any) -> tuple[float | None, float | None]:
    """The edge lengths of an extraction, of which at most one is given."""
    if edge_length is not None and relative_edge_length is not None:
        raise NdfError("give edge_length or relative_edge_length, not both")
    return (
        None if edge_length is None else positive(edge_length, "edge_length"),
        None if relative_edge_length is None else positive(relative_edge_length, "relative_edge_length"),
    )


def _restored(data: bytes, report: dict[str, Any], notes: list[str]) -> Model:
    return Model(_native.Model.from_bytes(data), report, notes)

