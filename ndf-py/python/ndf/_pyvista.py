"""What pyvista finds by its entry points: ``pyvista.read("a.ndf")``, and ``mesh.ndf`` on every ``PolyData``."""

from __future__ import annotations

from os import PathLike
from typing import Any

import pyvista

import ndf
from ndf._arrays import Floats, Places


def surface(vertices: Floats, faces: Any) -> Any:
    """A ``PolyData`` of a mesh."""
    return pyvista.PolyData.from_regular_faces(vertices, faces)


def read(path: str | PathLike[str], **options: Any) -> Any:
    """A mesh of a model file; ``options`` go to :meth:`ndf.Model.to_pyvista`."""
    return ndf.Model.load(path).to_pyvista(**options)


@pyvista.register_dataset_accessor("ndf", pyvista.PolyData)
class NdfAccessor:
    """What ndf does with a mesh of pyvista."""

    def __init__(self, surface: Any) -> None:
        self._surface = surface

    def fit(self, **options: Any) -> ndf.Model:
        """See :func:`ndf.fit`."""
        return ndf.fit(self._surface, **options)

    def geodesic(self, sources: Places, **options: Any) -> Floats:
        """See :func:`ndf.geodesic_distance`."""
        return ndf.geodesic_distance(self._surface, sources, **options)

    def spectrum(self, k: int = 20, **options: Any) -> tuple[Floats, Floats]:
        """See :func:`ndf.spectrum`."""
        return ndf.spectrum(self._surface, k, **options)

    def remesh(self, edge_length: float, **options: Any) -> Any:
        """See :func:`ndf.remesh`."""
        return surface(*ndf.remesh(self._surface, edge_length, **options))

    def decimate(self, faces: int, **options: Any) -> Any:
        """See :func:`ndf.decimate`."""
        vertices, corners, _ = ndf.decimate(self._surface, faces, **options)
        return surface(vertices, corners)
