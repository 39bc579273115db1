# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The commands that the pages show are run, in a folder with what a reader would have; where that cannot be, it is said why.

What a page's commands begin with is made here: scans of a simulated street as PCD files and as datasets, and maps of them.
"""
import contextlib
import os
import pathlib
import re
import shlex
import struct
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMMAND = os.environ["TESSERA_COMMAND"]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]

# Blocks that are run, whole and in their order, in a folder of the page. Nodes hear by multicast: in a network of their own.
RUN = ("README.md", "docs/tasks/map-my-data.md", "docs/tasks/moving-things.md", "docs/tasks/tune.md", "docs/tasks/on-my-robot.md",
       "docs/tasks/yesterdays-map.md", "docs/tasks/merge-maps.md")
# Of which fewer scans would not have enough in common.
ALL_SCANS = ("docs/tasks/merge-maps.md",)
TWO_ROBOTS = "docs/tasks/two-robots.md"
CORRECTIONS = "docs/tasks/slam-corrections.md"
HOURS = "docs/tasks/hours.md"
IN_OWN_NETWORK = (TWO_ROBOTS, CORRECTIONS, HOURS)
# Lines that call tessera are run one by one, in blocks or set in by four.
RUN_LINES = ("docs/reference/cli.md", "docs/reference/network.md", "docs/measured/choices.md", "docs/measured/timing.md")
# What runs all that these show.
RUN_BY_OTHERS = {"docs/reference/formats.md": "cli_formats_page", "docs/reference/python.md": "python_docs and python_install"}
# Commands of these pages that are not run here, each with the reason. Each must be there.
NOT_RUN = {
    "./examples/run-demo.sh [OUT]": "builds; cli_mission runs what it shows",
    "./tests/run-tests.sh": "is what runs this",
    "./bench/run-bench.sh [--quick]": "minutes; bench has its own tests",
    "build/release/bench/frames --dataset ../shared/data/semantickitti_08 --refinement --max-range 18": "recorded data; by hand",
    "valgrind --tool=callgrind --instr-atstart=no build/release/bench/frames --dataset ../shared/data/semantickitti_08 --refinement --max-range 18":
        "recorded data; by hand",
    "./tests/install-packages.sh demo": "needs root; gate_packages reads it",
    "cmake --preset release -DTESSERA_BUILD_TESTS=OFF -DTESSERA_BUILD_BENCH=OFF": "would change this build",
    "cmake --build --preset release --target tessera_cli": "has been done",
    "tessera doctor --interface eth0": "asks for an interface of the reader's",
    "tessera node --check --config robot.toml": "a configuration of the reader's; two-robots runs nodes",
    # Of the other pages.
    "./bench/run-bench.sh": "bench_smoke; figures are made by it",
    "./bench/run-bench.sh --write-docs": "would change this page; bench_smoke",
    "./bench/experiments/run-experiments.sh": "an hour; experiments_smoke",
    "./bench/experiments/run-experiments.sh --quick": "minutes; experiments_smoke",
    "./bench/experiments/run-experiments.sh --write-docs": "would change this page; experiments_smoke",
    "python3 -B bench/alignment/alignment.py --tessera build/release/tessera --data ../shared/data --out OUT [--trials N] [--rows NAME...] [--write-docs]":
        "an hour; alignment_bench",
    "./bench/onboard/run-onboard.sh [--write-docs] [SECONDS [OUT]]": "minutes on an idle machine",
    "bench/worst.py --build build/release [--check | --record]": "gate_worst_cases",
    "./tests/fuzz/run-fuzz.sh": "minutes; test_fuzz_corpus runs what it found",
    "./tests/fuzz/run-fuzz.sh 620 exchange wire": "minutes",
    "./tests/fuzz/run-fuzz.sh merge": "would change the corpus",
    "build/release/tests/network/test_network_hostile": "is a test",
    "sudo modprobe vcan && sudo ip link add can0 type vcan && sudo ip link set can0 mtu 72 up": "a bus is in a kernel with one only; tests of socketcan",
    "candump can0": "a bus",
    "cansend can0 108#0000000000000000": "a bus",
    "cangen can0 -g 0 -I 102 -L 8": "a bus",
    "tessera play --dataset street/robot_0 --messages raw --poses can --can can0": "a bus",
    'cansend can0 20000040#0000000000000000': "a bus",
    "cmake --build --preset release": "has been done",
    "(cd build/release && cpack -G DEB)": "install_packages",
    "sudo apt install ./build/release/*.deb": "install_packages",
    "sudo cmake --install build/release --prefix /usr/local": "install_prefix",
    "c++ -std=c++20 $(pkg-config --cflags tessera) robot.cpp $(pkg-config --libs tessera) -o robot": "install_prefix",
    "sudo adduser --system --group tessera": "needs root; install_packages makes the user as the package does",
    "sudo install -d /etc/tessera && sudo install -m 0644 scout.toml /etc/tessera/scout.toml": "needs root",
    "sudo install -o tessera -m 0400 fleet.key robot_3.key /etc/tessera": "needs root",
    "sudo install -m 0644 fleet.pub /etc/tessera": "needs root",
    "sudo sysctl -w net.core.rmem_max=8388608": "needs root",
    "sudo systemctl enable --now tessera-node@scout": "needs root; cli_service_unit reads the unit",
    "journalctl -u tessera-node@scout -f": "needs the unit",
    "tessera view MAP.tsm [...] [--listen 127.0.0.1:8080] [--everywhere] [--session MAP.tsm] [--transform MAP.tsm=T.txt]": "a synopsis; view_http",
    "tessera view map.tsm": "until it is ended; view_http, view_browser",
    "tessera align a.tsm b.tsm --out T_a_b.txt --png both.png": "maps of the reader's; cli_align",
    "tessera fuse a.tsm b.tsm --align --out global.tsm": "maps of the reader's; cli_align",
    "tessera view global.tsm robot_0.tsm robot_1.tsm": "until it is ended; view_http, view_browser",
    "tessera node --config robot_0.toml": "until it is ended; cli_node, and two-robots runs nodes",
    "tessera node --config sensors.toml": "until it is ended; cli_node_restart kills nodes and starts them again",
    "tessera play --dataset drive/robot_0 --rate 10 --robot 1 --loop": "until it is ended; cli_play",
    "tessera node --config robot_0.toml --check": "cli_node_config",
    "tessera node --config robot_0.toml --reload": "needs a node that runs; cli_reload",
    "build/release/tests/laws/test_integration_property": "is a test",
    "TESSERA_PROPERTY_CASES=1000000 TESSERA_PROPERTY_SEED=20 build/release/tests/laws/test_integration_property": "minutes; the test itself has fewer cases",
    "tessera play --dataset street/robot_0 --messages raw": "needs a network; cli_play, cli_sensing",
    "tessera doctor --interface eth0 --key fleet.key": "its answer is of the machine; cli_doctor",
    'tessera doctor --interface lo --url "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"': "its answer is of the machine; cli_doctor",
}


def blocks(page):
    text = page.read_text()
    return [re.sub(r"^ {0,3}", "", body, flags=re.M) for body in re.findall(r"^ *```sh\n(.*?)^ *```", text, re.M | re.S)]


def shown(page):
    """Every line that calls tessera: of blocks, and of lines that are set in by four."""
    text = page.read_text().replace("\\\n", " ")
    for line in "\n".join([*blocks(page), *re.findall(r"^    (.*)$", text, re.M)]).splitlines():
        match = re.match(r"(?:build/release/)?tessera +(\w.*)$", line.strip())
        if match:
            yield match[1]


def pcd_of(scan):
    points = list(struct.iter_unpack("<4f", scan.read_bytes()))[::20]
    head = f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(points)}\nHEIGHT 1\nPOINTS {len(points)}\nDATA ascii\n"
    return head + "".join(f"{x} {y} {z}\n" for x, y, z, _ in points)


def without_comment(line):
    return line.partition("  #")[0].partition(" # ")[0].strip()


def few_scans(script):
    return re.sub(r"--scans \d+", "--scans 2", script)


def run(folder, script, within=()):
    return subprocess.run([*within, "bash", "-c", script], cwd=folder, text=True, capture_output=True, timeout=240, check=False,
                          stdin=subprocess.DEVNULL, env={**os.environ, "PATH": f"{folder}/build/release:{os.environ['PATH']}"})


def run_page(test, name, folder, within=()):
    """Its blocks as one script; what it prints."""
    script = "\n".join(line for block in blocks(ROOT / name) for line in block.splitlines() if without_comment(line) not in NOT_RUN)
    script = "set -euo pipefail\n" + (script if name in ALL_SCANS else few_scans(script))
    result = run(folder, script, within)
    test.assertEqual(0, result.returncode, f"{script}\n{result.stdout}{result.stderr}")
    for out in re.findall(r"--out (\S+\.(?:png|tsm|ply))", script):
        test.assertGreater((folder / out).stat().st_size, 100, out)
    return result.stdout


@contextlib.contextmanager
def folder_of_reader():
    """With the command where it is built, and scans as PCD files with their poses."""
    with tempfile.TemporaryDirectory(prefix="tessera-docs-") as made:
        folder = pathlib.Path(made)
        (folder / "build/release").mkdir(parents=True)
        (folder / "build/release/tessera").symlink_to(COMMAND)
        subprocess.run([COMMAND, "simulate", "--robots", "2", "--scans", "2", "--out", folder / "made"], check=True, capture_output=True)
        (folder / "scans").mkdir()
        for scan in sorted((folder / "made/robot_0/velodyne").iterdir()):
            (folder / "scans" / f"{scan.stem}.pcd").write_text(pcd_of(scan))
        (folder / "poses.txt").write_text((folder / "made/robot_0/poses.txt").read_text())
        yield folder


def make_files(folder):
    """What the reference's examples have from elsewhere: datasets by their names, maps of two robots, points."""
    for name in ("semantickitti_08", "kitti_raw_0013"):
        (folder / name).symlink_to(folder / "made/robot_0")
    for robot in (0, 1):
        subprocess.run([COMMAND, "map", "--dataset", f"made/robot_{robot}", "--robot", str(robot), "--resolution", "0.2", "--out",
                        f"robot_{robot}.tsm"], cwd=folder, check=True, capture_output=True)
    (folder / "T.txt").write_text((folder / "made/robot_1/T_global_map.txt").read_text())
    (folder / "points.csv").write_text("x,y,z\n1,2,0.5\n-3,0,1\n")


class Commands(unittest.TestCase):
    def test_options_that_are_shown_exist(self):
        helps, seen = {}, 0
        for page in PAGES:
            for line in shown(page):
                with self.subTest(page=page.name, line=line):
                    words = shlex.split(line, comments=True)
                    subcommand = words[:2] if words[0] == "key" else words[:1]
                    if words[0].isupper() or words[0] in ("X", "is"):
                        continue
                    if tuple(subcommand) not in helps:
                        result = subprocess.run([COMMAND, *subcommand, "--help"], text=True, capture_output=True, check=False)
                        self.assertEqual(0, result.returncode, result.stderr)
                        helps[tuple(subcommand)] = set(re.findall(r"--[a-z][\w-]*", result.stdout))
                    for word in words:
                        if word.startswith("--"):
                            self.assertIn(word.partition("=")[0], helps[tuple(subcommand)])
                    seen += 1
        self.assertGreater(seen, 20)

    def test_what_is_shown_is_run_or_said_why_not(self):
        seen = set()
        for page in PAGES:
            name = str(page.relative_to(ROOT))
            lines = {without_comment(line) for block in blocks(page) for line in block.splitlines()}
            lines |= {"tessera " + without_comment(line) for line in shown(page)}
            seen |= lines
            if name in (*RUN, *IN_OWN_NETWORK):
                outside = re.sub(r"^ *```.*?^ *```", "", page.read_text(), flags=re.M | re.S)
                self.assertEqual([], re.findall(r"^    tessera .*", outside, re.M), f"{name}: only blocks are run")
            if name in (*RUN, *IN_OWN_NETWORK, *RUN_BY_OTHERS):
                continue
            for line in sorted(lines - {""}):
                with self.subTest(page=name, line=line):
                    self.assertTrue(line in NOT_RUN or (name in RUN_LINES and line.startswith("tessera ")), "is run by no test")
        self.assertEqual(set(), set(NOT_RUN) - seen, "is not shown any more")

    def test_task_pages_run(self):
        for name in RUN:
            with self.subTest(name), folder_of_reader() as folder:
                run_page(self, name, folder)

    def test_commands_of_reference_pages_run(self):
        for name in RUN_LINES:
            with folder_of_reader() as folder:
                make_files(folder)
                for line in dict.fromkeys("tessera " + without_comment(line) for line in shown(ROOT / name)):
                    if line in NOT_RUN:
                        continue
                    with self.subTest(page=name, line=line):
                        result = run(folder, few_scans(line))
                        self.assertEqual(0, result.returncode, result.stderr)
                        for out in re.findall(r"--(?:out|report) (\S+\.\w+)", line):
                            self.assertGreater((folder / out).stat().st_size, 10, out)


class InOwnNetwork(unittest.TestCase):
    def output_of(self, page):
        own = [str(ROOT / "tests/in-own-network.sh")]
        if subprocess.run([*own, "true"], capture_output=True, check=False).returncode != 0:
            self.skipTest("skipped: no network namespaces")
        with folder_of_reader() as folder:
            return run_page(self, page, folder, own)

    def test_corrections_of_a_node(self):
        self.assertIn("submaps", self.output_of(CORRECTIONS))

    def test_hours_and_kilometres(self):
        output = self.output_of(HOURS)
        digests = re.findall(r"^ +digest +(\w+)$", output, re.M)
        # In ample memory, and as read from its file; with a window, of map and of what the node has saved.
        self.assertEqual(4, len(digests), output)
        self.assertEqual(1, len(set(digests)), output)

    def test_two_robots(self):
        output = self.output_of(TWO_ROBOTS)
        digests = re.findall(r"^ +digest +(\w+)$", output, re.M)
        self.assertEqual(2, len(digests))
        self.assertEqual(digests[0], digests[1])


if __name__ == "__main__":
    unittest.main()
