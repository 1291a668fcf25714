"""1,000 items in a process pool, on Dask and on Ray, one in 20 a picture that isn't there: each is worked on once, and
comes back as a result or as the error it was. usage: python_pools.py FOLDER_OF_PICTURES"""

import glob
import os
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from importlib.metadata import version

import boresight

COUNT, EACH_BAD = 1000, 20


def work(number: int, files: list[str], log: str) -> boresight.Detection:
    import cv2

    # One short write at the end of a file is whole, whoever else writes.
    with open(log, "a") as lines:
        lines.write(f"{number}\n")
    if number % EACH_BAD == 0:
        return boresight.calibrate([f"/nowhere/{number}.png"], "7x5")  # type: ignore[return-value]
    return boresight.detect(cv2.imread(files[number % len(files)], 0), "7x5")


def outcome(number: int, get) -> str:
    try:
        found = get()
    except boresight.BoresightError as error:
        assert number % EACH_BAD == 0 and f"{number}.png" in error.message and error.next
        return error.code
    assert number % EACH_BAD and isinstance(found, boresight.Detection) and found.found
    return "OK"


def tell(name: str, began: float, log: str, outcomes: list[str]) -> None:
    counts = {code: outcomes.count(code) for code in sorted(set(outcomes))}
    with open(log) as lines:
        worked = sorted(map(int, lines))
    print(f"{name:20} {counts}, worked on {len(worked)} times  {time.time() - began:.1f} s", flush=True)
    assert worked == list(range(COUNT)), "an item was worked on twice, or never"
    assert counts == {"OK": COUNT - COUNT // EACH_BAD, "PICTURE-UNREADABLE": COUNT // EACH_BAD}


def main() -> None:
    files = sorted(glob.glob(sys.argv[1] + "/*.png"))
    numbers = range(COUNT)
    place = tempfile.TemporaryDirectory()
    logs = iter(os.path.join(place.name, name) for name in ("pool", "dask", "ray"))
    log, began = next(logs), time.time()
    with ProcessPoolExecutor(2) as pool:
        futures = [pool.submit(work, number, files, log) for number in numbers]
        tell("process pool", began, log, [outcome(n, future.result) for n, future in zip(numbers, futures)])
    try:
        from dask.distributed import Client
    except ImportError:
        print("dask: not installed")
    else:
        log, began = next(logs), time.time()
        with Client(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs="CRITICAL") as client:
            futures = client.map(work, numbers, files=files, log=log, retries=0)
            tell(f"dask {version('dask')}", began, log, [outcome(n, future.result) for n, future in zip(numbers, futures)])
    try:
        import ray
    except ImportError:
        print("ray: not installed")
    else:
        log, began = next(logs), time.time()
        ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
        remote = ray.remote(work)
        refs = [remote.remote(number, files, log) for number in numbers]

        def get(ref):
            # Ray raises what is both its own error and ours.
            return lambda: ray.get(ref)

        tell(f"ray {version('ray')}", began, log, [outcome(n, get(ref)) for n, ref in zip(numbers, refs)])
        ray.shutdown()


if __name__ == "__main__":
    main()
