"""The pages of the documentation say what the docstrings say."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import ndf

HERE = Path(__file__).parent


def _maker() -> Any:
    specification = importlib.util.spec_from_file_location("make", HERE.parent / "pages" / "make.py")
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_pages_are_current() -> None:
    maker = _maker()
    stale = [name for name, text in maker.written().items() if (maker.FOLDER / name).read_text() != text]
    assert not stale, f"{stale}: run cargo xtask python pages"


def test_everything_public_is_on_a_page() -> None:
    listed = {item.__name__ for _, _, items in _maker().PAGES for item in items}
    assert set(ndf.__all__) - listed == {"NdfError", "NdfWarning", "__version__", "compat"}


def test_sections_become_lists() -> None:
    text = """Does it.

    Parameters
    ----------
    a, b
        The ``first``
        of :func:`fit`.

    Source: someone.
    """
    assert _maker().markdown(text) == "Does it.\n\n*Parameters*\n\n- `a`, `b`: The `first` of `fit`.\n\nSource: someone."
