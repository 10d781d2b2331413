"""Models of all files of a list by Ray and the Python package, a row for each:

    python ray_fit.py shapes.txt runs/ray

Run again, it does what has no row yet.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import ray

TIMEOUT = 900


@ray.remote(num_cpus=1, max_retries=0)
def fit(number: int, path: str, run: str) -> dict[str, object]:
    """Learns a file and writes its model. Its row."""
    import ndf

    row: dict[str, object] = {"id": number, "input": path}
    try:
        model = ndf.fit_file(path, size=9000, threads=1, time_limit=TIMEOUT)
    except (ndf.NdfError, OSError) as error:
        return {**row, "status": "refused", "message": str(error)}
    model.save(Path(run) / f"{number}.ndf")
    return {**row, "status": "ok", "result": dict(model.report)}


def main(list_of_files: str, run: str) -> None:
    rows = Path(run) / "rows.jsonl"
    rows.parent.mkdir(parents=True, exist_ok=True)
    done = {json.loads(line)["id"] for line in rows.read_text().splitlines()} if rows.exists() else set()
    paths = Path(list_of_files).read_text().splitlines()
    ray.init()
    todo = ((number, path) for number, path in enumerate(paths) if number not in done)
    running: dict[ray.ObjectRef, tuple[int, str]] = {}
    # As many at a time as keep all cores busy, however long the list is.
    width = 2 * int(ray.cluster_resources()["CPU"])
    with rows.open("a") as out:
        while True:
            while len(running) < width and (item := next(todo, None)):
                running[fit.remote(*item, str(Path(run).resolve()))] = item
            if not running:
                break
            (ended,), _ = ray.wait(list(running))
            number, path = running.pop(ended)
            try:
                row = ray.get(ended)
            except ray.exceptions.RayError as error:
                row = {"id": number, "input": path, "status": "crash", "message": str(error).splitlines()[0]}
            print(json.dumps(row), file=out, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
