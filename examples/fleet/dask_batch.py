"""A batch over Dask and the Python package: dask_batch.py ROOT [SCHEDULER] > results.jsonl"""

import json
import sys
from pathlib import Path

from dask.distributed import Client

import boresight


def work(session: str) -> dict:
    try:
        return {"code": "OK", **boresight.replay(session)}
    except boresight.BoresightError as error:
        return {"code": error.code, "session": session, "message": error.message}


if __name__ == "__main__":
    sessions = sorted(str(header.parent) for header in Path(sys.argv[1]).rglob("session.toml"))
    with Client(*sys.argv[2:3]) as client:
        for row in client.gather(client.map(work, sessions, retries=2, batch_size=100)):
            print(json.dumps(row))
