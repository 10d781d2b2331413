"""How progress is shown."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeAlias, Union

import numpy as np

from ndf._native import NdfError

#: What is called with a stage and a fraction of it.
Observer: TypeAlias = Callable[[str, float], object]

#: Nothing, a bar of tqdm where that is installed, or ``callable(stage, fraction)``.
Progress: TypeAlias = Union[bool, Observer]


@contextmanager
def observer(progress: Progress) -> Iterator[Union[Observer, None]]:
    """What the native part calls on the thread of the caller."""
    if not isinstance(progress, (bool, np.bool_)):
        if not callable(progress):
            raise NdfError(f"progress must be True, False or callable(stage, fraction), not {progress!r}")
        yield progress
        return
    if not progress:
        yield None
        return
    try:
        from tqdm.auto import tqdm
    except ImportError:
        yield None
        return
    bar: Any = tqdm(total=1.0, bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}")

    def show(stage: str, fraction: float) -> None:
        bar.set_description_str(stage, refresh=False)
        bar.n = fraction
        bar.refresh()

    with bar:
        yield show
