"""Warnings, which point at the line outside of the package from which it was called."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable


class NdfWarning(UserWarning):
    """What was left out, changed or is doubtful: the sentences that the program writes to the error stream."""


def warn(notes: Iterable[str]) -> None:
    """Warns of every note."""
    depth = 2
    while _is_own(depth):
        depth += 1
    for note in notes:
        warnings.warn(note, NdfWarning, stacklevel=depth)


def _is_own(depth: int) -> bool:
    """Whether what called so many levels above `warn` is of the package."""
    try:
        module = sys._getframe(depth).f_globals.get("__name__", "")
    except ValueError:
        return False
    return bool(module.partition(".")[0] == "ndf")
