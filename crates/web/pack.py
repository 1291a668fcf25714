#!/usr/bin/env python3
"""Makes the page that calibrates in a browser: one file with its style, script and WebAssembly in it.

    crates/web/pack.py GLUE.js MODULE.wasm PAGE.html

What all pages have comes from crates/present/src/browser. The page's own policy lets only its own style and script run,
and lets it connect to nothing. The same inputs give the same bytes.
"""

import base64
import gzip
import hashlib
import sys
from pathlib import Path

SHARED = Path(__file__).resolve().parent.parent / "present/src/browser"
OWN = Path(__file__).resolve().parent / "src"


def hashed(text):
    return "'sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() + "'"


def main():
    glue, module, out = map(Path, sys.argv[1:])
    shared = {name: (SHARED / name).read_text() for name in ("head.html", "style.css", "body.html", "show.js")}
    own = {name: (OWN / name).read_text() for name in ("about.html", "page.js", "worker.js")}
    style = "\n" + shared["style.css"]
    script = "\n" + shared["show.js"] + own["page.js"]
    packed = base64.b64encode(gzip.compress(module.read_bytes(), 9, mtime=0)).decode()
    worker = glue.read_text() + own["worker.js"]
    for name, text in (("style", style), ("script", script), ("worker", worker)):
        assert "</" + ("style" if name == "style" else "script") not in text, name
    policy = (
        f"default-src 'none'; script-src {hashed(script)} 'wasm-unsafe-eval'; style-src {hashed(style)}; worker-src blob:; "
        "img-src blob: data:; media-src blob:; base-uri 'none'; form-action 'none'"
    )
    head = shared["head.html"].replace(
        '<meta charset="utf-8">', f'<meta charset="utf-8">\n<meta http-equiv="Content-Security-Policy" content="{policy}">'
    )
    page = [
        head, "<style>", style, "</style>\n</head>\n<body>\n", shared["body.html"], own["about.html"],
        '<script type="text/plain" id="seeing">', worker, "</script>\n",
        '<script type="text/plain" id="engine">', packed, "</script>\n",
        "<script>", script, "</script>\n</body>\n</html>\n",
    ]
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text("".join(page))
    wire = len(gzip.compress(out.read_bytes(), 9, mtime=0))
    print(f"{out}: {out.stat().st_size} bytes, {wire} over the wire")


if __name__ == "__main__":
    main()
