"""Checks of arguments that are no arrays. Every failure names the argument, what was expected and what was given."""

from __future__ import annotations

import math
import numbers
import os
from typing import Any

import numpy as np

from ndf._native import NdfError


def count(value: Any, what: str, low: int, high: int) -> int:
    """A whole number between bounds."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Integral):
        raise NdfError(f"{what} must be a whole number, not {value!r}")
    number = int(value)
    if number < low:
        raise NdfError(f"{what} must be at least {low}, not {number}")
    if number > high:
        raise NdfError(f"{what} must be at most {high}, not {number}")
    return number


def number(value: Any, what: str) -> float:
    """A finite number."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real) or not math.isfinite(value):
        raise NdfError(f"{what} must be a number, not {value!r}")
    return float(value)


def positive(value: Any, what: str) -> float:
    """A finite number above zero."""
    found = number(value, what)
    if found <= 0.0:
        raise NdfError(f"{what} must be a positive number, not {value!r}")
    return found


def share(value: Any, what: str, example: str) -> float:
    """A number between 0 and 1."""
    found = number(value, what)
    if not 0.0 < found < 1.0:
        raise NdfError(f"{what} must be a share between 0 and 1 such as {example}, not {value!r}")
    return found


def flag(value: Any, what: str) -> bool:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise NdfError(f"{what} must be True or False, not {value!r}")
    return bool(value)


def choice(value: Any, what: str, *allowed: str) -> str:
    """One of some words."""
    if not isinstance(value, str) or value not in allowed:
        raise NdfError(f"{what} must be {', '.join(allowed[:-1])} or {allowed[-1]}, not {value}")
    return value


def text(value: Any, what: str) -> str:
    """A string."""
    if not isinstance(value, str):
        raise NdfError(f"{what} must be a string, not {value!r}")
    return value


def file_path(value: Any, what: str) -> str:
    """The name of a file."""
    try:
        return os.fsdecode(value)
    except TypeError:
        raise NdfError(f"{what} must be the name of a file, not {value!r}") from None
