# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Calls the command and keeps what it reports: what has been made with the same words and the same program is not made
again."""
import hashlib
import json
import pathlib
import subprocess
import sys


def words_of(options):
    """--kernel-length 0.5 from kernel_length=0.5; True stands for an option without a value."""
    words = []
    for key, value in options.items():
        word = "--" + key.replace("_", "-")
        values = value if isinstance(value, (list, tuple)) else [value]
        words += [word] if value is True else [word, *map(str, values)]
    return words


class Workshop:
    def __init__(self, tessera, out):
        self.tessera, self.out = pathlib.Path(tessera), pathlib.Path(out)
        self.program = hashlib.sha256(self.tessera.read_bytes()).hexdigest()[:16]
        self.out.mkdir(parents=True, exist_ok=True)

    def call(self, *words, may_refuse=False):
        """Its warnings, or None if it refused."""
        done = subprocess.run([str(self.tessera), *map(str, words)], capture_output=True, text=True)
        if done.returncode == 1 and may_refuse:
            return None
        if done.returncode != 0:
            sys.exit(f"run-experiments.sh: tessera {words[0]} stopped: {done.stderr.strip().splitlines()[-1:]}")
        return [line.removeprefix("warning: ") for line in done.stderr.splitlines() if line.startswith("warning: ")]

    def kept(self, name, words, make, program=None):
        """The JSON NAME.json that make() gives, unless these words and this program gave it before."""
        path = self.out / f"{name}.json"
        # Where results lie is no part of how they came about.
        made_by = {"program": program or self.program, "words": [str(word).replace(str(self.out), "OUT") for word in words]}
        if path.exists():
            kept = json.loads(path.read_text())
            if kept["made_by"] == made_by:
                return kept["found"]
        found = make()
        path.write_text(json.dumps({"made_by": made_by, "found": found}) + "\n")
        return found

    def reported(self, *words, may_refuse=False):
        report = self.out / "report.json"
        warnings = self.call(*words, "--report", report, may_refuse=may_refuse)
        if warnings is None:
            return None
        found = json.loads(report.read_text())
        found["warnings"] = warnings
        return found

    def simulate(self, seed, robots, scans, **options):
        """The folders of the robots. They take long to make, and other programs take them as they are: after a change of the
        simulator, OUT has to be another folder."""
        name = "_".join(map(str, ("street", seed, robots, scans, *options)))
        words = ["simulate", "--scene", "street", "--robots", robots, "--scans", scans, "--seed", seed, "--out", self.out / name,
                 *words_of(options)]
        self.kept(f"{name}.simulated", words, lambda: self.reported(*words), program="any")
        return [self.out / name / f"robot_{robot}" for robot in range(robots)]

    def map(self, name, dataset, **options):
        """The map file, and what was reported."""
        path = self.out / f"{name}.tsm"
        words = ["map", "--dataset", dataset, "--out", path, *words_of(options)]
        return path, self.kept(f"{name}.map", words, lambda: self.reported(*words))

    def fuse(self, name, maps, may_refuse=False, **options):
        path = self.out / f"{name}.tsm"
        words = ["fuse", *maps, "--out", path, *words_of(options)]
        return path, self.kept(f"{name}.fuse", words, lambda: self.reported(*words, may_refuse=may_refuse))

    def judge(self, name, path, dataset, **options):
        words = ["eval", "--map", path, "--dataset", dataset, *words_of(options)]
        return self.kept(f"{name}.eval", words, lambda: self.reported(*words))

    def fuse_and_judge(self, name, maps, dataset, fuse=None, judge=None):
        """What fuse and eval reported; the map is not kept. None if the settings were refused."""
        path = self.out / f"{name}.tsm"
        first = ["fuse", *maps, "--out", path, *words_of(fuse or {})]
        second = ["eval", "--map", path, "--dataset", dataset, *words_of(judge or {})]

        def make():
            fused = self.reported(*first, may_refuse=True)
            if fused is None:
                return None
            judged = self.reported(*second)
            path.unlink()
            return {"fuse": fused, "eval": judged}
        return self.kept(f"{name}.fused", [*first, *second], make)
