#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# run-team.sh [--quick] [--write-docs] [OUT]: installs what is missing, builds build/release, and measures what a team costs:
# processes in network namespaces, simulated teams of up to 64 robots, and loss of 0 to 70 % on the blocks of real scans.
# Leaves team.json and exchange_team.png in OUT (default out/team).
#   --quick       short runs and fewer of them: a minute
#   --write-docs  puts the figures and the picture into docs/measured/teams.md
# Needs the right to make network namespaces. Real scans are taken from the folder that TESSERA_DATA names, or
# ../shared/data, if it holds semantickitti_08; else a simulated street is driven through by three robots.
set -euo pipefail
here=$(cd "$(dirname "$0")/../.." && pwd)
fail() { echo "run-team.sh: $*" >&2; exit 1; }

out=out/team
run=()
write_docs=false
for word in "$@"; do
  case "$word" in
    --quick) run+=("$word") ;;
    --write-docs) write_docs=true ;;
    -*) fail "unknown option $word; known: --quick and --write-docs" ;;
    *) out=$word ;;
  esac
done
mkdir -p "$out" || fail "cannot write into $out; name another folder"
out=$(cd "$out" && pwd)
. "$here/bench/recorded-scans.sh"
cd "$here"
[ ! -d "$data/semantickitti_08" ] || run+=(--dataset "$data/semantickitti_08")
./tests/install-packages.sh tests
./tests/install-packages.sh bench
cmake --preset release -DTESSERA_BUILD_TESTS=ON -DTESSERA_BUILD_PLATFORM=ON >"$out/build.log" || fail "CMake could not configure build/release, see $out/build.log"
cmake --build --preset release --target tessera_cli team_member team_costs >>"$out/build.log" || fail "build/release does not build, see $out/build.log"
python3 -B bench/team/measure.py --build build/release --out "$out" "${run[@]}"
/usr/bin/python3 -B bench/team/draw.py "$out/team.json" "$out/exchange_team.png"  # that of Debian, which has matplotlib
if $write_docs; then
  python3 -B bench/team/write_tables.py "$out/team.json" docs/measured
  cp "$out/exchange_team.png" docs/measured/
fi
