#!/usr/bin/env python3
"""Whether the licence of every crate in Cargo.lock, with every feature and on every system, is one that deny.toml accepts,
every crate comes from where deny.toml says, and no version is one that a kept advisory concerns (advisories.toml, which
says as of when). Needs no network. The newest advisories are asked for by `cargo deny check`, which needs one.

usage: licences.py [--renew FOLDER]   FOLDER: a checkout of RustSec's database, of which advisories.toml is made
"""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parent.parent
ADVISORIES = CHECKOUT / "tests/advisories.toml"


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


def meets(version, ranges):
    """Whether a version is in one of the ranges, such as ">= 0.9.3, < 0.10.0". A version before a release counts as it."""
    number = lambda text: [int(part) for part in (re.match(r"[\d.]+", text)[0].split(".") + ["0", "0"])[:3]]
    holds = {">=": list.__ge__, ">": list.__gt__, "<=": list.__le__, "<": list.__lt__, "=": list.__eq__}
    # Cargo's "^1.2" and "1.2" are seen as ">= 1.2": stated of what is patched, by few and old advisories.
    parts = lambda each: re.findall(r"(>=|<=|>|<|=|\^|)\s*(\d[^,\s]*)", each)
    return any(all(holds.get(sign, list.__ge__)(number(version), number(bound)) for sign, bound in parts(each)) for each in ranges)


def concerned(crates, advisories):
    """The versions among (name, version) that an advisory concerns."""
    return [f"{name} {version}: {number}" for number, advisory in advisories.items() for name, version in crates if name == advisory["crate"] and not meets(version, advisory["patched"])]


def renew(database, names):
    """Writes the kept advisories about the named crates, from a checkout of RustSec's database."""
    kept, newest = {}, ""
    for file in sorted(Path(database).glob("crates/*/RUSTSEC-*.md")):
        entry = tomllib.loads(file.read_text().split("```toml")[1].split("```")[0])
        advisory, versions = entry["advisory"], entry["versions"]
        newest = max(newest, str(advisory["date"]))
        is_about_code = advisory.get("informational") in (None, "unsound") and "withdrawn" not in advisory
        if is_about_code and advisory["package"] in names:
            kept[advisory["id"]] = (advisory["package"], versions["patched"] + versions.get("unaffected", []))
    head = "# RustSec's advisories about crates in Cargo.lock, by `python3 tests/licences.py --renew FOLDER`.\n"
    lines = [f"{number} = {{ crate = {json.dumps(crate)}, patched = {json.dumps(ranges)} }}\n" for number, (crate, ranges) in kept.items()]
    ADVISORIES.write_text(f'{head}as_of = "{newest}"\n\n[advisories]\n{"".join(lines)}')


def main():
    rules = tomllib.loads((CHECKOUT / "deny.toml").read_text())
    allowed = set(rules["licenses"]["allow"])
    more = {each["crate"]: set(each["allow"]) for each in rules["licenses"]["exceptions"]}
    origins = {"registry+" + registry for registry in rules["sources"]["allow-registry"]}
    asked = ["cargo", "metadata", "--offline", "--locked", "--all-features", "--format-version", "1"]
    metadata = json.loads(subprocess.run(asked, cwd=CHECKOUT, check=True, capture_output=True, text=True).stdout)
    if "--renew" in sys.argv:
        renew(sys.argv[sys.argv.index("--renew") + 1], {crate["name"] for crate in metadata["packages"] if crate["source"]})
    kept = tomllib.loads(ADVISORIES.read_text())
    refused = concerned([(crate["name"], crate["version"]) for crate in metadata["packages"]], kept["advisories"])
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
    old = {"RUSTSEC-0": {"crate": "a", "patched": [">= 0.10.1", ">= 0.9.3, < 0.10.0"]}}
    assert concerned([("a", "0.10.0"), ("a", "0.9.2"), ("a", "0.9.4"), ("a", "0.11.0"), ("b", "0.9.2")], old) == ["a 0.10.0: RUSTSEC-0", "a 0.9.2: RUSTSEC-0"]
    words = f"every licence is accepted; as of {kept['as_of']}, none of {len(kept['advisories'])} kept advisories concerns one"
    print("\n".join(refused) or f"{len(metadata['packages'])} crates: {words}")
    return 1 if refused else 0


if __name__ == "__main__":
    sys.exit(main())
