#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# run-tests.sh [ctest arguments]: installs what is missing, builds build/release, runs every test.
# run-tests.sh --fast [ctest arguments]: builds build/fast without optimising much, asserts on, runs the unit tests and laws of the
# library: the loop while one works on it.
set -euo pipefail
fail() { echo "run-tests.sh: $*" >&2; exit 1; }

cd "$(dirname "$0")/.."
if [ "${1:-}" = --fast ]; then
  shift
  cmake --preset fast >/dev/null || fail "CMake could not configure build/fast; tests/install-packages.sh tests installs what it needs"
  cmake --build --preset fast --parallel "$(nproc)" || fail "build/fast does not build, see above"
  export TESSERA_PROPERTY_CASES=${TESSERA_PROPERTY_CASES:-2000}  # of 20,000
  exec ctest --test-dir build/fast --output-on-failure --parallel "$(($(nproc) + 1))" -R "$(cat build/fast/tests/fast_tests)" "$@"
fi
./tests/install-packages.sh tests
cmake --preset release -DTESSERA_BUILD_TESTS=ON -DTESSERA_BUILD_PLATFORM=ON || fail "CMake could not configure build/release, see above"
cmake --build --preset release --parallel "$(nproc)" || fail "build/release does not build, see above"
exec ctest --test-dir build/release --output-on-failure --parallel "$(($(nproc) + 1))" "$@"
