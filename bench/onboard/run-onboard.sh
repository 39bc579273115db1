#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# run-onboard.sh [--write-docs] [SECONDS [OUT]]: one node on this machine as on a robot: 64-beam scans at 10 Hz over LCM, voxels of 0.1 m out to
# 40 m, free space, exchange and fusion, and the traffic of two peers coming in, which was recorded before. Then
# how long a node takes to react to its vehicle's bus, in User-Mode Linux. Writes OUT/onboard.json and OUT/onboard.png (default
# build/release/bench/onboard), and tables. 300 seconds if not said otherwise. --write-docs: also into docs/measured/timing.md.
set -euo pipefail
cd "$(dirname "$0")/../.."
docs=
if [ "${1:-}" = --write-docs ]; then docs=docs/measured; shift; fi
seconds=${1:-300}
out=${2:-build/release/bench/onboard}
./tests/install-packages.sh bench
cmake --preset release >/dev/null
cmake --build --preset release --parallel "$(nproc)" --target tessera_cli
# liblcm's logger and player, unlike the node, ask the routes where to send.
network=(./tests/in-own-network.sh sh -c 'ip route replace 224.0.0.0/4 dev lo && exec "$@"' sh)
"${network[@]}" true 2>/dev/null || network=()
python=/usr/bin/python3  # That of Debian, which has matplotlib.
"${network[@]}" $python -B bench/onboard/measure.py --tessera build/release/tessera --seconds "$seconds" --out "$out"
$python -B bench/onboard/can_reaction.py --tessera build/release/tessera --into "$out/onboard.json"
$python -B bench/onboard/draw.py "$out/onboard.json" "$out/onboard.png"
$python -B bench/onboard/write_tables.py "$out/onboard.json" $docs
[ -z "$docs" ] || cp "$out/onboard.png" "$docs/onboard_latencies.png"
