#!/usr/bin/env python3
"""Whether the licence of every crate in Cargo.lock, with every feature and on every system, is one that deny.toml accepts,
and every crate comes from where deny.toml says. Needs no network. What needs one, the advisories, `cargo deny check` does.
"""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parent.parent


def accepts(expression, allowed):
    """Whether an SPDX expression can be met by the allowed licences."""
    words = re.findall(r"[()]|[\w.+-]+", expression.replace("/", " OR "))
    at = 0

    def either():
        nonlocal at
        met = both()
        while at < len(words) and words[at] == "OR":
            at += 1
            met |= both()
        return met

    def both():
        nonlocal at
        met = one()
        while at < len(words) and words[at] == "AND":
            at += 1
            met &= one()
        return met

    def one():
        nonlocal at
        word = words[at]
        at += 1
        if word == "(":
            met = either()
            at += 1
            return met
        if at < len(words) and words[at] == "WITH":
            at += 2  # An exception only adds permissions.
        return word in allowed

    return either()


def main():
    rules = tomllib.loads((CHECKOUT / "deny.toml").read_text())
    allowed = set(rules["licenses"]["allow"])
    more = {each["crate"]: set(each["allow"]) for each in rules["licenses"]["exceptions"]}
    origins = {"registry+" + registry for registry in rules["sources"]["allow-registry"]}
    asked = ["cargo", "metadata", "--offline", "--locked", "--all-features", "--format-version", "1"]
    metadata = json.loads(subprocess.run(asked, cwd=CHECKOUT, check=True, capture_output=True, text=True).stdout)
    refused = []
    for crate in metadata["packages"]:
        name = f"{crate['name']} {crate['version']}"
        if crate["source"] is None:
            continue  # Of this workspace.
        if crate["source"] not in origins:
            refused.append(f"{name} comes from {crate['source']}")
        if not crate["license"]:
            refused.append(f"{name} states no licence")
        elif not accepts(crate["license"], allowed | more.get(crate["name"], set())):
            refused.append(f"{name}: {crate['license']}")
    assert accepts("(MIT OR GPL-3.0) AND Zlib", {"MIT", "Zlib"}) and not accepts("MIT AND GPL-3.0", {"MIT"})
    print("\n".join(refused) or f"{len(metadata['packages'])} crates: every licence is accepted")
    return 1 if refused else 0


if __name__ == "__main__":
    sys.exit(main())
