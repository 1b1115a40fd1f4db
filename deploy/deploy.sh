#!/bin/sh
# Puts the camera agent onto a Pi: deploy/deploy.sh USER@HOST [options]. It is `station deploy`, which does the work,
# run in this checkout's environment; that environment is set up first if it is missing. `--help` lists the options.
set -eu
checkout=$(cd "$(dirname "$0")/.." && pwd)
station=$checkout/.venv/bin/station
[ -x "$station" ] || make --silent -C "$checkout" setup >&2
exec "$station" deploy "$@"
