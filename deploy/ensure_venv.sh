#!/bin/sh
# Debian splits venv from python3. As root we can fetch it; otherwise we say what to type.
set -eu
python=$1
package=$("$python" -c 'import sys; print(f"python3.{sys.version_info.minor}-venv")')
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  echo "Installing $package, which this Python lacks"
  apt-get update -qq
  apt-get install -y -qq "$package"
else
  echo "This Python has no venv module. Install it with: sudo apt-get install $package" >&2
  exit 1
fi
