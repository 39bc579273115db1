#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# run-experiments.sh [--quick] [--write-docs] [--tessera PROGRAM] [OUT]: installs what is missing, builds build/release,
# redoes the paper's studies and draws them. Leaves experiments.json and *.png in OUT (default out/experiments), and what
# they were made from: a second run makes only what is not there yet, another program's run everything but the scenes.
#   --quick            smaller scenes and fewer settings: about five minutes instead of an hour
#   --write-docs       puts the figures and pictures into docs/measured/experiments.md
#   --tessera PROGRAM  the command to study, instead of building it
# Real scans are taken from the folder that TESSERA_DATA names, or ../shared/data, if it holds semantickitti_08.
set -euo pipefail
here=$(cd "$(dirname "$0")/../.." && pwd)
fail() { echo "run-experiments.sh: $*" >&2; exit 1; }

out=out/experiments
run=()
write_docs=false
tessera=
while [ $# -gt 0 ]; do
  case "$1" in
    --quick) run+=("$1") ;;
    --write-docs) write_docs=true ;;
    --tessera)
      [ $# -gt 1 ] || fail "--tessera needs the program's path"
      tessera=$(realpath -e "$2") || fail "no such program: $2"
      shift
      ;;
    -*) fail "unknown option $1; known: --quick, --write-docs and --tessera" ;;
    *) out=$1 ;;
  esac
  shift
done
mkdir -p "$out" || fail "cannot write into $out; name another folder"
out=$(cd "$out" && pwd)
. "$here/bench/recorded-scans.sh"
cd "$here"
if [ -d "$data/semantickitti_08" ]; then
  run+=(--dataset "$data/semantickitti_08")
else
  echo "No recorded scans: only the simulated street is studied. Set TESSERA_DATA to a folder with semantickitti_08."
fi
./tests/install-packages.sh bench
if [ -z "$tessera" ]; then
  # A build that is configured with tests stays so.
  tests=()
  [ -f build/release/CMakeCache.txt ] || tests=(-DTESSERA_BUILD_TESTS=OFF)
  cmake --preset release "${tests[@]}" >"$out/build.log" || fail "CMake could not configure build/release, see $out/build.log"
  cmake --build --preset release --target tessera_cli >>"$out/build.log" || fail "build/release does not build, see $out/build.log"
  tessera=build/release/tessera
fi
python3 -B bench/experiments/run_experiments.py --tessera "$tessera" --out "$out" "${run[@]}"
/usr/bin/python3 -B bench/experiments/draw.py "$out/experiments.json" "$out"  # that of Debian, which has matplotlib
if $write_docs; then
  python3 -B bench/experiments/write_page.py "$out/experiments.json" docs/measured/experiments.md
  cp "$out"/experiments_*.png docs/measured/
fi
