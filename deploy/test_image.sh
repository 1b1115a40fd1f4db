#!/bin/bash
# The container without Docker: builds deploy/Dockerfile with buildah on a base made from Debian's packages, simulates
# a session in it as a user the image does not know, and loads its web view. No service of this machine is touched.
#
#   deploy/test_image.sh [ARCH] [FOLDER]      ARCH: amd64 or arm64; FOLDER (default ~/.cache/repose/image) keeps what is built
#
#   EXTRAS=station deploy/test_image.sh       another choice of extras; without `view` the web view is left out
#
# Needs: root, and buildah mmdebstrap iproute2 curl; for another processor than this machine's a kernel that runs its
# programs (qemu-user-static sees to it where systemd runs).
set -euo pipefail
cd "$(dirname "$0")/.."
for tool in buildah mmdebstrap ip curl; do
  command -v "$tool" >/dev/null || { echo "Expected $tool: apt-get install buildah mmdebstrap iproute2 curl" >&2; exit 2; }
done
arch=${1:-$(dpkg --print-architecture)}
folder=$(realpath -m "${2:-$HOME/.cache/repose/image}")
base=$(sed -n 's/^FROM \([^ ]*\).*/\1/p' deploy/Dockerfile | tail -1)
extras=${EXTRAS:-$(sed -n 's/^ARG EXTRAS=//p' deploy/Dockerfile)}
export root="$folder/$arch" # one store for each processor
mkdir -p "$root"
store() { buildah --root "$root/images" --runroot "$root/run" "$@"; }
export -f store

# The official image is this Debian too, with a Python of its own in /usr/local; here it is Debian's Python 3.11.
if ! store inspect --type image "docker.io/library/$base" >/dev/null 2>&1; then
  echo "== making a base in the place of $base ($arch)"
  mmdebstrap --mode=root --variant=minbase --skip=check/qemu --architectures="$arch" \
    --include=ca-certificates,netbase,tzdata,python3,python3-venv \
    --customize-hook='ln -s /usr/bin/python3.11 "$1/usr/local/bin/python"' \
    bookworm "$root/base.tar" "${MIRROR:-http://deb.debian.org/debian}"
  made=$(store from --arch "$arch" scratch)
  store add "$made" "$root/base.tar" /
  store config --arch "$arch" --env PATH=/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin "$made"
  store commit --rm "$made" "docker.io/library/$base"
fi

echo "== building deploy/Dockerfile with the extras $extras"
ours=() # this machine's package index and certificates
for file in /etc/pip.conf /etc/ssl/certs/ca-certificates.crt; do
  [ ! -e "$file" ] || ours+=(--volume "$file:$file:ro")
done
store build --isolation chroot --pull-never --arch "$arch" --build-arg "EXTRAS=$extras" "${ours[@]}" \
  --ignorefile deploy/Dockerfile.dockerignore --file deploy/Dockerfile --tag repose .
store images

container=$(store from --pull-never --arch "$arch" localhost/repose)
trap 'store rm "$container" >/dev/null' EXIT
recordings=$(mktemp -d "$root/recordings.XXXX")
chown 12345 "$recordings"
export container recordings
inside() {
  echo "== $*"
  store run --isolation chroot --user 12345 --volume "$recordings:/recordings" "$container" -- "$@"
}
export -f inside
inside station --help
inside station run --lockstep --samples 3 --seed 1 --out a.mcap
inside station samples a.mcap
inside station doctor a.mcap
case ,$extras, in *,view,* | *,all,*) ;; *) exit ;; esac

# In namespaces of its own: its ports are nobody else's, and all of it ends with the last command.
inside station replay a.mcap --no-viewer
unshare --net --pid --fork --mount-proc --kill-child bash -euc '
  ip link set lo up
  inside rerun --serve-web --bind 0.0.0.0 a.rrd &
  for page in "" re_viewer.js re_viewer_bg.wasm; do
    curl --fail --silent --retry 300 --retry-delay 1 --retry-connrefused --output /dev/null \
      --write-out "%{url}: %{size_download} bytes\n" "http://127.0.0.1:9090/$page"
  done'
