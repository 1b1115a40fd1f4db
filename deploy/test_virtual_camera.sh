#!/bin/bash
# The real picamera2 without a Pi: an emulated computer with Debian unstable's libcamera plays a drawn mark by
# libcamera's virtual camera, and pi_agent/cameras/pi_camera.py reads it through PyPI's picamera2. Not part of
# `make test`: it takes Debian's package server and some minutes. No service of this machine
# is touched, and nothing outside FOLDER is written.
#
#   deploy/test_virtual_camera.sh [FOLDER]      FOLDER (default ~/.cache/repose/virtual_camera) keeps the system
#
#   SECONDS_SEEN=60 deploy/test_virtual_camera.sh     looks for longer than 20 s
#   KVM=1 deploy/test_virtual_camera.sh               on the processor itself (within another virtual machine it may stop)
#
# Needs: root, and mmdebstrap qemu-system-x86 e2fsprogs. An emulated computer, since the camera's buffers want
# /dev/dma_heap and /dev/udmabuf, which many kernels lack. Exits with 77 and the reason where it cannot run.
set -euo pipefail
checkout=$(cd "$(dirname "$0")/.." && pwd)
folder=$(realpath -m "${1:-$HOME/.cache/repose/virtual_camera}")
skip() { echo "skipped: $*" >&2; exit 77; }
[ "$(id -u)" = 0 ] || skip "expected root, which builds the emulated computer's disk"
[ "$(uname -m)" = x86_64 ] || skip "expected an x86-64 computer, got $(uname -m)"
for tool in mmdebstrap qemu-system-x86_64 mke2fs; do
  command -v "$tool" >/dev/null || skip "expected $tool: apt-get install mmdebstrap qemu-system-x86 e2fsprogs"
done
root=$folder/root
mkdir -p "$folder"

# Debian 13's libcamera (0.4) hangs in its virtual camera, and Debian 12's (0.0.3) has none.
packages=kmod,mount,udev,python3,python3-pip,python3-numpy,python3-pil,python3-libcamera,libcamera-ipa,python3-prctl,python3-av
packages+=,python3-libarchive-c,python3-jsonschema,python3-tqdm,python3-piexif,zstd,initramfs-tools,linux-image-amd64
packages+=,ca-certificates,gcc,libc6-dev,python3-dev
if [ "$(cat "$folder/complete" 2>/dev/null)" != "$packages" ]; then
  echo "== building Debian unstable in $root"
  rm -rf "$root" "$folder/complete"
  mmdebstrap --mode=root --variant=apt --aptopt='Acquire::Check-Valid-Until "false"' \
    --dpkgopt=force-unsafe-io --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/doc/*' \
    --include="$packages" sid "$root" "${MIRROR:-http://deb.debian.org/debian}"
  cp -L /etc/resolv.conf "$root/etc/resolv.conf"
  [ ! -e /etc/pip.conf ] || cp -L /etc/pip.conf "$root/etc/pip.conf"
  cp -L /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/ca-certificates.crt"
  chroot "$root" python3 -m pip install --quiet --root-user-action=ignore --break-system-packages --no-deps \
    picamera2==0.3.38 PiDNG simplejpeg videodev2 OpenEXR opencv-python-headless protobuf
  echo "$packages" >"$folder/complete"
fi

rm -rf "$root/repose"
mkdir -p "$root/repose/tests/unit" "$root/root"
cp -r "$checkout"/{pi_agent,shared} "$root/repose/"
cp -r "$checkout/tests/unit/pi_agent" "$root/repose/tests/unit/"
touch "$root/repose/tests/__init__.py" "$root/repose/tests/unit/__init__.py"
cp "$checkout/deploy/virtual_camera/seen.py" "$root/repose/"
chroot "$root" env PYTHONPATH=/repose HOME=/root python3 /repose/seen.py draw # the emulated computer is slow
cat >"$root/repose/init" <<INIT
#!/bin/sh
export PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root PYTHONPATH=/repose
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t tmpfs tmp /tmp; mount -t tmpfs run /run
mountpoint -q /dev || mount -t devtmpfs dev /dev
modprobe udmabuf 2>/dev/null
# picamera2 opens the heaps of a Pi's kernel by name; its buffers are libcamera's own here.
[ -e /dev/dma_heap/linux,cma ] || ln -s /dev/dma_heap/system /dev/dma_heap/linux,cma
ls -l /dev/dma_heap /dev/udmabuf
cd /repose
python3 -X faulthandler seen.py ${SECONDS_SEEN:-20} || echo "WRONG: it ended with status \$?"
sync
echo o >/proc/sysrq-trigger
sleep 60
INIT
chmod +x "$root/repose/init"

kernel=$(echo "$root"/boot/vmlinuz-*) initrd=$(echo "$root"/boot/initrd.img-*)
size_kb=$(($(du -sk "$root" | cut -f1) * 13 / 10 + 200000))
rm -f "$folder/disk.img"
mke2fs -q -t ext4 -d "$root" "$folder/disk.img" "${size_kb}k"
accelerator=$([ -n "${KVM:-}" ] && echo "kvm -cpu host" || echo "tcg,thread=multi -cpu max")
echo "== booting it (-accel $accelerator)"
# shellcheck disable=SC2086  # an option and its processor
timeout "${LIMIT_S:-1800}" qemu-system-x86_64 -accel $accelerator -m 2048 -smp 2 -nographic -no-reboot -net none \
  -kernel "$kernel" -initrd "$initrd" -drive "file=$folder/disk.img,format=raw,if=virtio" \
  -append "root=/dev/vda rw console=ttyS0 panic=-1 init=/repose/init" </dev/null | tee "$folder/console.txt"
grep -q '^RIGHT' "$folder/console.txt"
