#!/usr/bin/env bash
# Prints reports with headless Chromium and counts their sheets: two at most.
#
#     tests/consumers/print_report.sh PAGE.html…
#
# Leaves PAGE.pdf, and PAGE-1.png, PAGE-2.png to look at, in the working folder. Needs chromium and
# poppler-utils.
set -euo pipefail

profile=$(mktemp -d)
trap 'rm -rf "$profile"' EXIT
chromium=(chromium --headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking
  --disable-component-update --disable-sync "--user-data-dir=$profile")

failed=0
for page in "$@"; do
  name=$(basename "$page" .html)
  rm -f "$name.pdf"
  "${chromium[@]}" --no-pdf-header-footer "--print-to-pdf=$name.pdf" "file://$(realpath "$page")" 2>/dev/null
  sheets=$(pdfinfo "$name.pdf" | awk '/^Pages:/ { print $2 }')
  size=$(pdfinfo "$name.pdf" | sed -n 's/^Page size: *//p')
  pdftoppm -r 110 -png "$name.pdf" "$name"
  echo "$page: $sheets sheets, $size"
  [ "$sheets" -le 2 ] || failed=1
done
exit $failed
