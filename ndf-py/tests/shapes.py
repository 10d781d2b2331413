"""Meshes made by code."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]


def torus(rings: int = 48, sides: int = 24, radius: float = 1.0, tube: float = 0.4) -> Mesh:
    """A torus around the z axis, oriented outward."""
    u, v = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    angle, around = 2 * np.pi * u / rings, 2 * np.pi * v / sides
    reach = radius + tube * np.cos(around)
    points = np.stack([reach * np.cos(angle), reach * np.sin(angle), tube * np.sin(around)], axis=-1)
    here, right = u * sides + v, (u + 1) % rings * sides + v
    up, across = u * sides + (v + 1) % sides, (u + 1) % rings * sides + (v + 1) % sides
    faces = np.stack([here, right, across, here, across, up], axis=-1)
    return points.reshape(-1, 3), faces.reshape(-1, 3).astype(np.int64)


def sphere(rounds: int = 3) -> Mesh:
    """A sphere of radius 1: an octahedron, subdivided."""
    vertices = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    points = [np.array(v, float) for v in vertices]
    for _ in range(rounds):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int) -> int:
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(points)
                point = points[a] + points[b]
                points.append(point / np.linalg.norm(point))
            return middles[key]

        finer = []
        for a, b, c in faces:
            x, y, z = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, x, z), (x, b, y), (z, y, c), (x, y, z)]
        faces = finer
    return np.array(points), np.array(faces, np.int64)


def square() -> Mesh:
    """The unit square of two faces."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    return points, np.array([[0, 1, 2], [0, 2, 3]], np.int64)


def soup() -> Mesh:
    """Three faces at one edge."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]], float)
    return points, np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]], np.int64)
