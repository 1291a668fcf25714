#!/usr/bin/env python3
"""Makes a .zip of a .tar.gz, for Windows: packaging/zip.py FILE.tar.gz. The same archive gives the same bytes."""

import pathlib
import sys
import tarfile
import time
import zipfile

source = pathlib.Path(sys.argv[1])
target = source.with_name(source.name.removesuffix(".tar.gz") + ".zip")
with tarfile.open(source) as packed, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
    for member in packed:
        if member.isfile():
            info = zipfile.ZipInfo(member.name, time.gmtime(member.mtime)[:6])
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, packed.extractfile(member).read())
source.unlink()
print(f"{target}: {target.stat().st_size} bytes")
