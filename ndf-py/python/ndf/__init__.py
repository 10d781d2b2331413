"""Neural displacement fields, exact geodesics and spectra of surfaces, on NumPy arrays.

A mesh is two arrays, vertices ``(n, 3)`` and faces ``(m, 3)``, or one object that has both (of trimesh, meshio or pyvista).
Nothing is changed in place. Every failure is a :class:`NdfError` that says what is wrong.

>>> import ndf
>>> model = ndf.fit(V, F)                              # doctest: +SKIP
>>> V2, F2 = model.extract(edge_length=0.01)           # doctest: +SKIP
>>> d = ndf.geodesic_distance(V2, F2, 0)               # doctest: +SKIP
>>> w, phi = ndf.spectrum(V2, F2, k=20)                # doctest: +SKIP
"""

from ndf import compat
from ndf._fit import Surface, fit, fit_file, fit_points, fit_surface
from ndf._geodesics import GeodesicSolver, Path, geodesic_distance
from ndf._measures import closest_point, info, measure, winding_number
from ndf._meshing import decimate, marching_cubes, remesh
from ndf._model import Model
from ndf._native import NdfError, __version__
from ndf._show import View, show
from ndf._spectra import heat_kernel_signature, laplacian, spectrum, wave_kernel_signature
from ndf._warnings import NdfWarning

__all__ = [
    "GeodesicSolver",
    "Model",
    "NdfError",
    "NdfWarning",
    "Path",
    "Surface",
    "View",
    "__version__",
    "closest_point",
    "compat",
    "decimate",
    "fit",
    "fit_file",
    "fit_points",
    "fit_surface",
    "geodesic_distance",
    "heat_kernel_signature",
    "info",
    "laplacian",
    "marching_cubes",
    "measure",
    "remesh",
    "show",
    "spectrum",
    "wave_kernel_signature",
    "winding_number",
]
