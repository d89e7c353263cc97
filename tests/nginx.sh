#!/bin/sh
# Makes sure that nginx is there for the tests of proxies: installed now from the system's packages where that is
# allowed; else says what to install and fails.
set -eu

command -v nginx >/dev/null || [ -x /usr/sbin/nginx ] && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "Installing nginx for the tests of proxies ..." >&2
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -qq -y nginx-light; } >&2
    [ -x /usr/sbin/nginx ] && exit 0
fi
echo "The tests of proxies need nginx; install it with: sudo apt-get install nginx-light" >&2
exit 1
