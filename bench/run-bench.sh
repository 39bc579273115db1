#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# run-bench.sh [--quick] [--write-docs] [--record-digests] [OUT]: installs what is missing, builds build/release, runs
# every benchmark and draws the pictures. Leaves bench.json and *.png in OUT (default out/bench).
#   --quick           few repetitions: a minute or two instead of twenty
#   --write-docs      puts the figures into docs/measured/benchmarks.md and timing.md
#   --record-digests  takes the results as right: only after inference was changed on purpose
# Real scans are taken from the folder that TESSERA_DATA names, or ../shared/data, if it holds semantickitti_08; else a
# street is simulated.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
fail() { echo "run-bench.sh: $*" >&2; exit 1; }

out=out/bench
run=()
write_docs=false
for word in "$@"; do
  case "$word" in
    --quick | --record-digests) run+=("$word") ;;
    --write-docs) write_docs=true ;;
    -*) fail "unknown option $word; known: --quick, --write-docs and --record-digests" ;;
    *) out=$word ;;
  esac
done
mkdir -p "$out" || fail "cannot write into $out; name another folder"
out=$(cd "$out" && pwd)
. "$here/bench/recorded-scans.sh"
cd "$here"
if [ -d "$data/semantickitti_08" ]; then
  run+=(--dataset "$data/semantickitti_08")
  [ ! -d "$data/kitti_raw_0013" ] || run+=(--drive "$data/kitti_raw_0013")
else
  echo "No recorded scans: the figures will be of a simulated street. Set TESSERA_DATA to a folder with semantickitti_08."
fi
./tests/install-packages.sh bench
# A build that is configured with tests stays so.
tests=()
[ -f build/release/CMakeCache.txt ] || tests=(-DTESSERA_BUILD_TESTS=OFF)
cmake --preset release -DTESSERA_BUILD_BENCH=ON "${tests[@]}" >"$out/build.log" || fail "CMake could not configure build/release, see $out/build.log"
cmake --build --preset release --target tessera_bench >>"$out/build.log" || fail "build/release does not build, see $out/build.log"
python3 -B bench/run.py --build build/release --out "$out" "${run[@]}"
/usr/bin/python3 -B bench/plots.py "$out/bench.json" "$out"  # that of Debian, which has matplotlib
if $write_docs; then
  python3 -B bench/write_docs.py "$out/bench.json" docs/measured
  cp "$out"/bench_*.png docs/measured/
fi
