"""Times libigl's fast winding number for points on one thread: libigl_point_winding_number.py FOLDER

Called by the bench point_winding_number, which leaves arrays of little-endian doubles in the folder. Prints nanoseconds a
query, neither the octree nor its way from Python included, and leaves the values in the folder. Needs the packages numpy and libigl.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["IGL_NUM_THREADS"] = "1"

import sys
import time

import igl
import numpy

folder = sys.argv[1]


def array(name, columns):
    numbers = numpy.fromfile(os.path.join(folder, name), dtype="<f8")
    return numpy.ascontiguousarray(numbers.reshape(-1, columns) if columns > 1 else numbers)


positions, normals = array("positions", 3), array("normals", 3)
areas, queries = array("areas", 1), array("queries", 3)
indices, children, centers, widths = igl.octree(positions)
centers, radii, expansions = igl.fast_winding_number_precompute(positions, normals, areas, indices, children, 2)


def winding(points):
    """Winding numbers and the seconds of the processor that took: threads that libigl may start all count."""
    start = time.process_time()
    values = igl.fast_winding_number(
        positions, normals, areas, indices, children, centers, radii, expansions, points, 2.0
    )
    return values, time.process_time() - start


# A call with one query only hands the octree over from Python.
overhead = min(winding(queries[:1])[1] for _ in range(3))
values, seconds = winding(queries)
values.astype("<f8").tofile(os.path.join(folder, "values"))
print(1e9 * (seconds - overhead) / len(queries))
