"""Pages that show a model or a mesh."""

from __future__ import annotations

import html
import tempfile
import webbrowser
from collections.abc import Mapping
from os import PathLike
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ndf import _native
from ndf._arguments import file_path, positive, text
from ndf._arrays import columns_of, floats, mesh, of_object
from ndf._native import NdfError
from ndf._warnings import warn


class View:
    """A page that shows a surface and computes on it, one HTML file that needs no network: what ``ndf view`` writes.

    In a notebook it is shown where it is the last value of a cell.
    """

    #: The page.
    html: str

    def __init__(self, page: str) -> None:
        self.html = page

    def __repr__(self) -> str:
        return f"<ndf.View: a page of {len(self.html.encode())} bytes>"

    def _repr_html_(self) -> str:
        page = html.escape(self.html, quote=True)
        style = "width: 100%; height: 480px; border: 0"
        return f'<iframe srcdoc="{page}" style="{style}" title="ndf" allow="fullscreen"></iframe>'

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the page; NdfError if it cannot be."""
        place = file_path(path, "path")
        try:
            FilePath(place).write_text(self.html, encoding="utf-8")
        except OSError as error:
            raise NdfError(f"cannot write {place}: {error.strerror}") from error

    def open(self) -> None:
        """Opens the page in a browser, as a file in the temporary folder. A warning has its name if there is no browser."""
        with tempfile.NamedTemporaryFile("w", suffix=".html", prefix="ndf-", delete=False, encoding="utf-8") as file:
            file.write(self.html)
        if not webbrowser.open(FilePath(file.name).as_uri()):
            warn([f"there is no browser; the page is {file.name}"])


def show(
    vertices: Any,
    faces: Any = None,
    *,
    scalars: Mapping[str, ArrayLike] | None = None,
    scalar: str | None = None,
    source: ArrayLike | None = None,
    name: str = "mesh",
) -> View:
    """Shows a mesh: in a notebook as the value of a cell, elsewhere in a browser.

    Parameters
    ----------
    vertices, faces
        ``(n, 3)`` and ``(m, 3)``, or one object with both.
    scalars
        Values ``(n,)`` at the vertices, by name. They are shown in single precision, and names as words of ASCII.
    scalar
        The name of the one that colours the surface at first; the first, if None and there is no ``source``.
    source
        A place ``(3,)`` from whose next vertex exact distances are shown at first.
    name
        The title.

    Returns
    -------
    View
        The page; :meth:`View.save` writes it.

    Raises
    ------
    NdfError
        If there are not as many values as vertices, single precision cannot hold them, or no scalar has the name.
    """
    place = mesh(*(of_object(vertices) or (vertices, faces)))
    columns = columns_of({} if scalars is None else scalars, "scalars", len(place[0]))
    if scalar is None and source is None:
        scalar = next(iter(columns), None)
    _check_scalar(scalar, columns)
    rows = np.ascontiguousarray(np.stack(list(columns.values()))) if columns else np.empty((0, 1))
    title = text(name, "name")
    page = _native.mesh_page(*place, list(columns), rows, title, scalar, _source(source))
    return shown(View(page))


def model_view(
    model: _native.Model,
    scalars: Mapping[str, Any],
    scalar: str | None,
    source: ArrayLike | None,
    edge_length: float | None,
    name: str,
) -> View:
    """The page of a model."""
    _check_scalar(scalar, scalars)
    edge_length = None if edge_length is None else positive(edge_length, "edge_length")
    name = text(name, "name")
    return View(_native.model_page(model, name, scalar, _source(source), edge_length))


def shown(view: View) -> View:
    """Opens a page, but in notebooks, which show it."""
    if not _is_notebook():
        view.open()
    return view


def _check_scalar(scalar: str | None, known: Mapping[str, Any]) -> None:
    if scalar is not None and text(scalar, "scalar") not in known:
        raise NdfError(f"there is no scalar {scalar}; the scalars: [{', '.join(known)}]")


def _source(source: ArrayLike | None) -> list[float] | None:
    if source is None:
        return None
    place = floats(source, "source", None)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise NdfError("source must be a place of three numbers")
    return [float(x) for x in place]


def _is_notebook() -> bool:
    try:
        from IPython import get_ipython
    except ImportError:
        return False
    return hasattr(get_ipython(), "kernel")
