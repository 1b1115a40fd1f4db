#!/bin/sh
# Pins the agent's dependencies for each system, aarch64 wheels only, against that system's own NumPy. Needs uv.
set -eu
cd "$(dirname "$0")"
lock() { # codename, Python, the system's NumPy
  constraint=$(mktemp)
  echo "numpy==$3" >"$constraint"
  {
    echo "# Made by deploy/lock.sh for $1, 64-bit Arm: Python $2, with the system's own NumPy $3 (not installed from here)."
    uv pip compile --quiet --no-header --no-annotate --generate-hashes --only-binary :all: --no-emit-package numpy \
      --no-sources --python-version "$2" --python-platform aarch64-manylinux_2_28 --constraint "$constraint" \
      requirements-pi.in | sed -e '/^# The following packages were excluded/,$d' -e '/^$/d'
  } >"requirements-$1.lock"
  rm -f "$constraint"
}
lock trixie 3.13 2.2.4
lock bookworm 3.11 1.24.2
