#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# run-tests.sh [ctest arguments]: installs what is missing, builds build/release, runs every test.
set -euo pipefail
fail() { echo "run-tests.sh: $*" >&2; exit 1; }

cd "$(dirname "$0")/.."
./tests/install-packages.sh tests
cmake --preset release -DTESSERA_BUILD_TESTS=ON -DTESSERA_BUILD_PLATFORM=ON || fail "CMake could not configure build/release, see above"
cmake --build --preset release --parallel "$(nproc)" || fail "build/release does not build, see above"
exec ctest --test-dir build/release --output-on-failure --parallel "$(($(nproc) + 1))" "$@"
