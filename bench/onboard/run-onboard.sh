#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# run-onboard.sh [SECONDS [OUT]]: one node on this machine as on a robot: 64-beam scans at 10 Hz over LCM, voxels of 0.1 m out to
# 40 m, free space, exchange and fusion, and the traffic of two peers coming in, which was recorded before. Writes
# OUT/onboard.json and OUT/onboard.png (default build/release/bench/onboard), and a table. 300 seconds if not said otherwise.
set -euo pipefail
cd "$(dirname "$0")/../.."
./tests/install-packages.sh bench
cmake --preset release >/dev/null
cmake --build --preset release --parallel "$(nproc)" --target tessera_cli
# liblcm's logger and player, unlike the node, ask the routes where to send.
network=(./tests/in-own-network.sh sh -c 'ip route replace 224.0.0.0/4 dev lo && exec "$@"' sh)
"${network[@]}" true 2>/dev/null || network=()
# That of Debian, which has matplotlib.
exec "${network[@]}" /usr/bin/python3 -B bench/onboard/measure.py --tessera build/release/tessera --seconds "${1:-300}" --out "${2:-build/release/bench/onboard}"
