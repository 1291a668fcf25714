#!/usr/bin/env python3
"""Writes a container image as one file, without a daemon: an OCI layout in a tar archive.

    packaging/oci.py PROGRAM --arch amd64 --out boresight-VERSION-amd64.oci.tar

PROGRAM must be static (`file` says "statically linked"): the image holds nothing else but the licences. Load it with
`podman load -i FILE`, `skopeo copy oci-archive:FILE …` or `nerdctl load -i FILE`. The same program gives the same bytes.
"""

import argparse
import gzip
import hashlib
import io
import json
import os
import pathlib
import re
import subprocess
import tarfile

ROOT = pathlib.Path(__file__).resolve().parent.parent


def blob(blobs, data):
    digest = hashlib.sha256(data).hexdigest()
    blobs[digest] = data
    return {"digest": f"sha256:{digest}", "size": len(data)}


def add(archive, name, data, mode, when):
    info = tarfile.TarInfo(name)
    info.mode, info.mtime = mode, when
    if data is None:
        info.type = tarfile.DIRTYPE
        archive.addfile(info)
    else:
        info.size = len(data)
        archive.addfile(info, io.BytesIO(data))


def layer(program, when):
    raw = io.BytesIO()
    with tarfile.open(fileobj=raw, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        for folder, mode in [("usr", 0o755), ("usr/bin", 0o755), ("licences", 0o755), ("tmp", 0o1777), ("work", 0o777)]:
            add(archive, folder, None, mode, when)
        add(archive, "usr/bin/boresight", program, 0o755, when)
        for name in ["LICENSE-APACHE", "LICENSE-MIT", "NOTICE"]:
            add(archive, f"licences/{name}", (ROOT / name).read_bytes(), 0o644, when)
    return raw.getvalue()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--arch", default="amd64", choices=["amd64", "arm64"])
    parser.add_argument("--out", type=pathlib.Path, required=True)
    arguments = parser.parse_args()

    program = arguments.program.read_bytes()
    if b"/lib64/ld-linux" in program[:4096] or b"/lib/ld-" in program[:4096]:
        parser.error(f"{arguments.program} isn't static: an empty image can't run it")
    version = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.M)[1]
    git = ["git", "log", "-1", "--format=%ct"]
    when = os.environ.get("SOURCE_DATE_EPOCH") or subprocess.check_output(git, cwd=ROOT, text=True)
    when = int(when)

    blobs = {}
    raw = layer(program, when)
    packed = gzip.compress(raw, compresslevel=9, mtime=0)
    media = "application/vnd.oci.image"
    layers = [{"mediaType": f"{media}.layer.v1.tar+gzip", **blob(blobs, packed)}]
    labels = {
        "org.opencontainers.image.title": "boresight",
        "org.opencontainers.image.version": version,
        "org.opencontainers.image.licenses": "MIT OR Apache-2.0",
        "org.opencontainers.image.description": "Guided camera calibration with honest uncertainty",
    }
    config = {
        "architecture": arguments.arch,
        "os": "linux",
        "config": {
            "Entrypoint": ["/usr/bin/boresight"],
            "WorkingDir": "/work",
            "Env": ["PATH=/usr/bin", "HOME=/tmp"],
            "User": "65532:65532",
            "Labels": labels,
        },
        "rootfs": {"type": "layers", "diff_ids": [f"sha256:{hashlib.sha256(raw).hexdigest()}"]},
    }
    as_json = lambda value: json.dumps(value, sort_keys=True).encode()
    manifest = {
        "schemaVersion": 2,
        "mediaType": f"{media}.manifest.v1+json",
        "config": {"mediaType": f"{media}.config.v1+json", **blob(blobs, as_json(config))},
        "layers": layers,
        "annotations": labels,
    }
    index = {
        "schemaVersion": 2,
        "mediaType": f"{media}.index.v1+json",
        "manifests": [
            {
                "mediaType": f"{media}.manifest.v1+json",
                **blob(blobs, as_json(manifest)),
                "platform": {"architecture": arguments.arch, "os": "linux"},
                "annotations": {"org.opencontainers.image.ref.name": f"boresight:{version}"},
            }
        ],
    }
    with tarfile.open(arguments.out, "w", format=tarfile.USTAR_FORMAT) as archive:
        add(archive, "oci-layout", as_json({"imageLayoutVersion": "1.0.0"}), 0o644, when)
        add(archive, "index.json", as_json(index), 0o644, when)
        for digest, data in sorted(blobs.items()):
            add(archive, f"blobs/sha256/{digest}", data, 0o644, when)
    print(f"{arguments.out}: {arguments.out.stat().st_size} bytes")


if __name__ == "__main__":
    main()
