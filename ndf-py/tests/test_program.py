"""The program in the package, and that it gives the same bytes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

import ndf

from .shapes import torus


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "ndf", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def write_obj(place: Path, vertices: object, faces: object) -> None:
    lines = ["v {!r} {!r} {!r}".format(*map(float, v)) for v in np.asarray(vertices)]
    lines += ["f {} {} {}".format(*(np.asarray(f) + 1)) for f in np.asarray(faces)]
    place.write_text("\n".join(lines) + "\n")


def test_exit_codes() -> None:
    version = run("--version")
    assert version.returncode == 0 and ndf.__version__ in version.stdout
    assert run("info", "missing.ply").returncode == 1
    assert run("no-such-command").returncode == 2


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    vertices, faces = torus()
    place, model = tmp_path / "torus.obj", tmp_path / "torus.ndf"
    write_obj(place, vertices, faces)
    for arguments, options in [
        ((), {}),
        (("--features", "4", "--epochs", "20", "--samples", "512"), {"features": 4, "epochs": 20, "samples": 512}),
    ]:
        common = ("--base-faces", "300", "--seed", "7", "--quiet", "--json")
        done = run("fit", place, "-o", model, *common, *arguments)
        assert done.returncode == 0, done.stderr
        of_file = ndf.fit_file(place, base_faces=300, seed=7, **options)  # type: ignore[arg-type]
        assert of_file.to_bytes() == model.read_bytes()
        of_arrays = ndf.fit(vertices, faces, base_faces=300, seed=7, name=place, **options)  # type: ignore[arg-type]
        assert of_arrays.to_bytes() == model.read_bytes()
        assert set(of_file.report) == set(json.loads(done.stdout))


def test_figures_are_those_of_the_program(tmp_path: Path) -> None:
    vertices, faces = torus()
    a, b = tmp_path / "a.obj", tmp_path / "b.obj"
    write_obj(a, vertices, faces)
    write_obj(b, vertices * 1.01, faces)
    told = json.loads(run("measure", a, b, "--json").stdout)
    found = ndf.measure(vertices, faces, vertices * 1.01, faces)
    del told["seconds"], found["seconds"]
    assert told == found
    told = json.loads(run("info", a, "--json").stdout)
    del told["format"]
    assert told == ndf.info(vertices, faces)


def test_a_batch_starts_the_program_of_the_package(tmp_path: Path) -> None:
    vertices, faces = torus()
    for name in ("a.obj", "b.obj"):
        write_obj(tmp_path / name, vertices, faces)
    done = run("batch", "info", tmp_path, "-o", tmp_path / "run", "--jobs", "1", "--json", "--quiet")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["counts"]["ok"] == 2
