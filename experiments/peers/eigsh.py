"""SciPy's eigsh on matrices of the project, timed on request: the peer of `cargo xtask spectra`.

    python3 -m venv VENV && VENV/bin/pip install numpy scipy
    VENV/bin/pip install scikit-sparse          # optional, with libsuitesparse-dev: CHOLMOD (Debian 12 has it for 0.4.16)

Usage: eigsh.py FOLDER MODES SHIFT. The folder holds the Laplacian and the lumped mass matrix as raw little-endian
arrays. Prints a JSON line with versions; then for every line `superlu` or `cholmod` on standard input a JSON line with
the wall seconds of factorisation and iteration and the eigenvalues."""

import json
import sys
import time
from pathlib import Path

import numpy as np
import scipy
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import LinearOperator, eigsh

try:
    from sksparse import cholmod
except ImportError:
    cholmod = None

folder, modes, shift = Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
offsets = np.fromfile(folder / "offsets.i64", np.int64)
rows = np.fromfile(folder / "rows.i64", np.int64)
entries = np.fromfile(folder / "entries.f64", np.float64)
lumped = np.fromfile(folder / "mass.f64", np.float64)
size = len(lumped)
laplacian = csc_matrix((entries, rows.astype(np.int32), offsets.astype(np.int32)), shape=(size, size))
mass = diags(lumped, format="csc")


def superlu():
    return eigsh(laplacian, modes, mass, sigma=-shift)[0]


def with_cholmod():
    factor = cholmod.cholesky((laplacian + shift * mass).tocsc())
    inverse = LinearOperator(laplacian.shape, matvec=factor, dtype=float)
    return eigsh(laplacian, modes, mass, sigma=-shift, OPinv=inverse)[0]


solvers = {"superlu": superlu}
if cholmod:
    solvers["cholmod"] = with_cholmod


def answer(**values):
    print(json.dumps(values), flush=True)


answer(solvers=list(solvers), scipy=scipy.__version__, numpy=np.__version__)
for line in sys.stdin:
    start = time.perf_counter()
    eigenvalues = solvers[line.strip()]()
    answer(seconds=time.perf_counter() - start, eigenvalues=np.sort(eigenvalues).tolist())
