#!/usr/bin/env bash
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# run-demo.sh [OUT]: three simulated robots map a street, each alone from its files, then together on a mission: each is a
# process that receives a LiDAR, three cameras and poses, and shares one map with the others over multicast. Maps recorded
# scans too if they exist. Writes maps, reports and pictures into OUT (default out/demo).
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
out=${1:-out/demo}
fail() { echo "run-demo.sh: $*" >&2; exit 1; }
mkdir -p "$out" || fail "cannot write into $out; name another folder"
out=$(cd "$out" && pwd)
. "$here/bench/recorded-scans.sh"
cd "$here"
./tests/install-packages.sh demo
# A build that is configured with tests stays so.
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

"$tessera" simulate --scene street --robots 3 --scans 20 --cameras on --sweep on --seed 1 --out "$out/street" >"$out/simulate.log" ||
  fail "the simulation stopped, see above"
map_and_show robot_0 "$out/street/robot_0" "Simulated street, robot 0, 64 beams" --robot 0
map_and_show robot_1 "$out/street/robot_1" "Simulated street, robot 1, 16 beams" --robot 1
map_and_show robot_2 "$out/street/robot_2" "Simulated street, robot 2, 64 beams" --robot 2
names="robot_0 robot_1 robot_2"
if [ -d "$data/semantickitti_08" ]; then
  map_and_show real "$data/semantickitti_08" "SemanticKITTI 08, scans 0-5" --first 0 --last 5
  names+=" real"
fi

# The mission, over multicast on the loopback interface: in its own network namespace if the system permits that, so that
# nothing is disturbed, with a virtual CAN bus if the kernel supports it.
mkdir -p "$out/shared"
rm -rf "$out"/shared/*
"$tessera" key new --robots 3 --dir "$out/shared" >"$out/shared/key.log" || fail "no keys could be made, see above"
network=("$here/tests/in-own-network.sh" sh -c 'ip link add can0 type vcan 2>/dev/null && ip link set can0 up; exec "$@"' sh)
"$here/tests/in-own-network.sh" true 2>/dev/null || network=()
"${network[@]}" python3 -B "$here/examples/mission.py" "$tessera" "$out/street" "$out/shared" ||
  fail "the mission stopped, see above; \"$tessera doctor --interface lo\" checks the network"
for robot in 0 1 2; do
  "$tessera" eval --map "$out/shared/global_of_0.tsm" --dataset "$out/street/robot_$robot" --input cameras \
    --transform "$out/street/robot_$robot/T_global_map.txt" --report "$out/shared/eval_$robot.json" >"$out/shared/eval_$robot.log" ||
    fail "the shared map could not be evaluated, see above"
done

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
print("mIoU: against ground truth, of the input labels and of the map; gain in points; ms: median; heap: allocations after start.")
print(f"Voxels for CloudCompare or MeshLab: {out}/*.ply; reports: {out}/*.json")
PY
python3 - "$out/shared" "$tessera" <<'PY'
import json, pathlib, subprocess, sys
out, tessera = sys.argv[1:]
reports = [json.load(open(f"{out}/robot_{robot}.json")) for robot in (0, 1, 2)]
final = reports[0]["global_map"]["label_voxels"]
pictures = []
for percent in (25, 50, 75, 100):
    enough = [s for s in reports[0]["snapshots"] if s["label_voxels"] >= percent / 100 * final]
    source, voxels = (enough[0]["file"], enough[0]["label_voxels"]) if enough and percent < 100 else (f"{out}/global_of_0.tsm", final)
    picture = f"{out}/shared_{percent:03}.png"
    subprocess.run([tessera, "export", "--map", source, "--format", "png", "--out", picture, "--title",
                    f"The map that all robots share: {100 * voxels / final:.0f} % of {final} voxels"], check=True, cwd=out, stdout=subprocess.DEVNULL)
    pictures.append(picture)
print()
print(f"{'robot':5} {'scans':>5} {'cycle p50, p99 ms':>18} {'to map p50, p99 ms':>18} {'missed':>6} {'sent MB':>8} {'recv MB':>8} {'memory MB':>9} {'heap':>5} {'voxels':>8}  digest")
for r in reports:
    cycle, latency, heap = r["scans"]["times"], r["mapping"]["latencies"], r["heap_allocations_after_start"]
    print(f"{r['robot']:5} {r['scans']['integrated']:5} {cycle['median_ms']:11.1f}, {cycle['p99_ms']:5.1f} "
          f"{latency['median_ms']:11.1f}, {latency['p99_ms']:5.1f} {r['mapping']['missed']:6} {r['sent_bytes'] / 1e6:8.2f} {r['received_bytes'] / 1e6:8.2f} "
          f"{r['memory']['used_bytes'] / 1e6:9.1f} {'-' if heap is None else heap:>5} {r['global_map']['label_voxels']:8}  {r['digest']}")
scans = len(list((pathlib.Path(out).parent / "street" / "robot_0" / "velodyne").iterdir()))
images = sum(r["sensors"]["match"]["images"] for r in reports)
left_out = sum(r["mapping"]["shed"] for r in reports)
print(f"scans: of {scans}, each with images of three cameras ({images} images); {left_out} lost points or rays to the deadline. to map: from the")
print("scan's arrival until it is in the map, including deskewing and labels. Played in slow motion, 3 scans per second.")
same = len({r["digest"] for r in reports}) == 1
print("Three processes, one map: " + ("the digests are the same." if same else "THE DIGESTS DIFFER."))
evals = [json.load(open(f"{out}/eval_{robot}.json")) for robot in (0, 1, 2)]

def mean_iou(kind):
    """Mean over the scans of all robots, by their counts of every class."""
    ious = []
    for name in sorted({name for e in evals for name in e[kind]}):
        counts = [e[kind][name] for e in evals if name in e[kind]]
        hit, wrong, missed = (sum(c[part] for c in counts) for part in ("true_positives", "false_positives", "false_negatives"))
        if hit + missed > 0:
            ious.append(hit / (hit + wrong + missed))
    return sum(ious) / len(ious)

seen, known = mean_iou("input_counts"), mean_iou("counts")
print(f"Against ground truth, over the scans of all: mIoU {known:.4f} of the shared map, {seen:.4f} of the cameras' labels ({100 * (known - seen):+.2f} points).")
print("The shared map growing: " + " ".join(pictures))
sys.exit(0 if same else 1)
PY
# Debian's Python has matplotlib.
if /usr/bin/python3 -c 'import matplotlib' 2>/dev/null; then
  /usr/bin/python3 -B examples/draw_mission.py "$out/shared" "$out/shared_latencies.png" || fail "the latencies could not be drawn, see above"
  echo "Latencies: $out/shared_latencies.png"
else
  echo "Latencies are not drawn: install python3-matplotlib."
fi
