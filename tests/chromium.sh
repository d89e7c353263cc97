#!/bin/sh
# Prints the path of a Chromium for the browser tests: $CHROMIUM, else one on the PATH, else one installed now
# from the system's packages; where that is not allowed, says what to install and fails.
set -eu

find_chromium() {
    for name in ${CHROMIUM:-chromium chromium-browser google-chrome google-chrome-stable}; do
        command -v "$name" && return 0
    done
    return 1
}

find_chromium && exit 0
if [ -n "${CHROMIUM:-}" ]; then
    echo "CHROMIUM=$CHROMIUM is not a program; name a Chromium or leave it unset" >&2
    exit 1
fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "Installing Chromium for the browser tests ..." >&2
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -qq -y chromium; } >&2
    find_chromium && exit 0
fi
echo "The browser tests need Chromium; install it with: sudo apt-get install chromium" >&2
echo "(or name one you have: CHROMIUM=/path/to/chromium make test)" >&2
exit 1
