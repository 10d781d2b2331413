"""Ctrl-C ends long work soon, wherever it comes."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

#: Work that takes long on a mesh of some 100,000 faces; each would go on for far longer than it is waited for.
WORK = {
    "extract": "model.extract(0.0015, report=True)",
    "intrinsic": "ndf.remesh(V, F, 0.0025, method='intrinsic')",
    "isotropic": "ndf.remesh(V, F, 0.002)",
    "winding": "ndf.winding_number(V, F, np.tile(Q, (200, 1)))",
    "closest": "ndf.closest_point(V, F, np.tile(Q, (50, 1)))",
    "measure": "[ndf.measure(V, F, V + 0.01, F, samples=1_000_000) for _ in range(100)]",
    "decimate": "[ndf.decimate(V, F, faces=1000) for _ in range(100)]",
    "heat": "[ndf.geodesic_distance(V, F, 0, method='heat') for _ in range(100)]",
    "spectrum": "ndf.spectrum(V, F, k=1500)",
}

SCRIPT = """
    import os, signal, threading, time
    import numpy as np, ndf
    from tests.shapes import torus
    V, F = torus(320, 160)
    Q = np.random.default_rng(0).uniform(-1.5, 1.5, (100_000, 3))
    model = ndf.fit(*torus(24, 12), base_faces=60)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sent = []
    def interrupt():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)
    threading.Timer(1.0, interrupt).start()
    try:
        WORK
        print("ended", flush=True)
    except KeyboardInterrupt:
        print(time.monotonic() - sent[0], flush=True)
"""


@pytest.mark.parametrize("work", WORK)
def test_ctrl_c_ends(work: str) -> None:
    here = os.path.dirname(os.path.dirname(__file__))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([here, os.environ.get("PYTHONPATH", "")])}
    script = textwrap.dedent(SCRIPT).replace("WORK", WORK[work])
    printed = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", script], env=environment, capture_output=True, text=True, check=True
    ).stdout.strip()
    # Half a second where nothing else runs.
    assert printed != "ended" and float(printed) < 6, printed
