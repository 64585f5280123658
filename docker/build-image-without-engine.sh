#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# build-image-without-engine.sh: builds docker/Dockerfile and starts the daemon from the image once,
# with debootstrap and buildah alone: no container engine, no registry. Needs root on Debian 12.
#
#   1. debootstrap a Debian 12 root file system; commit it under the names of the Dockerfile's bases:
#      debian:12, and debian:12-slim without manuals and translations
#   2. buildah bud in a chroot, never pulling
#   3. run `brainshiftd serve` from the image as its own user, without a model, on a loopback port;
#      run the image's health check, which must pass; stop the daemon; now it must fail
#   4. write build/image/brainshift.tar for `docker load` or `podman load`, and the image's bill of
#      materials beside it; fail when the image is larger than 300 MiB
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
slim=debian:12-slim
max_mib=300
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

commit_rootfs() {
  local scratch
  scratch=$(bud from scratch)
  bud add --quiet "$scratch" "$rootfs" / >/dev/null
  bud config --cmd /bin/bash --env PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "$scratch"
  bud commit --quiet --rm "$scratch" "$1" >/dev/null
}
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
  commit_rootfs "$base"
  rm -rf "$rootfs"/usr/share/{man,locale,info,lintian}
  find "$rootfs/usr/share/doc" -type f ! -name copyright -delete
  commit_rootfs "$slim"
  rm -rf --one-file-system "$rootfs"
}

if bud inspect --type image "$slim" >/dev/null 2>&1; then
  say "base image $base is there already (remove $dir to remake it)"
else
  say "making base image $base with debootstrap"
  make_base
fi

say "building $image"
# The format docker keeps the health check; OCI knows none.
bud bud --isolation chroot --format docker --pull-never --quiet "${host_apt[@]}" --build-arg "JOBS=${JOBS:-2}" \
  --file docker/Dockerfile --tag "$image" . >"$dir/build.log" 2>&1 ||
  { tail -n 30 "$dir/build.log" >&2; fail "build failed; whole log in $dir/build.log"; }

bud inspect --type image "$image" | grep -c '"Healthcheck": {' >/dev/null || fail "the image has lost its health check"
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
health() { in_image brainshiftd health --config /etc/brainshift/daemon.yaml --endpoint "$endpoint"; }
answer=$(health) || fail "the health check fails at $endpoint"
say "the health check says: $answer"

stop_daemon || fail "the daemon did not end cleanly; see $dir/daemon.log"
say "it stopped when asked to"
! health >/dev/null 2>&1 || fail "the health check passes without a daemon"
say "and the health check fails then"

say "writing $dir/$image.tar"
rm -f "$dir/$image.tar"
bud push --quiet "$image" "docker-archive:$dir/$image.tar:$image:latest"
in_image cat /usr/local/share/doc/brainshift/bill-of-materials.json >"$dir/bill-of-materials.json"
say "$(grep -c '"type":"library"' "$dir/bill-of-materials.json") packages in $dir/bill-of-materials.json"
# The archive's layers are not compressed.
mib=$(($(stat -c %s "$dir/$image.tar") / 1048576))
[ "$mib" -le "$max_mib" ] || fail "the image has $mib MiB, more than $max_mib"
say "done: $mib MiB (at most $max_mib) in $dir/$image.tar"
