#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# run-fuzz.sh [SECONDS] [TARGET...]: builds build/fuzz and fuzzes each target, all if none is named, for so many seconds
# (60), as many at once as there are cores. TESSERA_FUZZ_SEED: where random numbers begin (1). What is found that is new stays in
# build/fuzz/found/TARGET; run-fuzz.sh merge [TARGET...] adds of it to tests/fuzz/corpus what reaches more code.
# Stops at the first finding; its input is in build/fuzz/findings.
set -euo pipefail
fail() { echo "run-fuzz.sh: $*" >&2; exit 1; }

cd "$(dirname "$0")/../.."
all=(block_codec packed_block wire map_file exchange exchange_team clouds depth_images messages octrees sensors status text_files vehicle)
# Bytes of an input at most: what a target makes use of.
declare -A most=([block_codec]=4500 [packed_block]=4096 [wire]=1400 [map_file]=4096 [exchange]=4096 [exchange_team]=512
                 [clouds]=4096 [depth_images]=1024 [messages]=1500 [octrees]=2048 [sensors]=2048 [status]=2048 [text_files]=2048 [vehicle]=2048)
what=${1:-60}
[ $# -eq 0 ] || shift
[[ $what =~ ^([1-9][0-9]*|merge)$ ]] || fail "say how many seconds, or merge, then targets: ${all[*]}"
targets=("$@")
[ $# -gt 0 ] || targets=("${all[@]}")
for target in "${targets[@]}"; do
  [ -n "${most[$target]:-}" ] || fail "there is no target $target; there are ${all[*]}"
done
command -v clang++ >/dev/null || fail "clang is missing; tests/install-packages.sh ci installs it"

cmake --preset fuzz >/dev/null
cmake --build --preset fuzz --parallel "$(nproc)" --target "${targets[@]/#/fuzz_}"
# Files are written for every input of some targets.
[ ! -w /dev/shm ] || export TMPDIR=/dev/shm
seed=${TESSERA_FUZZ_SEED:-1}
mkdir -p build/fuzz/findings
fuzz() {
  local target=$1 found=build/fuzz/found/$1 corpus=tests/fuzz/corpus/$1
  local limits=(-max_len="${most[$target]}" -timeout=20 -rss_limit_mb=2048)
  mkdir -p "$found" "$corpus"
  if [ "$what" = merge ]; then
    # Few inputs that reach all code that is reached; what reaches nothing more goes.
    local merged
    merged=$(mktemp -d -p build/fuzz)
    build/fuzz/tests/fuzz/"fuzz_$target" -set_cover_merge=1 -use_counters=0 "${limits[@]}" "$merged" "$corpus" "$found" 2>&1 | tail -n 1
    rm -rf "$corpus" && mv "$merged" "$corpus" && chmod 755 "$corpus"
    return
  fi
  build/fuzz/tests/fuzz/"fuzz_$target" -seed="$seed" -max_total_time="$what" -print_final_stats=1 "${limits[@]}" \
    -artifact_prefix="build/fuzz/findings/${target}_" "$found" "$corpus" >"build/fuzz/$target.log" 2>&1 ||
    { tail -n 40 "build/fuzz/$target.log"; fail "$target found something, see above and build/fuzz/$target.log"; }
  echo "== $target: $what s, seed $seed"
  grep -E 'DONE|stat::(number_of_executed_units|peak_rss_mb)' "build/fuzz/$target.log"
}
running=0
for target in "${targets[@]}"; do
  if [ "$running" -ge "$(nproc)" ]; then
    wait -n || { wait; exit 1; }
    running=$((running - 1))
  fi
  fuzz "$target" &
  running=$((running + 1))
done
while [ "$running" -gt 0 ]; do
  wait -n || { wait; exit 1; }
  running=$((running - 1))
done
