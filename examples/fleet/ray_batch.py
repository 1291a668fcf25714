"""A batch over Ray and the Python package: ray_batch.py ROOT > results.jsonl"""

import json
import sys
from pathlib import Path

import ray

import boresight


@ray.remote(num_cpus=1, max_retries=2)
def work(session: str) -> dict:
    try:
        return {"code": "OK", **boresight.replay(session)}
    except boresight.BoresightError as error:
        return {"code": error.code, "session": session, "message": error.message}


if __name__ == "__main__":
    ray.init()
    sessions = sorted(str(header.parent) for header in Path(sys.argv[1]).rglob("session.toml"))
    for row in ray.get([work.remote(session) for session in sessions]):
        print(json.dumps(row))
