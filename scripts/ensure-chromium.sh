#!/bin/sh
# The browser tests drive Chromium. Installs it where it is missing and this can; elsewhere says what to install
# and lets the tests go on: those that need a browser are skipped, with this reason.
set -eu

chromium_is_there() { command -v chromium >/dev/null; }

chromium_is_there && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "Installing Chromium for the browser tests ..."
    apt-get update -qq || true
    apt-get install -y -qq --no-install-recommends chromium >/dev/null 2>&1 || true
fi
chromium_is_there || echo "No Chromium: the browser tests are skipped. To run them: sudo apt-get install chromium" >&2
