#!/usr/bin/env python3
"""The public items of every crate that is for others to build on, as docs/surface/CRATE.txt.

    tests/surface.py --check    exits with 1 and shows the difference if a list isn't that of the sources
    tests/surface.py --write    writes the lists

Read from rustdoc's JSON, with the features that are on by default. Hidden items aren't listed. An item stands under the
shortest of its public paths; the others say `use`. Types of the standard library are named without their crate, those of
other crates with its name, those of the same crate by their path.
"""

import argparse
import difflib
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parent.parent
# The version of the JSON that the oldest toolchain that is promised writes, and that is read here.
FORMAT = 57
STANDARD = {"std", "core", "alloc"}
AUTO_TRAITS = {"Send", "Sync", "Unpin"}


class Names:
    """What an id is called, as seen by someone who uses the crate."""

    def __init__(self, document):
        self.index = document["index"]
        self.elsewhere = document["paths"]
        self.crates = {int(id): crate["name"] for id, crate in document["external_crates"].items()}
        self.places = {}
        self.foreign = []
        self.visit(document["root"], (), ())
        self.main = {id: self.shortest(id, places) for id, places in self.places.items()}

    def shortest(self, id, places):
        name = self.item(id)["name"]
        return min(places, key=lambda path: (len(path), path[-1] != name, path))

    def item(self, id):
        item = self.index.get(str(id))
        return item if item and item["crate_id"] == 0 else None

    def visit(self, module, path, above):
        for id in self.item(module)["inner"]["module"]["items"]:
            item = self.item(id)
            if item:
                self.place(id, item, path, above + (module,))

    def place(self, id, item, path, above):
        (kind, inner), = item["inner"].items()
        if kind == "impl" or item["visibility"] != "public":
            return
        if kind != "use":
            self.add(id, item, path + (item["name"],), above)
            return
        target = self.item(inner["id"]) if inner["id"] is not None else None
        if target is None:
            name = "*" if inner["is_glob"] else inner["name"]
            self.foreign.append((path + (name,), f"use {inner['source']}"))
        elif not inner["is_glob"]:
            self.add(inner["id"], target, path + (inner["name"],), above)
        elif "module" in target["inner"] and inner["id"] not in above:
            self.visit(inner["id"], path, above)
        elif "enum" in target["inner"]:
            self.foreign.append((path + ("*",), f"use {inner['source']}"))

    def add(self, id, item, path, above):
        places = self.places.setdefault(id, set())
        if path in places:
            return
        places.add(path)
        if "module" in item["inner"] and id not in above:
            self.visit(id, path, above)

    def of(self, id, written):
        last = written.rsplit("::", 1)[-1]
        if id in self.main:
            return "::".join(self.main[id])
        known = self.elsewhere.get(str(id))
        if known is None:
            return last
        last = known["path"][-1]
        crate = self.crates.get(known["crate_id"])
        return last if crate is None or crate in STANDARD else f"{crate}::{last}"


class Printer:
    """Types and signatures as text."""

    def __init__(self, names):
        self.names = names

    def type(self, type):
        if type is None:
            return "()"
        if type == "infer":
            return "_"
        (kind, inner), = type.items()
        return getattr(self, "type_" + kind)(inner)

    def type_primitive(self, name):
        return "!" if name == "never" else name

    def type_generic(self, name):
        return name

    def type_resolved_path(self, path):
        return self.path(path)

    def type_tuple(self, types):
        return "(" + ", ".join(map(self.type, types)) + ("," if len(types) == 1 else "") + ")"

    def type_slice(self, of):
        return f"[{self.type(of)}]"

    def type_array(self, array):
        return f"[{self.type(array['type'])}; {array['len']}]"

    def type_borrowed_ref(self, ref):
        lifetime = ref["lifetime"] + " " if ref["lifetime"] else ""
        to = self.type(ref["type"])
        several = " + " in to and to.startswith(("dyn ", "impl "))
        return f"&{lifetime}{'mut ' if ref['is_mutable'] else ''}{f'({to})' if several else to}"

    def type_raw_pointer(self, pointer):
        return f"*{'mut' if pointer['is_mutable'] else 'const'} {self.type(pointer['type'])}"

    def type_impl_trait(self, bounds):
        return "impl " + self.bounds(bounds)

    def type_dyn_trait(self, dyn):
        traits = [self.for_lifetimes(t["generic_params"]) + self.path(t["trait"]) for t in dyn["traits"]]
        return "dyn " + " + ".join(traits + ([dyn["lifetime"]] if dyn["lifetime"] else []))

    def type_function_pointer(self, pointer):
        inputs = ", ".join(self.type(type) for _, type in pointer["sig"]["inputs"])
        return (
            self.for_lifetimes(pointer["generic_params"])
            + f"{self.header(pointer['header'])}fn({inputs}){self.output(pointer['sig']['output'])}"
        )

    def type_qualified_path(self, path):
        own = self.type(path["self_type"])
        name = path["name"] + self.arguments(path["args"])
        if path["trait"] is None or own == "Self":
            return f"{own}::{name}"
        return f"<{own} as {self.path(path['trait'])}>::{name}"

    def path(self, path):
        return self.names.of(path["id"], path["path"]) + self.arguments(path["args"])

    def arguments(self, args):
        if not args:
            return ""
        (kind, inner), = args.items()
        if kind == "parenthesized":
            inputs = ", ".join(map(self.type, inner["inputs"]))
            return f"({inputs}){self.output(inner['output'])}"
        listed = [self.argument(arg) for arg in inner["args"]]
        for constraint in inner["constraints"]:
            name = constraint["name"] + self.arguments(constraint["args"])
            (kind, bound), = constraint["binding"].items()
            listed.append(f"{name} = {self.argument(bound)}" if kind == "equality" else f"{name}: {self.bounds(bound)}")
        return "<" + ", ".join(listed) + ">" if listed else ""

    def argument(self, arg):
        if arg == "infer":
            return "_"
        (kind, inner), = arg.items()
        return {"lifetime": str, "type": self.type, "const": lambda const: const["expr"]}[kind](inner)

    def bounds(self, bounds):
        return " + ".join(sorted(set(map(self.bound, bounds))))

    def bound(self, bound):
        (kind, inner), = bound.items()
        if kind == "outlives":
            return inner
        if kind == "use":
            return "use<" + ", ".join(next(iter(arg.values())) for arg in inner) + ">"
        sign = {"none": "", "maybe": "?", "maybe_const": "~const "}[inner["modifier"]]
        return self.for_lifetimes(inner["generic_params"]) + sign + self.path(inner["trait"])

    def for_lifetimes(self, params):
        return "for<" + ", ".join(param["name"] for param in params) + "> " if params else ""

    def generics(self, generics):
        listed = []
        for param in generics["params"]:
            (kind, inner), = param["kind"].items()
            if kind == "lifetime":
                outlives = " + ".join(inner["outlives"])
                listed.append(param["name"] + (f": {outlives}" if outlives else ""))
            elif kind == "const":
                default = f" = {inner['default']}" if inner["default"] is not None else ""
                listed.append(f"const {param['name']}: {self.type(inner['type'])}{default}")
            elif not inner["is_synthetic"]:
                bounds = f": {self.bounds(inner['bounds'])}" if inner["bounds"] else ""
                default = f" = {self.type(inner['default'])}" if inner["default"] is not None else ""
                listed.append(param["name"] + bounds + default)
        return "<" + ", ".join(listed) + ">" if listed else ""

    def where(self, generics):
        listed = []
        for predicate in generics["where_predicates"]:
            (kind, inner), = predicate.items()
            if kind == "bound_predicate":
                lifetimes = self.for_lifetimes(inner["generic_params"])
                listed.append(f"{lifetimes}{self.type(inner['type'])}: {self.bounds(inner['bounds'])}")
            elif kind == "lifetime_predicate":
                listed.append(f"{inner['lifetime']}: {' + '.join(inner['outlives'])}")
            else:
                listed.append(f"{self.type(inner['lhs'])} == {self.argument(inner['rhs'])}")
        return " where " + ", ".join(sorted(listed)) if listed else ""

    def header(self, header):
        abi = header["abi"]
        if abi != "Rust":
            abi = f'extern "{abi if isinstance(abi, str) else next(iter(abi))}"'
        words = [word for word in ("const", "async", "unsafe") if header[f"is_{word}"]]
        return "".join(word + " " for word in words + ([abi] if abi != "Rust" else []))

    def output(self, output):
        return "" if output is None else f" -> {self.type(output)}"

    def function(self, function):
        inputs = []
        for name, type in function["sig"]["inputs"]:
            text = self.type(type)
            if name != "self":
                inputs.append(f"{name}: {text}")
            elif text == "Self":
                inputs.append("self")
            elif re.fullmatch(r"&('\w+ )?(mut )?Self", text):
                inputs.append(text.removesuffix("Self") + "self")
            else:
                inputs.append(f"self: {text}")
        generics = function["generics"]
        return (
            f"{self.header(function['header'])}fn{self.generics(generics)}({', '.join(inputs)})"
            f"{self.output(function['sig']['output'])}{self.where(generics)}"
        )


class Surface:
    """The lines of one crate."""

    def __init__(self, document):
        self.names = Names(document)
        self.print = Printer(self.names)
        self.lines = set(self.names.foreign)
        for id, places in self.names.places.items():
            main = self.names.main[id]
            item = self.names.item(id)
            self.item(main, item)
            for path in places - {main}:
                self.add(path, f"use {'::'.join(main)}")

    def text(self):
        return "".join(f"{'::'.join(path)}: {text}\n" for path, text in sorted(self.lines))

    def add(self, path, text):
        self.lines.add((path, text))

    def item(self, path, item):
        (kind, inner), = item["inner"].items()
        known = getattr(self, "add_" + kind, None)
        if known is None:
            raise SystemExit(f"surface: {'::'.join(path)} is a {kind}, which isn't known here")
        known(path, item, inner)

    def marks(self, item):
        exhaustive = "non_exhaustive" not in item["attrs"]
        return ("" if exhaustive else " non_exhaustive") + (" deprecated" if item["deprecation"] else "")

    def add_module(self, path, item, module):
        self.add(path, "mod" + self.marks(item))

    def add_function(self, path, item, function):
        self.add(path, self.print.function(function) + self.marks(item))

    def add_constant(self, path, item, constant):
        self.add(path, f"const {self.print.type(constant['type'])}" + self.marks(item))

    def add_static(self, path, item, static):
        mutable = "mut " if static["is_mutable"] else ""
        self.add(path, f"static {mutable}{self.print.type(static['type'])}" + self.marks(item))

    def add_type_alias(self, path, item, alias):
        generics = self.print.generics(alias["generics"])
        self.add(path, f"type{generics} = {self.print.type(alias['type'])}{self.print.where(alias['generics'])}")

    def add_macro(self, path, item, macro):
        self.add(path, "macro")

    def add_proc_macro(self, path, item, macro):
        self.add(path, f"macro {macro['kind']}")

    def add_struct(self, path, item, struct):
        kind = struct["kind"]
        shape = ""
        if kind != "unit" and "tuple" in kind:
            shape = self.tuple(kind["tuple"])
        elif kind != "unit":
            shape = " { private fields }" if kind["plain"]["has_stripped_fields"] else ""
            self.fields(path, kind["plain"]["fields"])
        generics = struct["generics"]
        text = f"struct{self.print.generics(generics)}{shape}{self.print.where(generics)}"
        self.add(path, text + self.marks(item))
        self.impls(path, item, struct["impls"])

    def add_union(self, path, item, union):
        self.add(path, f"union{self.print.generics(union['generics'])}")
        self.fields(path, union["fields"])
        self.impls(path, item, union["impls"])

    def add_enum(self, path, item, enum):
        generics = enum["generics"]
        self.add(path, f"enum{self.print.generics(generics)}{self.print.where(generics)}" + self.marks(item))
        for id in enum["variants"]:
            variant = self.names.item(id)
            if variant:
                self.variant(path + (variant["name"],), variant)
        self.impls(path, item, enum["impls"])

    def variant(self, path, item):
        variant = item["inner"]["variant"]
        kind, value = variant["kind"], variant["discriminant"]
        shape = ""
        if kind != "plain" and "tuple" in kind:
            shape = self.tuple(kind["tuple"])
        elif kind != "plain":
            shape = " { hidden fields }" if kind["struct"]["has_stripped_fields"] else ""
            self.fields(path, kind["struct"]["fields"])
        self.add(path, f"variant{shape}{' = ' + value['expr'] if value else ''}" + self.marks(item))

    def tuple(self, ids):
        fields = [self.names.item(id) if id is not None else None for id in ids]
        return "(" + ", ".join(self.print.type(f["inner"]["struct_field"]) if f else "_" for f in fields) + ")"

    def fields(self, path, ids):
        for field in filter(None, map(self.names.item, ids)):
            self.add(path + (field["name"],), f"field {self.print.type(field['inner']['struct_field'])}")

    def add_trait(self, path, item, trait):
        bounds = f": {self.print.bounds(trait['bounds'])}" if trait["bounds"] else ""
        words = ("unsafe " if trait["is_unsafe"] else "") + "trait"
        dyn = "" if trait["is_dyn_compatible"] else " not dyn"
        generics = trait["generics"]
        self.add(path, f"{words}{self.print.generics(generics)}{bounds}{self.print.where(generics)}{dyn}")
        for part in filter(None, map(self.names.item, trait["items"])):
            self.part(path, part, has_default=True)
        self.impls(path, item, trait["implementations"])

    def part(self, path, item, has_default=False):
        (kind, inner), = item["inner"].items()
        path = path + (item["name"],)
        if kind == "function":
            provided = " provided" if has_default and inner["has_body"] else ""
            self.add(path, self.print.function(inner) + provided + self.marks(item))
        elif kind == "assoc_const":
            provided = " provided" if has_default and inner["value"] is not None else ""
            self.add(path, f"const {self.print.type(inner['type'])}{provided}" + self.marks(item))
        else:
            bounds = f": {self.print.bounds(inner['bounds'])}" if inner["bounds"] else ""
            value = f" = {self.print.type(inner['type'])}" if inner["type"] else ""
            self.add(path, f"type{self.print.generics(inner['generics'])}{bounds}{value}")

    def impls(self, path, item, ids):
        for found in filter(None, map(self.names.item, ids)):
            block = found["inner"]["impl"]
            owner = base(block["for"])
            if block["blanket_impl"] or (owner in self.names.main and owner != item["id"]):
                continue
            if block["trait"] is None:
                for part in filter(None, map(self.names.item, block["items"])):
                    if part["visibility"] == "public":
                        self.part(path, part)
            else:
                self.trait_impl(path, item, block)

    def trait_impl(self, path, item, block):
        trait = self.print.path(block["trait"])
        if trait == "StructuralPartialEq":
            return
        if block["is_synthetic"]:
            if block["is_negative"] and trait in AUTO_TRAITS:
                self.add(path, f"impl !{trait}")
            return
        kinds = [self.names.item(id) for id in block["items"]]
        types = [(t["name"], t["inner"]["assoc_type"]) for t in kinds if t and "assoc_type" in t["inner"]]
        types = ", ".join(f"{name} = {self.print.type(type['type'])}" for name, type in sorted(types, key=lambda t: t[0]))
        plain = "resolved_path" in block["for"] and base(block["for"]) == item["id"]
        whom = "" if plain and not block["for"]["resolved_path"]["args"] else f" for {self.print.type(block['for'])}"
        self.add(
            path,
            f"{'unsafe ' if block['is_unsafe'] else ''}impl{self.print.generics(block['generics'])} {trait}{whom}"
            f"{' { ' + types + ' }' if types else ''}{self.print.where(block['generics'])}",
        )


def base(type):
    """The id of the named type at the bottom of references; None if there is none."""
    while isinstance(type, dict) and "borrowed_ref" in type:
        type = type["borrowed_ref"]["type"]
    return type["resolved_path"]["id"] if isinstance(type, dict) and "resolved_path" in type else None


def run(*command, **options):
    return subprocess.run(command, check=True, cwd=CHECKOUT, stdout=subprocess.PIPE, text=True, **options).stdout


def environment():
    """That of the oldest toolchain that is promised: another one writes other JSON."""
    oldest = re.search(r'^rust-version = "(.*)"', (CHECKOUT / "Cargo.toml").read_text(), re.MULTILINE)[1]
    is_oldest = run("rustc", "--version").startswith(f"rustc {oldest}.")
    return dict(os.environ) if is_oldest else dict(os.environ, RUSTUP_TOOLCHAIN=oldest)


def documents(crates, target, environment):
    """rustdoc's JSON of each crate."""
    with tempfile.TemporaryDirectory() as folder:
        # Only rustdoc sees the variable: build scripts that look for it would run again in every other build.
        rustdoc = Path(folder) / "rustdoc"
        rustdoc.write_text('#!/bin/sh\nRUSTC_BOOTSTRAP=1 exec rustdoc "$@"\n')
        rustdoc.chmod(0o755)
        environment = dict(environment, RUSTDOC=str(rustdoc))
        for crate in crates:
            options = ["-Z", "unstable-options", "--output-format", "json"]
            run("cargo", "rustdoc", "--quiet", "--package", crate, "--lib", "--", *options, env=environment)
            with open(target / "doc" / f"{crate.replace('-', '_')}.json") as file:
                yield crate, json.load(file)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--check", action="store_true")
    what.add_argument("--write", action="store_true")
    write = parser.parse_args().write

    toolchain = environment()
    workspace = json.loads(run("cargo", "metadata", "--no-deps", "--format-version", "1", env=toolchain))
    crates = sorted(package["name"] for package in workspace["packages"] if package["publish"] is None)
    folder = CHECKOUT / "docs/surface"
    folder.mkdir(exist_ok=True)
    lists = {}
    for crate, document in documents(crates, Path(workspace["target_directory"]), toolchain):
        if document["format_version"] != FORMAT:
            raise SystemExit(f"surface: rustdoc writes version {document['format_version']} of its JSON, not {FORMAT}")
        lists[folder / f"{crate}.txt"] = Surface(document).text()

    stale = [path for path in folder.glob("*.txt") if path not in lists]
    if write:
        for path in stale:
            path.unlink()
        for path, text in lists.items():
            path.write_text(text)
        return 0
    changed = bool(stale)
    for path in stale:
        print(f"{path.relative_to(CHECKOUT)} is the list of no crate that is published")
    for path, text in lists.items():
        kept = path.read_text() if path.exists() else ""
        name = str(path.relative_to(CHECKOUT))
        difference = list(difflib.unified_diff(kept.splitlines(), text.splitlines(), name, "the sources", lineterm="", n=0))
        changed |= bool(difference)
        print("\n".join(difference), end="\n" if difference else "")
    if changed:
        print("The public surface has changed. If that's meant, run `make surface` and commit the lists with the change.")
    return int(changed)


if __name__ == "__main__":
    sys.exit(main())
