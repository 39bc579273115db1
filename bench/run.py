#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""run.py: runs every benchmark program of a build and joins what they found, with the machine that they ran on, into
OUT/bench.json. run-bench.sh calls it once everything is installed and built."""
import argparse
import datetime
import json
import os
import pathlib
import platform
import subprocess
import sys

import example
import memory
import scan_instructions
import sources
import worst

HERE = pathlib.Path(__file__).resolve().parent
DIGESTS = HERE / "digests.json"
# Repetitions of the whole sequence, scans, scans for OctoMap, budgets.
FULL = {"repetitions": 15, "last": 5, "octomap_last": 5, "budgets": ["64M", "128M", "256M", "512M"]}
QUICK = {"repetitions": 2, "last": 5, "octomap_last": 0, "budgets": ["128M", "512M"]}
SMOKE = {"repetitions": 1, "last": 1, "octomap_last": 0, "budgets": ["64M"]}
DIFFERS = 3  # exit status of a program whose result is not the one on record


def fail(sentence):
    sys.exit(f"run-bench.sh: {sentence}")


def read(path):
    try:
        return pathlib.Path(path).read_text().strip()
    except OSError:
        return ""


def cpu_model():
    names = [line.partition(":")[2].strip() for line in read("/proc/cpuinfo").splitlines() if line.startswith("model name")]
    return names[0] if names else platform.machine()


def caches():
    """Such as {"L1d": "32K", "L2": "512K"}."""
    found = {}
    for entry in sorted(pathlib.Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        kind = {"Data": "d", "Instruction": "i"}.get(read(entry / "type"), "")
        found[f"L{read(entry / 'level')}{kind}"] = read(entry / "size")
    return found


def circumstances():
    memory_kb = [line.split()[1] for line in read("/proc/meminfo").splitlines() if line.startswith("MemTotal")]
    return {"date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
            "commit": sources.commit(),
            "cpu": cpu_model(), "cores": os.cpu_count(), "caches": caches(),
            "memory_gb": round(int(memory_kb[0]) / 1e6, 1) if memory_kb else None,
            "system": f"{platform.system()} {platform.release()}", "load_before": os.getloadavg()[0]}


def simulate(tessera, out, smoke):
    """A street as one robot sees it: of 16 beams for the smoke test, else of 64."""
    scans = SMOKE["last"] + 1 if smoke else FULL["last"] + 1
    subprocess.run([tessera, "simulate", "--scene", "street", "--robots", "2", "--scans", str(scans), "--seed", "1",
                    "--out", str(out / "street")], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return out / "street" / ("robot_1" if smoke else "robot_0")


def run_program(program, options, plan, dataset, out):
    name = program.name.removeprefix("bench_")
    print(f"{name} ...", flush=True)
    target = out / f"{name}.json"
    last = plan["octomap_last"] if name == "octomap" else plan["last"]
    command = [program, "--dataset", dataset, "--first", 0, "--last", last, "--repetitions", plan["repetitions"], "--out", target]
    if not options.record_digests:
        command += ["--digests", DIGESTS]
    status = subprocess.run([str(word) for word in command]).returncode
    if status not in (0, DIFFERS):
        fail(f"{program.name} ended with status {status}, see above")
    return json.loads(target.read_text()), status == DIFFERS


def record(found, scene):
    known = json.loads(DIGESTS.read_text()) if DIGESTS.exists() else {}
    for part in found.values():
        digests = part.get("digests", {})
        if digests.get("results"):
            known.setdefault(digests["input"], {"scene": scene, "digests": {}})["digests"].update(digests["results"])
    DIGESTS.write_text(json.dumps(known, indent=1) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True, type=pathlib.Path, help="folder that CMake built in")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--dataset", type=pathlib.Path, help="folder of a sequence; without it a street is simulated")
    parser.add_argument("--drive", type=pathlib.Path, help="folder of a long drive without labels, for the moving window")
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="few repetitions")
    size.add_argument("--smoke", action="store_true", help="a small scene once: do the programs still work?")
    parser.add_argument("--record-digests", action="store_true", help="take the results as those to compare with from now on")
    options = parser.parse_args()
    out = options.out
    out.mkdir(parents=True, exist_ok=True)
    tessera = options.build / "tessera"
    plan = QUICK if options.quick else SMOKE if options.smoke else FULL
    found = {"circumstances": circumstances()}
    dataset = options.dataset or simulate(tessera, out, options.smoke)
    scene = options.dataset.resolve().name if options.dataset else "simulated street, " + ("16 beams" if options.smoke else "64 beams")
    found["scene"] = {"name": scene, "scans": plan["last"] + 1, "simulated": options.dataset is None,
                      "plan": "quick" if options.quick else "smoke" if options.smoke else "full"}
    parts, differing = {}, []
    for program in sorted((options.build / "bench").glob("bench_*")):
        part, differs = run_program(program, options, plan, dataset, out)
        parts[part["bench"]] = part
        differing += [part["bench"]] if differs else []
    print("memory ...", flush=True)
    parts["memory"] = memory.measure(tessera, dataset, plan["last"], plan["budgets"], out)
    print("worst cases ...", flush=True)
    parts["worst_cases"] = worst.measure(options.build, count_instructions=not options.smoke)
    if plan is FULL:
        print("instructions of each scan ...", flush=True)
        counted = scan_instructions.measure(options.build, dataset, plan["last"], options.drive)
        parts.update({"scan_instructions": counted} if counted else {})
    print("worked example ...", flush=True)
    parts["example"] = example.measure(tessera, out, 2 if options.smoke else example.SCANS)
    found.update(parts)
    found["circumstances"]["load_after"] = os.getloadavg()[0]
    (out / "bench.json").write_text(json.dumps(found, indent=1) + "\n")
    if options.record_digests:
        record(parts, scene)
    if differing:
        fail(f"results differ from those on record ({', '.join(differing)}): if inference was to change, run with --record-digests")
    print(f"figures: {out / 'bench.json'}")


if __name__ == "__main__":
    main()
