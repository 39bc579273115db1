#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# run-demo.sh [OUT]: two simulated robots map a street, and the real scans are mapped too where they are there.
# Leaves maps, reports and pictures in OUT (default out/demo).
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
out=${1:-out/demo}
fail() { echo "run-demo.sh: $*" >&2; exit 1; }
mkdir -p "$out" || fail "cannot write into $out; name another folder"
out=$(cd "$out" && pwd)
if [ -n "${TESSERA_DATA:-}" ]; then
  data=$(cd "$TESSERA_DATA" && pwd) || fail "TESSERA_DATA names no folder: $TESSERA_DATA"
  [ -d "$data/semantickitti_08" ] || fail "TESSERA_DATA holds no semantickitti_08: $TESSERA_DATA"
else
  data=$here/../shared/data
fi
cd "$here"
./tests/install-packages.sh demo
# A build that the tests have been set up in stays so.
tests=()
[ -f build/release/CMakeCache.txt ] || tests=(-DTESSERA_BUILD_TESTS=OFF)
cmake --preset release "${tests[@]}" || fail "CMake could not configure build/release, see above"
cmake --build --preset release --target tessera_cli || fail "build/release does not build, see above"
tessera=$here/build/release/tessera

# map_and_show NAME DATASET TITLE [map options]: map, evaluate, picture, voxels.
map_and_show() {
  local name=$1 dataset=$2 title=$3
  shift 3
  {
    "$tessera" map --dataset "$dataset" --out "$out/$name.tsm" --report "$out/$name.map.json" "$@" &&
      "$tessera" eval --map "$out/$name.tsm" --dataset "$dataset" --report "$out/$name.eval.json" &&
      "$tessera" export --map "$out/$name.tsm" --format png --title "$title" --out "$out/$name.png" &&
      "$tessera" export --map "$out/$name.tsm" --format ply --out "$out/$name.ply"
  } >"$out/$name.log" || fail "mapping $dataset stopped, see above"
}

"$tessera" simulate --scene street --robots 2 --scans 20 --seed 1 --out "$out/street" >"$out/simulate.log" ||
  fail "the simulation stopped, see above"
map_and_show robot_0 "$out/street/robot_0" "Simulated street, robot 0, 64 beams" --robot 0
map_and_show robot_1 "$out/street/robot_1" "Simulated street, robot 1, 16 beams" --robot 1
names="robot_0 robot_1"
if [ -d "$data/semantickitti_08" ]; then
  map_and_show real "$data/semantickitti_08" "SemanticKITTI 08, scans 0-5" --first 0 --last 5
  names+=" real"
fi

python3 - "$out" $names <<'PY'
import json, sys
out, names = sys.argv[1], sys.argv[2:]
print()
print(f"{'map':8} {'scans':>5} {'mIoU in':>8} {'mIoU map':>8} {'gain':>6} {'ms/scan':>8} {'B/voxel':>8} {'heap':>5}  picture")
for name in names:
    m = json.load(open(f"{out}/{name}.map.json"))
    e = json.load(open(f"{out}/{name}.eval.json"))
    gain = 100 * (e["mean_iou"] - e["input_mean_iou"])
    heap = m["heap_allocations_after_init"]
    print(f"{name:8} {m['totals']['scans']:5} {e['input_mean_iou']:8.4f} {e['mean_iou']:8.4f} {gain:+6.2f} "
          f"{m['totals']['median_ms']:8.1f} {m['memory']['bytes_per_label_voxel']:8.1f} {'-' if heap is None else heap:>5}  {out}/{name}.png")
print("mIoU: against ground truth, of the labels given and of the map; gain in points; ms: median; heap: allocations after start.")
print(f"Voxels for CloudCompare or MeshLab: {out}/*.ply; reports: {out}/*.json")
PY
