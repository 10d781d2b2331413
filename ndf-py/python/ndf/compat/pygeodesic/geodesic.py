"""The class of ``pygeodesic.geodesic``, on exact distances of ndf."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ndf._arrays import Floats, Ints
from ndf._geodesics import GeodesicSolver


class PyGeodesicAlgorithmExact:
    """Exact distances and paths between vertices, ``points`` ``(n, 3)`` and ``faces`` ``(m, 3)``."""

    def __init__(self, points: Any, faces: Any) -> None:
        self._solver = GeodesicSolver(points, faces)

    def geodesicDistance(self, sourceIndex: int, targetIndex: int) -> tuple[float, Floats]:
        """The distance between two vertices, and a path ``(k, 3)`` from the target to the source."""
        path = self._solver.path(int(sourceIndex), int(targetIndex))
        return path.length, path.points[::-1]

    def geodesicDistances(
        self,
        source_indices: ArrayLike | None = None,
        target_indices: ArrayLike | None = None,
        max_distance: float = float("inf"),
    ) -> tuple[Floats, Ints]:
        """Distances from the nearest source, and which one that is, at the targets or at all vertices. Beyond ``max_distance``
        they are inf."""
        sources = np.atleast_1d(np.asarray([0] if source_indices is None else source_indices))
        rows = np.stack([self._solver.distance(int(source)) for source in sources])
        nearest = rows.argmin(axis=0)
        distances = rows.min(axis=0)
        distances[distances > max_distance] = np.inf
        if target_indices is None:
            return distances, nearest
        targets = np.atleast_1d(np.asarray(target_indices))
        return distances[targets], nearest[targets]
