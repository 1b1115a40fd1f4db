#!/bin/sh
# Makes the virtual environment for `make setup`: prepare.sh PYTHON VENV LOCK. First it looks at everything that would
# end the set-up minutes later, and says it in one sentence. Nothing is ever compiled, so no compiler is asked for.
set -eu
python=$1 venv=$2 lock=$3
space_mb=4500  # 3100 MB are installed (`du -sm .venv`, of it 400 MB compiled files), and pip keeps the wheels beside it until all are in

refuse() {
  echo "make setup: $1" >&2
  exit 1
}

command -v "$python" >/dev/null 2>&1 || refuse "Expected Python 3.11 to 3.14, found no $python; install one (Debian: apt-get install python3 python3-venv), or name yours: make PYTHON=python3.12"

# The bounds are those of the wheels in the lock: `make lock` with another Python shows what lacks one.
version=$("$python" -c 'import sys; sys.stdout.write("%d.%d" % sys.version_info[:2])')
case $version in
  3.1[1-4]) ;;
  *) refuse "Expected Python 3.11 to 3.14, which the packages are built for; $python is $version; name another: make PYTHON=python3.12" ;;
esac

machine=$("$python" -c 'import platform, sys; sys.stdout.write(platform.machine() if sys.maxsize > 2**32 else "32-bit " + platform.machine())')
case $machine in
  x86_64 | aarch64 | arm64 | AMD64) ;;
  *) refuse "Expected a 64-bit x86 or Arm processor, which the packages are built for; $python runs on $machine, where all of them would have to be compiled" ;;
esac

libc=$("$python" -c 'import platform, sys; sys.stdout.write(sys.platform + " " + (platform.libc_ver()[0] or "no glibc"))')
case $libc in
  "linux no glibc") refuse "Expected a Linux with glibc, which the packages are built for; this one has another C library (Alpine?); take Debian, Ubuntu or Fedora, or deploy/Dockerfile" ;;
esac

{ mkdir -p "$venv" && : >"$venv/.writable" && rm "$venv/.writable"; } 2>/dev/null \
  || refuse "Expected to write to $venv, but that is not allowed; make the folder writable, or name another: make VENV=/path/to/venv"

if [ ! -x "$venv/bin/python" ]; then
  free_mb=$(df -Pk "$venv" | awk 'NR == 2 { print int($4 / 1024) }')
  [ "$free_mb" -ge "$space_mb" ] || refuse "Expected $space_mb MB free for $venv, got $free_mb MB; make room, or name a folder elsewhere: make VENV=/path/to/venv"
  "$python" -c 'import ensurepip, venv' 2>/dev/null || sh "$(dirname "$0")/ensure_venv.sh" "$python"
  "$python" -m venv "$venv"
fi

# The smallest package of the lock tells if the index answers; pip alone would try for minutes.
one=$(grep -o '^iniconfig==[0-9.]*' "$lock")
said=$("$venv/bin/python" -m pip install --quiet --disable-pip-version-check --dry-run --ignore-installed --no-deps \
  --only-binary :all: --retries 1 --timeout 20 "$one" 2>&1) \
  || refuse "Expected the package index to answer, but it does not ($(printf '%s\n' "$said" | grep -v '^ *$' | tail -n 1)); connect to the network, or set PIP_INDEX_URL or PIP_FIND_LINKS to one that can be reached"
