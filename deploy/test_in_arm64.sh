#!/bin/bash
# A Pi without a Pi: builds a Debian 13 for 64-bit Arm, runs the camera agent's tests in it under qemu, deploys to it
# over a real ssh connection, and listens for its corners. Not part of `make test`: it takes an hour (hours on a busy
# computer), and Debian's package server. Everything happens in private namespaces and one folder; no service of this
# machine is touched.
#
#   deploy/test_in_arm64.sh [FOLDER]      FOLDER (default ~/.cache/repose/arm64) keeps the system for the next time
#
#   TESTS="tests/unit/pi_agent" deploy/test_in_arm64.sh     other tests; TESTS="" none
#
# Needs: mmdebstrap qemu-user-static openssh-client (and uidmap, when not run by root), a kernel of 6.7 or newer.
set -euo pipefail
checkout=$(cd "$(dirname "$0")/.." && pwd)
folder=$(realpath -m "${1:-$HOME/.cache/repose/arm64}")
tests=${TESTS-tests/unit/pi_agent tests/unit/tracking}
qemu=$(command -v qemu-aarch64-static) || { echo "Expected qemu-aarch64-static: apt-get install qemu-user-static" >&2; exit 2; }
command -v mmdebstrap >/dev/null || { echo "Expected mmdebstrap: apt-get install mmdebstrap" >&2; exit 2; }
[ -x "$checkout/.venv/bin/station" ] || make --silent -C "$checkout" setup

if [ -z "${REPOSE_INSIDE:-}" ]; then
  mkdir -p "$folder"
  export REPOSE_INSIDE=1
  if [ "$(id -u)" != 0 ]; then
    exec unshare --user --map-root-user --map-auto --mount --pid --fork --kill-child "$0" "$folder"
  fi
  # Root needs a user namespace as well, for a binfmt_misc of its own: its ids are mapped to themselves.
  exec python3 - "$0" "$folder" <<'PYTHON'
import ctypes, os, sys
ready, go = os.pipe(), os.pipe()
child = os.fork()
if child == 0:
    if ctypes.CDLL(None, use_errno=True).unshare(0x10000000 | 0x00020000):  # CLONE_NEWUSER | CLONE_NEWNS
        raise OSError(ctypes.get_errno(), "no user namespace")
    os.write(ready[1], b"x")
    os.read(go[0], 1)
    os.setgid(0)
    os.setuid(0)
    os.execvp("unshare", ["unshare", "--pid", "--fork", "--kill-child", *sys.argv[1:]])
os.read(ready[0], 1)
for name in ("uid_map", "gid_map"):
    with open(f"/proc/{child}/{name}", "w") as table:
        table.write("0 0 65536\n")
os.write(go[1], b"x")
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
PYTHON
fi

root=$folder/root
mkdir -p "$folder/binfmt"
mount -t binfmt_misc binfmt_misc "$folder/binfmt"
[ -e "$folder/binfmt/repose-aarch64" ] || printf '%s' ":repose-aarch64:M::\\x7fELF\\x02\\x01\\x01\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x00\\x02\\x00\\xb7\\x00:\\xff\\xff\\xff\\xff\\xff\\xff\\xff\\x00\\xff\\xff\\xff\\xff\\xff\\xff\\xff\\xff\\xfe\\xff\\xff\\xff:$qemu:F" >"$folder/binfmt/register"

packages=python3,python3-numpy,python3-scipy,python3-pytest,python3-pytest-timeout,python3-hypothesis,openssh-server,chrony,procps
if [ "$(cat "$folder/complete" 2>/dev/null)" != "$packages" ]; then
  echo "== building Debian 13 (arm64) in $root"
  rm -rf "$root" "$folder/complete"
  mmdebstrap --mode=root --architectures=arm64 --variant=apt --skip=check/qemu \
    --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/doc/*' \
    --include="$packages" \
    trixie "$root" "${MIRROR:-http://deb.debian.org/debian}"
  echo "$packages" >"$folder/complete"
fi
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
chroot "$root" /usr/bin/uname -m

echo "== deploying to it over ssh"
port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
bus=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
laptop=$folder/laptop
rm -rf "$laptop" && mkdir -p "$laptop/pictures" "$laptop/code" "$root/root/.ssh" "$root/run/sshd"
# A copy, so that an edit meanwhile does not make the second deployment another one than the first.
tar -C "$checkout" --exclude=__pycache__ -c pi_agent shared tests deploy pyproject.toml | tar -C "$laptop/code" -x
ssh-keygen -q -t ed25519 -N "" -f "$laptop/id"
install -m 600 "$laptop/id.pub" "$root/root/.ssh/authorized_keys"
"$checkout/.venv/bin/python" - "$laptop/pictures" <<'PYTHON'
import sys
import cv2
import numpy as np
for number in range(3):
    image = np.full((600, 600), 200, np.uint8)
    image[270 + number : 332 + number, 265:327] = 30
    cv2.imwrite(f"{sys.argv[1]}/{number}.png", cv2.GaussianBlur(image, (0, 0), 0.8))
PYTHON
cat >"$laptop/rig.toml" <<TOML
id = "arm64"
[bus]
camera = "tcp/127.0.0.1:$bus"
[camera]
driver = "video_file"
rate_hz = 5.0
[camera.options]
path = "pictures"
loop = true
TOML
chroot "$root" /usr/sbin/sshd -D -e -p "$port" -o ListenAddress=127.0.0.1 -o UsePAM=no -o PidFile=none 2>"$folder/sshd.log" &
sshd=$!
trap 'kill $sshd' EXIT
until (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; do kill -0 $sshd; sleep 1; done
deploy() {
  (cd "$checkout" && .venv/bin/station deploy root@127.0.0.1 --port "$port" --identity "$laptop/id" --rig "$laptop/rig.toml" \
    --ssh-option StrictHostKeyChecking=no --ssh-option "UserKnownHostsFile=$laptop/known_hosts" \
    --code "$laptop/code" --supervisor none --force --patience 120 "$@")
}
deploy
echo "== once more: nothing may change"
deploy --verify-seconds 0
deploy --status
chroot "$root" /bin/sh -c 'cd /opt/repose/current && ps -o user,rss,args -C qemu-aarch64-static | grep pi_agent; ls -l /opt/repose /opt/repose/releases; cat /etc/chrony/sources.d/repose.sources; du -sh /opt/repose'

if [ -n "$tests" ]; then
  echo "== the agent's tests on Arm: $tests"
  rm -rf "$root/srv/repose" && mkdir -p "$root/srv/repose"
  cp -r "$laptop/code/." "$root/srv/repose/"
  kill "$(cat "$root/var/lib/repose/agent.pid")" || true # under qemu it would take half of a core from them
  # shellcheck disable=SC2086 # the words of $tests are separate arguments
  status=0
  chroot "$root" /bin/sh -c "cd /srv/repose && PYTHONPATH=/srv/repose REPOSE_PATIENCE_S=900 /opt/repose/current/venv/bin/python -m pytest -q -p no:cacheprovider --timeout=3000 $tests" || status=$?
fi

echo "== uninstalling"
deploy --uninstall --purge
chroot "$root" /bin/sh -c 'ls -d /opt/repose /var/lib/repose /etc/chrony/sources.d/repose.sources; getent passwd repose' 2>&1 || true
echo "== done${tests:+, the tests ended with status $status}"
exit "${status:-0}"
