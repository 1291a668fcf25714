#!/usr/bin/env python3
"""Every link and picture of the built book leads to a file that it holds, and every fragment to a heading.

    tests/packages/book_links.py target/book
"""

import html.parser
import pathlib
import sys
import urllib.parse


class Page(html.parser.HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.links, self.ids = [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        named = dict(attributes)
        if named.get("id"):
            self.ids.add(named["id"])
        for key in ("href", "src"):
            if named.get(key):
                self.links.append(named[key])


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    pages = {path: Page(path.read_text()) for path in root.rglob("*.html")}
    dead, count = [], 0
    for path, page in pages.items():
        for link in page.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            count += 1
            target = path if not parts.path else (path.parent / urllib.parse.unquote(parts.path)).resolve()
            if path.name in ("404.html",) and parts.path.startswith("/"):
                target = root / parts.path.lstrip("/")
            if target.is_dir():
                target /= "index.html"
            if not target.is_file():
                dead.append(f"{path.relative_to(root)}: {link}")
            elif parts.fragment and target in pages and parts.fragment not in pages[target].ids:
                dead.append(f"{path.relative_to(root)}: {link}")
    print(f"{len(pages)} pages, {count} links, {len(dead)} dead")
    print("\n".join(dead))
    sys.exit(bool(dead) or not count)


if __name__ == "__main__":
    main()
