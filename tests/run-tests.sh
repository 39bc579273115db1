#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# run-tests.sh [ctest arguments]: installs what is missing, builds build/release, runs every test.
set -euo pipefail
cd "$(dirname "$0")/.."
./tests/install-packages.sh tests
cmake --preset release -DTESSERA_BUILD_TESTS=ON || { echo "configuring failed, see above" >&2; exit 1; }
cmake --build --preset release
exec ctest --test-dir build/release --output-on-failure -j "$(nproc)" "$@"
