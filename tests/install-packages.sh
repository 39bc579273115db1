#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# install-packages.sh demo|tests|bench|ci|python [--list]: installs from Debian what building, testing, measuring or continuous
# integration needs and is not there yet. Says what it installs before it does. --list only prints all that the word stands for.
set -euo pipefail

fail() { echo "install-packages.sh: $*" >&2; exit 1; }

packages=(g++ cmake ninja-build libeigen3-dev libcli11-dev nlohmann-json3-dev libtomlplusplus-dev libfmt-dev libpng-dev libsodium-dev
          liblcm-dev liblcm-bin liblzf-dev libmicrohttpd-dev liboctomap-dev python3 dpkg-dev gzip)
network=(iproute2 nftables)
browser=(chromium chromium-driver python3-pil python3-selenium)
# Debian has it for x86 alone.
case "$(dpkg --print-architecture 2>/dev/null)" in amd64 | i386) network+=(busybox can-utils user-mode-linux) ;; esac
# The package tessera, and what its tests and example use beside it.
python=(pybind11-dev python3-dev python3-numpy python3-pip python3-venv python3-matplotlib)
testing=(catch2 binutils lintian man-db octomap-tools pkgconf strace systemd valgrind "${network[@]}" "${python[@]}" "${browser[@]}" python3-pytest)
case "${1:-}" in
  demo) packages+=(iproute2) ;;
  tests) packages+=("${testing[@]}") ;;
  bench) packages+=(binutils git python3-matplotlib valgrind "${network[@]}" "${browser[@]}") ;;
  # g++-12-multilib and not g++-multilib, which excludes compilers for other machines.
  ci) packages+=("${testing[@]}" git ccache clang clang-format clang-tidy libclang-rt-dev g++-aarch64-linux-gnu libc6-dev-arm64-cross
                 qemu-user doxygen g++-12-multilib gcc-arm-none-eabi libstdc++-arm-none-eabi-newlib) ;;
  python) packages=(g++ cmake ninja-build libeigen3-dev nlohmann-json3-dev libtomlplusplus-dev libfmt-dev libpng-dev liblzf-dev
                   libsodium-dev "${python[@]}") ;;
  *) fail "say demo, tests, bench, ci or python" ;;
esac
if [ "${2:-}" = --list ]; then
  printf '%s\n' "${packages[@]}"
  exit 0
fi

command -v dpkg-query >/dev/null && command -v apt-get >/dev/null ||
  fail "this is no Debian system; install by other means what these packages have, then build with CMake: ${packages[*]}"

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$status" = installed ] || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || fail "cannot install ${missing[*]}: run this as root, or install sudo"
  as_root=(sudo)
fi
echo "Installing from Debian, which takes some minutes on a fresh machine: ${missing[*]}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q "$@" </dev/null >"$log" 2>&1; }
because() { grep -m1 '^E:' "$log" || tail -n 1 "$log"; }
apt update || fail "cannot fetch the list of packages: $(because)"
apt install -y --no-install-recommends "${missing[@]}" || fail "cannot install ${missing[*]}: $(because)"
