#!/usr/bin/env bash
# The paper and the technical report as build/paper.pdf and build/report.pdf; needs Debian's pandoc and chromium
set -euo pipefail
cd "$(dirname "$0")"
mkdir -p ../../build
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

pdf() { # NAME: from a page that pandoc wrote
    chromium --headless --no-sandbox --disable-gpu --no-pdf-header-footer --print-to-pdf="$work/$1.pdf" "file://$work/$1.html" 2>/dev/null
    mv "$work/$1.pdf" "../../build/$1.pdf"
}

pandoc paper.md --citeproc --standalone --css style.css --self-contained -o "$work/paper.html"
pdf paper

# The appendix is the page of the documentation, whose formulas have their numbers by \tag
sed -e '1d' -e 's/\\tag{\([0-9]*\)}/\\qquad(\1)/g' -e 's/\\[Bb]ig[lr]//g' -e 's/^##/#/' ../theory.md > "$work/theory.md"
pandoc report.md "$work/theory.md" --citeproc --bibliography paper.bib --standalone --mathml --resource-path=.:.. --css style.css --self-contained -o "$work/report.html"
pdf report
