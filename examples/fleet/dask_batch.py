"""A batch over Dask and the Python package: dask_batch.py ROOT [SCHEDULER] > results.jsonl"""

import json
import sys

from dask.distributed import Client

from boresight import batch

if __name__ == "__main__":
    with Client(*sys.argv[2:3]) as client:
        rows = client.map(batch.work, batch.sessions(sys.argv[1]), action="replay", retries=2, batch_size=100)
        for row in client.gather(rows):
            print(json.dumps(row))
