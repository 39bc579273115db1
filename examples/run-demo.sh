#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# run-demo.sh [OUT]: two simulated robots map a street, each by itself, then as two processes that share one map over
# multicast; the real scans are mapped too where they are there. Leaves maps, reports and pictures in OUT (default out/demo).
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
out=${1:-out/demo}
fail() { echo "run-demo.sh: $*" >&2; exit 1; }
mkdir -p "$out" || fail "cannot write into $out; name another folder"
out=$(cd "$out" && pwd)
. "$here/bench/recorded-scans.sh"
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

# Two robots as two processes, over multicast on the loopback interface: of a network of its own where the system permits
# that, so that nothing is disturbed.
mkdir -p "$out/shared"
rm -rf "$out"/shared/*
"$tessera" key new --fleet "$out/shared/fleet.key" >"$out/shared/key.log" || fail "no key could be made, see above"
for robot in 0 1; do
  cat >"$out/shared/robot_$robot.toml" <<TOML
[robot]
id = $robot
state = "state"
[replay]
dataset = "../street/robot_$robot"
rate_hz = 4
[network]
url = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"
interface = "lo"
[security]
fleet_key = "fleet.key"
[output]
global_map = "global_of_$robot.tsm"
report = "robot_$robot.json"
$([ $robot = 1 ] || printf 'snapshots = "growing"\nsnapshot_every_s = 0.5')
[run]
wait_for_peers = 1
TOML
done
both='"$0" node --config robot_1.toml >robot_1.log & other=$!
"$0" node --config robot_0.toml >robot_0.log || { kill $other; exit 1; }
wait $other'
network=("$here/tests/in-own-network.sh")
"${network[@]}" true 2>/dev/null || network=()
(cd "$out/shared" && "${network[@]}" sh -c "$both" "$tessera") || fail "the two nodes stopped, see above; \"$tessera doctor --interface lo\" says what the network lacks"

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
python3 - "$out/shared" "$tessera" <<'PY'
import json, subprocess, sys
out, tessera = sys.argv[1:]
reports = [json.load(open(f"{out}/robot_{robot}.json")) for robot in (0, 1)]
final = reports[0]["global_map"]["label_voxels"]
pictures = []
for percent in (25, 50, 75, 100):
    enough = [s for s in reports[0]["snapshots"] if s["label_voxels"] >= percent / 100 * final]
    source, voxels = (enough[0]["file"], enough[0]["label_voxels"]) if enough and percent < 100 else (f"{out}/global_of_0.tsm", final)
    picture = f"{out}/shared_{percent:03}.png"
    subprocess.run([tessera, "export", "--map", source, "--format", "png", "--out", picture, "--title",
                    f"The map that both robots share: {100 * voxels / final:.0f} % of {final} voxels"], check=True, cwd=out, stdout=subprocess.DEVNULL)
    pictures.append(picture)
print()
print(f"{'robot':5} {'scans':>5} {'seconds':>7} {'sent MB':>8} {'recv MB':>8} {'tick p50, p99 ms':>17} {'overruns':>8} {'memory MB':>9} {'heap':>5} {'voxels':>8}  digest")
for r in reports:
    ticks, heap = r["ticks"], r["heap_allocations_after_start"]
    print(f"{r['robot']:5} {r['scans']['integrated']:5} {r['seconds']:7.1f} {r['sent_bytes'] / 1e6:8.2f} {r['received_bytes'] / 1e6:8.2f} "
          f"{ticks['median_ms']:9.1f}, {ticks['p99_ms']:6.1f} {ticks['overruns']:8} {r['memory']['used_bytes'] / 1e6:9.1f} "
          f"{'-' if heap is None else heap:>5} {r['global_map']['label_voxels']:8}  {r['digest']}")
same = reports[0]["digest"] == reports[1]["digest"]
print("Two processes, one map: " + ("the digests are the same." if same else "THE DIGESTS DIFFER."))
print("The shared map growing: " + " ".join(pictures))
sys.exit(0 if same else 1)
PY
