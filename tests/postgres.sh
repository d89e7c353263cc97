#!/bin/sh
# Makes sure that a PostgreSQL server is there for the tests of the records: installed now from the system's
# packages where that is allowed; else says what to install and fails.
set -eu

have_postgres() {
    command -v initdb >/dev/null || ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1
}

have_postgres && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "Installing PostgreSQL for the tests of the records ..." >&2
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -qq -y postgresql; } >&2
    have_postgres && exit 0
fi
echo "The tests of the records need PostgreSQL; install it with: sudo apt-get install postgresql" >&2
exit 1
