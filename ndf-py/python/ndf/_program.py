"""The program ``ndf``."""

from __future__ import annotations

import signal
import sys

from ndf import _native


def main() -> int:
    """Runs the program with the arguments of the process. Signals are its own affair."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.run_program(["ndf", *sys.argv[1:]], [sys.executable, "-m", "ndf"])
