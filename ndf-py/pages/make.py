"""Writes docs/python/: a page for each group of functions, from the docstrings of the installed package and from the examples
beside this file, and with `--pictures` also the pictures of these examples (`cargo xtask python pages`).

An example is a script whose last lines leave a mesh `V, F`, and may leave values per vertex `u` to colour it by. The page
shows the script, and the picture is drawn of what it leaves, by the program that the package has.
"""

from __future__ import annotations

import inspect
import os
import re
import subprocess
import sys
import tempfile
import webbrowser
from pathlib import Path
from typing import Any

import numpy as np

import ndf

HERE = Path(__file__).resolve().parent
FOLDER = HERE.parents[1] / "docs" / "python"

#: The pages: name, title, and what is on them.
PAGES: list[tuple[str, str, list[Any]]] = [
    ("learning", "Learning a surface", [ndf.fit, ndf.fit_points, ndf.fit_file, ndf.fit_surface, ndf.Surface]),
    ("models", "Models and their scalars", [ndf.Model]),
    ("distances", "Distances and paths", [ndf.geodesic_distance, ndf.GeodesicSolver, ndf.Path]),
    (
        "spectra",
        "Laplacians and spectra",
        [ndf.laplacian, ndf.spectrum, ndf.heat_kernel_signature, ndf.wave_kernel_signature],
    ),
    ("meshing", "Meshes of meshes and of fields", [ndf.remesh, ndf.decimate, ndf.marching_cubes]),
    ("showing", "Showing surfaces", [ndf.show, ndf.View]),
    ("measures", "Measures and queries", [ndf.measure, ndf.info, ndf.winding_number, ndf.closest_point]),
]


def signature(function: Any, name: str) -> str:
    """A call with its defaults, without types: these are in the stubs, and shapes in the text."""
    parameters, is_keyword = [], False
    for parameter in inspect.signature(function).parameters.values():
        if parameter.name in ("self", "cls"):
            continue
        if parameter.kind is parameter.KEYWORD_ONLY and not is_keyword:
            parameters.append("*")
            is_keyword = True
        default = "" if parameter.default is parameter.empty else f"={parameter.default!r}"
        stars = {parameter.VAR_POSITIONAL: "*", parameter.VAR_KEYWORD: "**"}.get(parameter.kind, "")
        parameters.append(f"{stars}{parameter.name}{default}")
    return f"{name}({', '.join(parameters)})"


def markdown(docstring: str | None) -> str:
    """A docstring with numpydoc's sections as Markdown."""
    text = re.sub(r":\w+:`([^`]*)`", r"`\1`", inspect.cleandoc(docstring or "")).replace("``", "`")
    lines: list[str] = []
    rows, k, is_list = text.splitlines(), 0, False
    while k < len(rows):
        row = rows[k]
        if k + 1 < len(rows) and rows[k + 1] and set(rows[k + 1]) == {"-"}:
            lines += [f"*{row}*", ""]
            is_list, k = True, k + 2
            continue
        if is_list and row and not row.startswith(" "):
            below = []
            while k + 1 < len(rows) and rows[k + 1].startswith(" "):
                k += 1
                below.append(rows[k].strip())
            # A paragraph after the sections is no entry.
            if below:
                names = ", ".join(f"`{name.strip()}`" for name in row.split(","))
                lines.append(f"- {names}: {' '.join(below)}")
            else:
                is_list = False
                lines.append(row)
        else:
            lines.append(row)
        k += 1
    return "\n".join(lines).strip()


def entry(item: Any) -> str:
    """What a page says of a function, or of a class and its members."""
    name = f"ndf.{item.__name__}"
    if not inspect.isclass(item):
        return f"## `{name}`\n\n```python\n{signature(item, name)}\n```\n\n{markdown(item.__doc__)}\n"
    parts = [f"## `{name}`\n\n{markdown(item.__doc__)}\n"]
    own_init = "__init__" in vars(item) and not hasattr(item, "_fields") and item not in (ndf.Model, ndf.Surface)
    if own_init:
        parts[0] = f"## `{name}`\n\n```python\n{signature(item, name)}\n```\n\n{markdown(item.__doc__)}\n"
    for member, value in vars(item).items():
        function = value.__func__ if isinstance(value, staticmethod) else value
        if member.startswith("_") or not getattr(function, "__doc__", None):
            continue
        if isinstance(function, property):
            parts.append(f"### `{item.__name__}.{member}`\n\n{markdown(function.__doc__)}\n")
        elif inspect.isfunction(function):
            call = signature(function, f"{item.__name__}.{member}")
            parts.append(f"### `{item.__name__}.{member}`\n\n```python\n{call}\n```\n\n{markdown(function.__doc__)}\n")
    return "\n".join(parts)


def page(name: str, title: str, items: list[Any]) -> str:
    example = (HERE / f"{name}.py").read_text()
    caption, script = re.fullmatch(r'"""(.*?)"""\n+(.*)', example, re.DOTALL).groups()  # type: ignore[union-attr]
    head = f"# {title}\n\n<!-- made by `cargo xtask python pages` from the docstrings and from ndf-py/pages/{name}.py -->\n\n"
    picture = f"![{caption}](images/{name}.png)\n\n*{caption}*\n\n```python\n{script.strip()}\n```\n\n"
    return head + picture + "\n".join(entry(item) for item in items)


def written() -> dict[str, str]:
    """The pages by the names of their files."""
    return {f"{name}.md": page(name, title, items) for name, title, items in PAGES}


def draw(name: str) -> None:
    """Runs an example, and draws what it leaves."""
    left: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        webbrowser.open = lambda *_: True
        exec(compile((HERE / f"{name}.py").read_text(), f"{name}.py", "exec"), left)
        vertices, faces, values = left["V"], left["F"], left.get("u")
        place = Path(folder) / "mesh.ply"
        write_ply(place, vertices, faces, values)
        command = [sys.executable, "-m", "ndf", "render", str(place), "-o", str(FOLDER / "images" / f"{name}.png")]
        command += ["--size", "720,480", *left.get("view", [])]
        command += ["--scalar", "u"] if values is not None else []
        subprocess.run(command, check=True)
        os.chdir(HERE)


def write_ply(place: Path, vertices: Any, faces: Any, values: Any) -> None:
    columns = [vertices] if values is None else [vertices, np.asarray(values)[:, None]]
    names = "xyz" if values is None else "xyzu"
    header = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    header += [f"property double {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = [" ".join(map(repr, row)) for row in np.hstack(columns).tolist()]
    rows += [f"3 {a} {b} {c}" for a, b, c in faces.tolist()]
    place.write_text("\n".join(header + rows) + "\n")


def main() -> None:
    (FOLDER / "images").mkdir(parents=True, exist_ok=True)
    for file, text in written().items():
        (FOLDER / file).write_text(text)
    if "--pictures" in sys.argv[1:]:
        for name, _, _ in PAGES:
            draw(name)


if __name__ == "__main__":
    main()
