"""The native part: positional arguments, contiguous arrays. Private; what it does is documented where it is called."""

from collections.abc import Callable
from os import PathLike
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "GeodesicSolver",
    "Model",
    "NdfError",
    "__version__",
    "closest_point",
    "decimate",
    "fit_file",
    "fit_mesh",
    "fit_points",
    "fit_surface",
    "heat_kernel_signature",
    "info",
    "laplacian",
    "marching_cubes",
    "measure",
    "mesh_page",
    "model_page",
    "remesh",
    "remesh_intrinsically",
    "run_program",
    "spectrum",
    "wave_kernel_signature",
    "winding_number",
]
__version__: str

_Floats: TypeAlias = NDArray[np.float64]
_Ints: TypeAlias = NDArray[np.int64]
_Mesh: TypeAlias = tuple[_Floats, _Ints]
_Place: TypeAlias = tuple[int, tuple[float, float, float] | None]
_Csr: TypeAlias = tuple[_Floats, _Ints, _Ints]
_Observer: TypeAlias = Callable[[str, float], object] | None
_Path: TypeAlias = str | PathLike[str]

class NdfError(ValueError): ...

@final
class Model:
    @staticmethod
    def from_bytes(bytes: bytes) -> Model: ...
    def to_bytes(self) -> bytes: ...
    def save(self, path: _Path) -> None: ...
    def base(self) -> _Mesh: ...
    def extract(
        self,
        edge_length: float | None,
        relative_edge_length: float | None,
        reported: bool,
        observer: _Observer,
    ) -> tuple[_Mesh, tuple[_Ints, _Floats], str | None]: ...
    def evaluate(self, face: _Ints, bary: _Floats) -> _Floats: ...
    def normals(self, face: _Ints, bary: _Floats) -> _Floats: ...
    def scalars(self) -> str: ...
    def add_scalars(
        self,
        names: list[str],
        values: _Floats,
        vertices: _Floats,
        faces: _Ints,
        size: int | None,
        error: float | None,
        seed: int,
        observer: _Observer,
    ) -> str: ...
    def eval_scalars(self, name: str, face: _Ints, bary: _Floats) -> _Floats: ...

@final
class GeodesicSolver:
    def __new__(cls, vertices: _Floats, faces: _Ints) -> GeodesicSolver: ...
    def notes(self) -> list[str]: ...
    def distance(self, sources: list[_Place], heat: bool, time_step: float | None) -> _Floats: ...
    def distance_at(
        self, sources: list[_Place], face: _Ints, bary: _Floats, heat: bool, time_step: float | None
    ) -> _Floats: ...
    def path(self, from_: _Place, to: _Place, /) -> tuple[_Floats, _Ints, _Floats, float]: ...
    def matrix(self, vertices: list[int], threads: int | None, observer: _Observer) -> _Floats: ...

def model_page(
    model: Model,
    name: str,
    scalar: str | None,
    source: list[float] | None,
    edge_length: float | None,
) -> str: ...
def mesh_page(
    vertices: _Floats,
    faces: _Ints,
    names: list[str],
    values: _Floats,
    name: str,
    scalar: str | None,
    source: list[float] | None,
) -> str: ...
def run_program(arguments: list[str], itself: list[str]) -> int: ...
def fit_mesh(
    vertices: _Floats,
    faces: _Ints,
    name: _Path | None,
    largest_component: bool,
    base: _Mesh | None,
    options: dict[str, Any],
    observer: _Observer,
) -> tuple[Model, str, list[str]]: ...
def fit_points(
    positions: _Floats,
    normals: _Floats | None,
    name: _Path | None,
    base: _Mesh | None,
    options: dict[str, Any],
    observer: _Observer,
) -> tuple[Model, str, list[str]]: ...
def fit_file(
    path: _Path,
    kind: str | None,
    iso: float | None,
    largest_component: bool,
    keep_seams: bool,
    base: _Mesh | None,
    options: dict[str, Any],
    observer: _Observer,
) -> tuple[Model, str, list[str]]: ...
def fit_surface(
    object: Any, base: _Mesh | None, options: dict[str, Any], observer: _Observer
) -> tuple[Model, str, list[str]]: ...
def laplacian(vertices: _Floats, faces: _Ints, mass: str, delaunay: bool) -> tuple[_Csr, _Csr]: ...
def spectrum(
    vertices: _Floats, faces: _Ints, k: int, operator: tuple[str, bool], held_multigrid: tuple[bool, bool], observer: _Observer
) -> tuple[tuple[_Floats, _Floats], list[str]]: ...
def heat_kernel_signature(
    vertices: _Floats, faces: _Ints, times: list[float], k: int, observer: _Observer
) -> tuple[_Floats, list[str]]: ...
def wave_kernel_signature(
    vertices: _Floats, faces: _Ints, count: int, k: int, observer: _Observer
) -> tuple[_Floats, list[str]]: ...
def remesh(
    vertices: _Floats, faces: _Ints, edge_length: float, rounds: int, observer: _Observer
) -> tuple[_Mesh, list[str]]: ...
def remesh_intrinsically(
    vertices: _Floats, faces: _Ints, edge_length: float, observer: _Observer
) -> tuple[_Mesh, list[str]]: ...
def decimate(
    vertices: _Floats, faces: _Ints, count: int, observer: _Observer
) -> tuple[_Mesh, _Ints, list[str]]: ...
def marching_cubes(
    field: Callable[[_Floats], Any],
    bounds: Any,
    grid: int,
    level: float,
    above: bool,
    threads: int | None,
    observer: _Observer,
) -> _Mesh: ...
def measure(
    vertices: _Floats,
    faces: _Ints,
    other_vertices: _Floats,
    other_faces: _Ints,
    samples: int,
    seed: int,
) -> str: ...
def info(vertices: _Floats, faces: _Ints) -> str: ...
def winding_number(
    vertices: _Floats, faces: _Ints, queries: _Floats
) -> tuple[_Floats, list[str]]: ...
def closest_point(
    vertices: _Floats, faces: _Ints, queries: _Floats
) -> tuple[tuple[_Floats, _Ints, _Floats], list[str]]: ...
