#!/bin/sh
# A batch in shards with GNU parallel: parallel.sh ROOT OUT [SHARDS] [ACTION]
# Over several hosts that see the same files: PARALLEL='--sshlogin one,two --workdir .' parallel.sh …
set -eu
root=$1 out=$2 shards=${3:-8} action=${4:-replay}
mkdir -p "$out"
boresight batch plan "$root" > "$out.manifest.jsonl"
# A shard that fails is tried again: it works on what is missing only.
parallel --retries 3 boresight batch run "$out.manifest.jsonl" --action "$action" --out "$out" --jobs 1 \
    --shard "{}/$shards" ::: $(seq "$shards")
boresight batch gather "$out" > "$out.jsonl"
