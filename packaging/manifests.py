#!/usr/bin/env python3
"""Fills in the manifests of other package managers, and checks them as far as can be done here.

    packaging/manifests.py --homepage https://… --source SOURCE.tar.gz [--windows boresight.zip] --out FOLDER

Written are a Homebrew formula, winget's three files, a conda recipe, a Flatpak manifest and a PKGBUILD. Nothing is submitted.
"""

import argparse
import hashlib
import pathlib
import re
import shutil
import subprocess

import yaml

PACKAGING = pathlib.Path(__file__).resolve().parent
FILES = ["homebrew", "winget", "conda", "flatpak", "aur"]
# What each YAML file must state, as its readers require.
REQUIRED = {
    "Boresight.Boresight.yaml": ["PackageIdentifier", "PackageVersion", "DefaultLocale", "ManifestType", "ManifestVersion"],
    "Boresight.Boresight.installer.yaml": ["PackageIdentifier", "PackageVersion", "Installers", "ManifestType", "ManifestVersion"],
    "Boresight.Boresight.locale.en-US.yaml": ["PackageIdentifier", "PackageVersion", "PackageLocale", "Publisher", "PackageName", "License", "ShortDescription"],
    "recipe.yaml": ["package", "source", "build", "about"],
    "io.github.boresight.boresight.yml": ["id", "runtime", "runtime-version", "sdk", "command", "modules"],
}


def sha256(path):
    return hashlib.sha256(path.read_bytes()).hexdigest() if path else "0" * 64


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--homepage", required=True)
    parser.add_argument("--source", type=pathlib.Path)
    parser.add_argument("--windows", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    version = re.search(r'^version = "(.*)"', (PACKAGING.parent / "Cargo.toml").read_text(), re.M)[1]
    values = {
        "VERSION": version,
        "HOMEPAGE": arguments.homepage,
        "SOURCE_SHA256": sha256(arguments.source),
        "WINDOWS_SHA256": sha256(arguments.windows).upper(),
    }
    for path in sorted(path for folder in FILES for path in (PACKAGING / folder).iterdir()):
        text = re.sub(r"@([A-Z0-9_]+)@", lambda found: values[found[1]], path.read_text())
        written = arguments.out / path.relative_to(PACKAGING)
        written.parent.mkdir(parents=True, exist_ok=True)
        written.write_text(text)
        if path.name in REQUIRED:
            tree = yaml.safe_load(text)
            missing = [key for key in REQUIRED[path.name] if not tree.get(key)]
            assert not missing, f"{path.name} lacks {missing}"
        elif path.name == "PKGBUILD":
            subprocess.run(["bash", "-n", written], check=True)
        elif path.suffix == ".rb" and shutil.which("ruby"):
            subprocess.run(["ruby", "-c", written], check=True, stdout=subprocess.DEVNULL)
        print(written)


if __name__ == "__main__":
    main()
