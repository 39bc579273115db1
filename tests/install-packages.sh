#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# install-packages.sh demo|tests|ci: installs from Debian what building, testing or continuous integration needs and is
# not there yet. Says what it installs before it does.
set -euo pipefail

packages="g++ cmake ninja-build libeigen3-dev libcli11-dev nlohmann-json3-dev libtomlplusplus-dev libpng-dev python3"
case "${1:-}" in
  demo) ;;
  tests) packages+=" catch2 binutils" ;;
  ci) packages+=" catch2 binutils clang clang-tidy clang-format g++-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user git" ;;
  *) echo "install-packages.sh: say demo, tests or ci" >&2; exit 1 ;;
esac

missing=""
for package in $packages; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$status" = installed ] || missing+=" $package"
done
[ -n "$missing" ] || exit 0

echo "Installing from Debian:$missing"
as_root=""
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "cannot install$missing: run this as root, or install sudo" >&2; exit 1; }
  as_root=sudo
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if ! { $as_root apt-get update && DEBIAN_FRONTEND=noninteractive $as_root apt-get install -y --no-install-recommends $missing; } >"$log" 2>&1; then
  tail -n 5 "$log" >&2
  echo "cannot install$missing: apt-get failed, see above" >&2
  exit 1
fi
