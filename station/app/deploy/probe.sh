#!/bin/sh
# Says what the target is, one key=value a line. Plain sh: it must also run where nothing is installed.
# Arguments: the folder that is installed under, the Python to use.
say() { printf '%s=%s\n' "$1" "$2"; }
ask() { "$python" -c "$1" 2>/dev/null; }
root=$1 python=$2
PATH=$PATH:/usr/sbin:/sbin
[ -r /etc/os-release ] && . /etc/os-release
say system "${PRETTY_NAME:-$(uname -s)}"
say codename "${VERSION_CODENAME:-}"
say machine "$(uname -m)"
say bits "$(getconf LONG_BIT 2>/dev/null)"
say userland "$(dpkg --print-architecture 2>/dev/null)"
say model "$(tr -d '\0' < /proc/device-tree/model 2>/dev/null)"
say python "$(ask 'import sys; print("%d.%d" % sys.version_info[:2])')"
say python_bits "$(ask 'import struct; print(8 * struct.calcsize("P"))')"
say numpy "$(ask 'import numpy; print(numpy.__version__)')"
say picamera2 "$(ask 'import importlib.util as u; print("yes" if u.find_spec("picamera2") else "")')"
for tool in rpicam-hello libcamera-hello; do
  if command -v "$tool" >/dev/null; then
    say cameras "$(timeout 20 "$tool" --list-cameras 2>/dev/null | sed -n 's/^ *\([0-9][0-9]* : [^ ]*\).*/\1/p' | tr '\n' ' ')"
    say cameras_asked yes
    break
  fi
done
place=$root; while [ ! -d "$place" ]; do place=$(dirname "$place"); done
say disk_free_kb "$(df -Pk "$place" | awk 'NR == 2 { print $4 }')"
say writable "$([ -w "$place" ] && echo yes)"
say memory_kb "$(awk '/^MemTotal/ { print $2 }' /proc/meminfo)"
say systemd "$([ -d /run/systemd/system ] && echo yes)"
say chrony "$(command -v chronyd >/dev/null && echo yes)"
say uid "$(id -u)"
if ! command -v sudo >/dev/null; then say sudo none
elif sudo -n true 2>/dev/null; then say sudo free
else say sudo password; fi
say client "${SSH_CONNECTION%% *}"
