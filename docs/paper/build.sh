#!/usr/bin/env bash
# The paper as build/paper.pdf; needs Debian's pandoc and weasyprint
set -euo pipefail
cd "$(dirname "$0")"
mkdir -p ../../build
pandoc paper.md --citeproc --standalone --pdf-engine=weasyprint -o ../../build/paper.pdf
