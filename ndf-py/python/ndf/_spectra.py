"""Laplacians, eigenmodes and their signatures."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ndf import _native
from ndf._arguments import choice, count, flag
from ndf._arrays import Floats, Ints, floats, mesh, takes_meshes
from ndf._native import NdfError
from ndf._progress import Progress, observer
from ndf._warnings import warn


def _sparse(csr: tuple[Floats, Ints, Ints]) -> Any:
    try:
        from scipy.sparse import csr_matrix
    except ImportError:
        return csr
    count = len(csr[2]) - 1
    return csr_matrix(csr, shape=(count, count))


def _operator(mass: str, delaunay: bool) -> tuple[str, bool]:
    return choice(mass, "mass", "lumped", "voronoi", "consistent"), flag(delaunay, "delaunay")


def _modes(k: int) -> int:
    return count(k, "k", 1, 2**32 - 1)


@takes_meshes
def laplacian(
    vertices: Any,
    faces: Any = None,
    *,
    mass: Literal["lumped", "voronoi", "consistent"] = "lumped",
    delaunay: bool = True,
) -> tuple[Any, Any]:
    """The cotangent Laplacian L, positive semi-definite, and the mass matrix M of a mesh, both ``(n, n)``.

    Parameters
    ----------
    vertices, faces
        ``(n, 3)`` and ``(m, 3)``, or one object with both. Meshes that are not manifold go through their tufted cover.
    mass
        ``lumped`` thirds of areas, the mixed ``voronoi`` areas, or ``consistent``. It sums to the area.
    delaunay
        Flip to the intrinsic Delaunay triangulation first, with which no weight is negative.

    Returns
    -------
    L, M
        SciPy's ``csr_matrix``; without SciPy ``(data, indices, indptr)``. Rows of vertices that no face uses are empty.

    Raises
    ------
    NdfError
        If no face has an area, or a vertex has none around it.

    Source: Pinkall and Polthier (1993); Bobenko and Springborn (2007); Sharp and Crane (2020).
    """
    kind, is_delaunay = _operator(mass, delaunay)
    stiffness, masses = _native.laplacian(*mesh(vertices, faces), kind, is_delaunay)
    return _sparse(stiffness), _sparse(masses)


@takes_meshes
def spectrum(
    vertices: Any,
    faces: Any = None,
    k: int = 20,
    *,
    mass: Literal["lumped", "voronoi", "consistent"] = "lumped",
    delaunay: bool = True,
    boundary: Literal["neumann", "dirichlet"] = "neumann",
    multigrid: bool = False,
    progress: Progress = False,
) -> tuple[Floats, Floats]:
    """The ``k`` smallest eigenvalues ``(k,)`` of L φ = λ M φ, in inverse squared units of length, and modes ``(n, k)``.

    Modes are orthonormal in M; the sign of each is arbitrary. They are nan at vertices that no face uses. With ``boundary="dirichlet"``
    they are zero on boundaries. With ``multigrid`` there is no factorisation, whose memory huge meshes may not have: that is some ten times slower,
    and there is no check that no mode is missing.

    Raises
    ------
    NdfError
        If there are fewer vertices than modes, or they do not converge.

    Source: shift-invert block Lanczos with thick restart (Wu and Simon 2000), of many modes slice by slice (Grimes, Lewis and Simon
    1994); none is missing, which is checked. Multigrid by smoothed aggregation (Vaněk, Mandel and Brezina 1996).
    """
    operator = _operator(mass, delaunay)
    is_held = choice(boundary, "boundary", "neumann", "dirichlet") == "dirichlet"
    with observer(progress) as observing:
        found = _native.spectrum(*mesh(vertices, faces), _modes(k), operator, (is_held, multigrid), observing)
    (values, rows), notes = found
    warn(notes)
    return values, rows.T


@takes_meshes
def heat_kernel_signature(
    vertices: Any,
    faces: Any = None,
    times: ArrayLike | None = None,
    *,
    k: int = 100,
    progress: Progress = False,
) -> Floats:
    """Heat kernel signatures ``(n, t)`` at ``times`` ``(t,)``, in squared units of length: how much heat stays at a vertex.

    ``k`` modes are used, or as many as there are vertices. NdfError if there is no time, or one is negative or not finite.

    Source: Sun, Ovsjanikov, Guibas (2009).
    """
    if times is None:
        raise NdfError("times are missing; give the times of the heat kernel, in squared units of length")
    wanted = floats(times, "times", None)
    if len(wanted) == 0:
        raise NdfError("times are empty; give at least one time")
    wrong = wanted[~(np.isfinite(wanted) & (wanted >= 0.0))]
    if len(wrong) > 0:
        raise NdfError(f"times must be numbers that are not negative, not {wrong[0]}")
    with observer(progress) as observing:
        rows, notes = _native.heat_kernel_signature(
            *mesh(vertices, faces), wanted.tolist(), _modes(k), observing
        )
    warn(notes)
    return rows.T


@takes_meshes
def wave_kernel_signature(
    vertices: Any,
    faces: Any = None,
    energies: int = 100,
    *,
    k: int = 100,
    progress: Progress = False,
) -> Floats:
    """Wave kernel signatures ``(n, energies)``: how likely a quantum particle of an energy is at a vertex.

    Energies are evenly spaced in the logarithm between the first eigenvalue above zero and the last of ``k``.

    Source: Aubry, Schlickewei, Cremers (2011).
    """
    with observer(progress) as observing:
        rows, notes = _native.wave_kernel_signature(
            *mesh(vertices, faces), count(energies, "energies", 1, 100_000), _modes(k), observing
        )
    warn(notes)
    return rows.T
