#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""view_bench.py COMMAND [OUT]: what the page takes on this machine, drawn in software by headless Chromium.

A simulated street of more than 500,000 occupied voxels: from the start of navigation to the first picture and to the whole one,
medians of 5; frames a second while it turns. A node of 10 scans a second for a minute, without a view, with one that nobody
looks at, and with a page that follows it: cycles missed, and voxels that came a second. Writes OUT/view_bench.json and view.png.
Needs what tests/install-packages.sh bench installs. [out/view]
"""
import json
import pathlib
import re
import signal
import statistics
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent.parent / "tests/view"))
from browser import Browser

RUNS = 5
NODE_S = 60
URL = re.compile(r"http://\S+/")
ORBIT = """
const [done] = [arguments[arguments.length - 1]];
const canvas = document.getElementById('canvas');
const began = performance.now();
const frames = Number(canvas.dataset.frames);
function turn() {
  canvas.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft' }));
  if (performance.now() - began < 5000) requestAnimationFrame(turn);
  else done(1000 * (Number(canvas.dataset.frames) - frames) / (performance.now() - began));
}
requestAnimationFrame(turn);
"""
NODE = """[robot]
id = 0
state = "state"
[replay]
dataset = "street/robot_0"
rate_hz = 10
loop = true
[map]
resolution_m = 0.2
max_range_m = 30.0
memory = "128M"
deadline_ms = 50
[network]
url = "udpm://239.255.76.67:7673?ttl=0&recv_buf_size=400000"
interface = "lo"
[fusion]
memory = "128M"
[realtime]
priority = 40
lock_memory = true
[output]
report = "node.json"
[run]
duration_s = {seconds}
{service}
"""


def make_map(command, folder):
    run = lambda *words: subprocess.run([command, *map(str, words)], cwd=folder, check=True, capture_output=True, text=True)  # noqa: E731
    run("simulate", "--robots", 1, "--scans", 14, "--seed", 3, "--out", "street")
    run("map", "--dataset", "street/robot_0", "--out", "map.tsm", "--resolution", 0.1, "--max-range", 60, "--memory", "1G")


def pictures(command, folder):
    server = subprocess.Popen([command, "view", "map.tsm", "--listen", "127.0.0.1:0"], cwd=folder, stdout=subprocess.PIPE, text=True)
    first, whole, rates = [], [], []
    try:
        url = URL.search(server.stdout.readline()).group(0)
        for _ in range(RUNS):
            browser = Browser(dark=True)
            browser.open(url)
            marks = browser.until(lambda b=browser: (m := dict(b.run("return performance.getEntriesByType('mark').map(m => [m.name, m.startTime])"))) and len(m) == 2 and m,
                                  "both marks")
            first.append(marks["first-picture"])
            whole.append(marks["whole-picture"])
            voxels = int(browser.data("voxels"))
            browser.driver.set_script_timeout(60)
            rates.append(browser.driver.execute_async_script(ORBIT))
            if len(first) == RUNS:
                browser.open(url + "#layer=class")
                browser.run("const c = document.getElementById('canvas'); for (let i = 0; i < 8; ++i) c.dispatchEvent(new KeyboardEvent('keydown', { key: '+' }))")
                browser.settle()
                browser.click(500, 400)
                time.sleep(1.5)
                browser.driver.save_screenshot(str(folder / "view.png"))
            browser.close()
    finally:
        server.send_signal(signal.SIGTERM)
        server.wait()
    return {"voxels": voxels, "first_picture_ms": statistics.median(first), "whole_picture_ms": statistics.median(whole),
            "frames_per_s": statistics.median(rates), "runs": {"first_picture_ms": first, "whole_picture_ms": whole, "frames_per_s": rates}}


def node(command, folder, view, follow):
    service = '[service]\nview = "127.0.0.1:0"' if view else ""
    (folder / "node.toml").write_text(NODE.format(seconds=NODE_S, service=service))
    process = subprocess.Popen([command, "node", "--config", "node.toml"], cwd=folder, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    came = None
    if follow:
        url = URL.search(next(line for line in process.stderr if "shown at" in line)).group(0)
        browser = Browser(dark=True)
        browser.driver.get(url)
        browser.until(lambda: int(browser.data("received") or 0) > 0, "voxels")
        time.sleep(5)
        before, began = int(browser.data("received")), time.monotonic()
        time.sleep(30)
        came = (int(browser.data("received")) - before) / (time.monotonic() - began)
        browser.close()
    process.communicate()
    report = json.loads((folder / "node.json").read_text())
    times = report["mapping"]["cycle_times"]
    return {"view": view, "followed": follow, "voxels_per_s": came, "cycles": report["mapping"]["cycles"], "missed": report["mapping"]["missed"],
            "median_ms": times["median_ms"], "p99_ms": times["p99_ms"], "max_ms": times["max_ms"], "cpu_seconds": report["cpu_seconds"],
            "heap_allocations_after_start": report["heap_allocations_after_start"], "served": report.get("view")}


def main():
    command = str(pathlib.Path(sys.argv[1]).resolve())
    folder = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else "out/view").resolve()
    folder.mkdir(parents=True, exist_ok=True)
    make_map(command, folder)
    result = {"pictures": pictures(command, folder), "node": [node(command, folder, *how) for how in ((False, False), (True, False), (True, True))]}
    (folder / "view_bench.json").write_text(json.dumps(result, indent=1) + "\n")
    p = result["pictures"]
    print(f"{p['voxels']} voxels: first picture {p['first_picture_ms']:.0f} ms, whole picture {p['whole_picture_ms']:.0f} ms, {p['frames_per_s']:.0f} frames/s while it turns")
    for n in result["node"]:
        how = "no view" if not n["view"] else "nobody looks" if not n["followed"] else f"a page follows, {n['voxels_per_s']:.0f} voxels/s"
        print(f"node, {how}: {n['cycles']} cycles, {n['missed']} missed, median {n['median_ms']:.1f} ms, p99 {n['p99_ms']:.1f} ms, max {n['max_ms']:.1f} ms")


main()
