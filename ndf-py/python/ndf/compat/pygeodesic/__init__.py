"""In the place of pygeodesic: ``from ndf.compat.pygeodesic import geodesic``."""

from ndf.compat.pygeodesic import geodesic as geodesic
