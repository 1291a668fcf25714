"""A batch over Ray and the Python package: ray_batch.py ROOT > results.jsonl"""

import json
import sys

import ray

from boresight import batch

if __name__ == "__main__":
    ray.init()
    work = ray.remote(num_cpus=1, max_retries=2)(batch.work)
    for row in ray.get([work.remote(session, "replay") for session in batch.sessions(sys.argv[1])]):
        print(json.dumps(row))
