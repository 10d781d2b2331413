"""The interpreter goes on while Rust works, and Rust ends when it should."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import ndf

from .shapes import torus

V, F = torus(96, 48)


def test_a_thread_counts_during_fit() -> None:
    counted, done = 0, threading.Event()

    def count() -> None:
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    started = time.monotonic()
    ndf.fit(V, F, base_faces=1000)
    seconds, so_far = time.monotonic() - started, counted
    done.set()
    thread.join()
    # Two cores may be busy with the fit itself; a locked interpreter would not have counted at all.
    assert so_far > 20 * seconds, (so_far, seconds)


def test_two_fits_in_threads_have_the_bytes_of_single_ones() -> None:
    def bytes_of(seed: int) -> bytes:
        return ndf.fit(V, F, base_faces=200, seed=seed).to_bytes()

    single = [bytes_of(seed) for seed in (1, 2)]
    with ThreadPoolExecutor(2) as executor:
        assert list(executor.map(bytes_of, (1, 2))) == single
    assert single[0] != single[1]


def test_the_number_of_threads_changes_no_byte() -> None:
    found = {ndf.fit(V, F, base_faces=200, threads=threads).to_bytes() for threads in (1, 2, 3)}
    assert len(found) == 1


def test_progress() -> None:
    told: list[tuple[str, float]] = []
    ndf.fit(V, F, base_faces=200, progress=lambda stage, fraction: told.append((stage, fraction)))
    assert {"levels"} <= {stage for stage, _ in told} and all(0 <= fraction <= 1 for _, fraction in told)
    ndf.fit(V, F, base_faces=200, progress=True)


def test_an_exception_in_progress_comes_out() -> None:
    def stop(stage: str, fraction: float) -> None:
        raise LookupError(stage)

    with pytest.raises(LookupError):
        ndf.fit(V, F, progress=stop)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_ends_fit() -> None:
    # Processes in the background are started with the signal ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    started = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            ndf.fit(V, F, epochs=1_000_000, time_limit=60)
    finally:
        signal.signal(signal.SIGINT, before)
    assert time.monotonic() - started < 10
    # And all goes on.
    assert ndf.geodesic_distance(V, F, 0)[0] == 0


def test_time_limit() -> None:
    started = time.monotonic()
    with pytest.warns(ndf.NdfWarning):
        model = ndf.fit(V, F, epochs=1_000_000, time_limit=0.5)
    assert model.report["interrupted"] and time.monotonic() - started < 20


def _distance() -> float:
    return float(ndf.geodesic_distance(V, F, 0).max())


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="needs fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_forked_processes_work() -> None:
    expected = _distance()
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.apply_async(_distance).get(timeout=60) == expected


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_memory_does_not_grow() -> None:
    script = """
        import numpy as np, ndf
        from tests.shapes import torus
        V, F = torus(48, 24)
        def resident():
            with open("/proc/self/statm") as file:
                return int(file.read().split()[1]) * 4096
        def work():
            m = ndf.fit(V, F, base_faces=100)
            m.extract(0.1); ndf.geodesic_distance(V, F, 0); ndf.spectrum(V, F, k=5)
        for _ in range(10):
            work()
        before = resident()
        for _ in range(30):
            work()
        print(resident() - before)
    """
    here = os.path.dirname(os.path.dirname(__file__))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([here, os.environ.get("PYTHONPATH", "")])}
    printed = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", textwrap.dedent(script)],
        env=environment, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    # A fit that was kept would be several megabytes, thirty times.
    assert int(printed) < 16 * 2**20, printed


def test_results_are_owned_by_numpy() -> None:
    distances = ndf.geodesic_distance(V, F, 0)
    assert distances.flags.writeable and distances.dtype == np.float64
    distances[:] = 0
