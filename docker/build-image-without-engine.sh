#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# build-image-without-engine.sh: builds docker/Dockerfile and starts the daemon from the image once,
# with debootstrap and buildah alone: no container engine, no registry. Needs root on Debian 12.
#
#   1. debootstrap a Debian 12 root file system; commit it under the Dockerfile's base, debian:12
#   2. buildah bud in a chroot, never pulling
#   3. run `brainshiftd serve` from the image as its own user, without a model, on a loopback port;
#      check that it names its endpoint and greets a peer; stop it
#   4. write build/image/brainshift.tar for `docker load` or `podman load`
#
# Environment:
#   BRAINSHIFT_HOST_APT=1   the build uses this machine's apt sources, settings and certificates,
#                           e.g. behind a mirror. They are mounted during the build and never in the
#                           image. The build receives the usual proxy variables either way.
#   BRAINSHIFT_IMAGE_DIR    where storage and the archive go (default build/image)
#   JOBS                    compilers at once in the build stage (default 2)
set -euo pipefail
cd "$(dirname "$0")/.."

image=brainshift
base=debian:12
suite=bookworm
dir=$(realpath -m "${BRAINSHIFT_IMAGE_DIR:-build/image}")
rootfs=$dir/rootfs

fail() { echo "build-image: $*" >&2; exit 1; }
say() { echo "build-image: [$((SECONDS / 60))m$((SECONDS % 60))s] $*"; }
[ "$(id -u)" -eq 0 ] || fail "must be root (debootstrap and chroot need it)"
for tool in debootstrap buildah; do
  command -v "$tool" >/dev/null || fail "$tool not found: apt-get install --no-install-recommends debootstrap buildah"
done
mkdir -p "$dir"

# Everything stays below $dir, whatever storage the machine's own containers use.
container=
daemon=
bud() { buildah --root "$dir/storage" --runroot "$dir/run" --storage-driver vfs "$@"; }
# The last process below a pid. buildah answers SIGTERM by killing what it runs, so the signal goes
# to the daemon itself.
innermost() {
  local pid=$1 child
  while child=$(cat /proc/"$pid"/task/*/children 2>/dev/null | tr -s ' ' '\n' | head -n 1) && [ -n "$child" ]; do
    pid=$child
  done
  echo "$pid"
}
stop_daemon() {
  local pid=$daemon
  daemon=
  kill -TERM "$(innermost "$pid")"
  wait "$pid"
}
cleanup() {
  [ -z "$daemon" ] || stop_daemon || true
  [ -z "$container" ] || bud rm "$container" >/dev/null || true
}
trap cleanup EXIT

host_apt=()
mirror=
if [ "${BRAINSHIFT_HOST_APT:-0}" = 1 ]; then
  mirror=$(apt-get indextargets --format '$(REPO_URI)' "Codename: $suite" 2>/dev/null | head -n 1)
  for path in /etc/apt /etc/ssl/certs /usr/local/share/ca-certificates; do
    [ ! -d "$path" ] || host_apt+=(--volume "$path:$path:ro")
  done
fi

make_base() {
  local keyring=/usr/share/keyrings/debian-archive-keyring.gpg
  [ -r "$keyring" ] || fail "$keyring not found: apt-get install debian-archive-keyring"
  rm -rf --one-file-system "$rootfs"
  debootstrap --variant=minbase --keyring="$keyring" "$suite" "$rootfs" ${mirror:+"$mirror"} \
    >"$dir/debootstrap.log" 2>&1 || { tail -n 5 "$dir/debootstrap.log" >&2; fail "debootstrap failed"; }
  # debootstrap leaves downloaded packages, lists and its mirror. The base needs none of them.
  rm -rf "$rootfs"/var/cache/apt/archives/*.deb "$rootfs"/var/lib/apt/lists/*
  printf 'deb http://deb.debian.org/%s %s main\n' \
    debian "$suite" debian "$suite-updates" debian-security "$suite-security" >"$rootfs/etc/apt/sources.list"
  local scratch
  scratch=$(bud from scratch)
  bud add --quiet "$scratch" "$rootfs" / >/dev/null
  bud config --cmd /bin/bash --env PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "$scratch"
  bud commit --quiet --rm "$scratch" "$base" >/dev/null
  rm -rf --one-file-system "$rootfs"
}

if bud inspect --type image "$base" >/dev/null 2>&1; then
  say "base image $base is there already (remove $dir to remake it)"
else
  say "making base image $base with debootstrap"
  make_base
fi

say "building $image"
bud bud --isolation chroot --pull-never --quiet "${host_apt[@]}" --build-arg "JOBS=${JOBS:-2}" \
  --file docker/Dockerfile --tag "$image" . >"$dir/build.log" 2>&1 ||
  { tail -n 30 "$dir/build.log" >&2; fail "build failed; whole log in $dir/build.log"; }

say "starting the daemon from the image"
container=$(bud from --pull-never "$image")
in_image() { bud run --isolation chroot "$container" -- "$@"; }
mkfifo -m 600 "$dir/daemon.pipe.$$"
in_image brainshiftd serve --config /etc/brainshift/daemon.yaml --endpoint 'tcp://127.0.0.1:*' \
  >"$dir/daemon.pipe.$$" 2>"$dir/daemon.log" &
daemon=$!
exec {output}<"$dir/daemon.pipe.$$"
rm "$dir/daemon.pipe.$$"
endpoint=
while IFS= read -r -t 60 -u "$output" line; do
  case $line in *"listening on tcp://"*) endpoint=tcp://${line##*tcp://}; break ;; esac
done
[ -n "$endpoint" ] || { tail -n 5 "$dir/daemon.log" >&2; fail "the daemon did not say that it listens"; }
say "daemon says: listening on $endpoint; it runs as $(in_image id -un)"
# A ZeroMQ peer greets with 0xff, eight bytes of length and 0x7f (ZMTP 3.1, section 3).
hostport=${endpoint#tcp://}
greeting=$(timeout 10 bash -c 'exec 3<>"/dev/tcp/$1/$2" && head -c 10 <&3 | od -An -tx1 | tr -d " \n"' \
  greet "${hostport%:*}" "${hostport##*:}") || fail "nothing accepts connections at $endpoint"
[[ $greeting =~ ^ff[0-9a-f]{16}7f$ ]] || fail "no ZeroMQ greeting at $endpoint but '$greeting'"
say "it greets as a ZeroMQ peer"

stop_daemon || fail "the daemon did not end cleanly; see $dir/daemon.log"
say "it stopped when asked to"

say "writing $dir/$image.tar"
rm -f "$dir/$image.tar"
bud push --quiet "$image" "docker-archive:$dir/$image.tar:$image:latest"
say "done: $(du -h "$dir/$image.tar" | cut -f1) in $dir/$image.tar"
