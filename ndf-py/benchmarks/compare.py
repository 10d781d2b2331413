"""The package beside others on the same arrays, in turns: writes the table of docs/python.md (`cargo xtask python compare`)."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import ndf

ROUNDS = 3
# No further turn begins after so many seconds of a task: some exact distances take a minute.
PATIENCE = 40.0
PAGE = Path(__file__).parents[2] / "docs" / "python.md"
BEGIN, END = "<!-- made by `cargo xtask python compare` -->", "<!-- end -->"


def bumpy_torus(rings: int = 320, sides: int = 160) -> tuple[Any, Any]:
    """102,400 faces."""
    u, v = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    a, b = 2 * np.pi * u / rings, 2 * np.pi * v / sides
    tube = 0.4 + 0.03 * np.sin(7 * a + 2 * b) + 0.02 * np.cos(5 * b - 3 * a)
    reach = 1 + tube * np.cos(b)
    points = np.stack([reach * np.cos(a), reach * np.sin(a), tube * np.sin(b)], axis=-1)
    right, up = (u + 1) % rings, (v + 1) % sides
    here, there = u * sides + v, right * sides + up
    faces = np.stack([here, right * sides + v, there, here, there, u * sides + up], axis=-1)
    return points.reshape(-1, 3), faces.reshape(-1, 3).astype(np.int64)


V, F = bumpy_torus()
Q = np.random.default_rng(0).uniform(-1.5, 1.5, (100_000, 3))
Task = tuple[str, Callable[[], Any], str, Callable[[], Any], Callable[[Any, Any], str]]


def relative(ours: Any, theirs: Any) -> str:
    ours, theirs = np.ravel(ours), np.ravel(theirs)
    return f"{np.abs(ours - theirs).max() / np.abs(theirs).max():.0e}"


def mean_relative(ours: Any, theirs: Any) -> str:
    return f"mean {np.abs(ours - theirs).mean() / np.abs(theirs).mean():.0e}"


def tasks() -> list[Task]:
    """What to do, by us and by others that are installed."""
    found: list[Task] = []

    def add(package: str, what: str, ours: Callable[[], Any], make: Callable[[Any], Any], agreement: Any) -> None:
        try:
            module = __import__(package, fromlist=["x"])
        except ImportError:
            print(f"{package} is not installed", file=sys.stderr)
            return
        found.append((what, ours, package.split(".")[0], make(module), agreement))

    none, source, solver = np.empty(0, np.int64), np.array([0]), ndf.GeodesicSolver(V, F)
    solver.distance(0, method="heat")

    # libigl needs many minutes for the larger mesh.
    few, corners = bumpy_torus(160, 80)
    them = np.arange(len(few))

    def exact() -> Any:
        return ndf.geodesic_distance(V, F, 0)

    def warm() -> Any:
        return solver.distance(0, method="heat")

    add("igl", f"exact distances, {len(corners):,} faces", lambda: ndf.geodesic_distance(few, corners, 0),
        lambda igl: lambda: igl.exact_geodesic(few, corners, source, none, them, none), relative)  # fmt: skip
    add("pygeodesic.geodesic", "exact distances", exact,
        lambda p: lambda: p.PyGeodesicAlgorithmExact(V, F).geodesicDistances(source, None)[0], relative)  # fmt: skip

    def heat(potpourri: Any) -> Callable[[], Any]:
        prepared = potpourri.MeshHeatMethodDistanceSolver(V, F)
        return lambda: prepared.compute_distance(0)

    add("potpourri3d", "heat method, factored before", warm, heat, mean_relative)
    add("robust_laplacian", "Laplacian and masses", lambda: ndf.laplacian(V, F),
        lambda robust: lambda: robust.mesh_laplacian(V, F, mollify_factor=0.0),
        lambda a, b: f"{abs(a[0] - b[0]).max() / abs(b[0]).max():.0e}")  # fmt: skip
    laplacian, mass = ndf.laplacian(V, F)
    add("scipy.sparse.linalg", "20 eigenvalues and modes", lambda: ndf.spectrum(V, F, k=20),
        lambda scipy: lambda: scipy.eigsh(laplacian, 20, mass, sigma=-1e-3, which="LM"),
        lambda a, b: relative(a[0], np.sort(b[0])))  # fmt: skip
    add("igl", "100,000 closest points", lambda: ndf.closest_point(V, F, Q)[0],
        lambda igl: lambda: igl.point_mesh_squared_distance(Q, V, F)[2], relative)  # fmt: skip
    add("igl", "100,000 winding numbers", lambda: ndf.winding_number(V, F, Q),
        lambda igl: lambda: igl.fast_winding_number(V, F, Q), relative)  # fmt: skip
    return found


def timed(function: Callable[[], Any]) -> tuple[float, Any]:
    started = time.perf_counter()
    result = function()
    return time.perf_counter() - started, result


def overhead() -> tuple[float, float]:
    """Seconds of exact distances as the program measures them inside, and as a call from Python."""
    solver = ndf.GeodesicSolver(V, F)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "a.off"
        lines = [f"OFF\n{len(V)} {len(F)} 0"]
        lines += [f"{x!r} {y!r} {z!r}" for x, y, z in V.tolist()]
        lines += [f"3 {a} {b} {c}" for a, b, c in F.tolist()]
        place.write_text("\n".join(lines))
        command = [sys.executable, "-m", "ndf", "geodesic", str(place), "-o", f"{folder}/b.ply"]
        command += ["--source-vertex", "0", "--json", "--quiet"]
        rust, python = [], []
        for _ in range(2 * ROUNDS):
            printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
            rust.append(json.loads(printed)["seconds"])
            python.append(timed(lambda: solver.distance(0))[0])
    return min(rust), min(python)


def main() -> None:
    rows = []
    for what, ours, package, theirs, agreement in tasks():
        mine, other = [], []
        while len(mine) < ROUNDS and sum(mine) + sum(other) < PATIENCE:
            seconds, result = timed(ours)
            mine.append(seconds)
            seconds, expected = timed(theirs)
            other.append(seconds)
        least = f"{min(mine):.3f} | {min(other):.3f} | {len(mine)}"
        rows.append(f"| {what} | {package} | {agreement(result, expected)} | {least} |")
        print(rows[-1], flush=True)
    rust, python = overhead()
    text = f"""{BEGIN}
{len(F):,} faces, the least of the turns in seconds, {os.cpu_count()} cores of {platform.machine()}, Python {platform.python_version()}.
Agreement is the largest difference, a share of the largest value.

| | other | agreement | ndf | other | turns |
|---|---|---|---|---|---|
{chr(10).join(rows)}

Exact distances take {rust:.3f} s in the program and {python:.3f} s as a call from Python: {100 * (python / rust - 1):+.1f} %.
{END}"""
    page = PAGE.read_text()
    before, after = page.split(BEGIN)[0], page.split(END)[1]
    PAGE.write_text(before + text + after)


if __name__ == "__main__":
    main()
