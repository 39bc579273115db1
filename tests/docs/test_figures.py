# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of the pages against the program: sizes and defaults as compiled (TESSERA_FIGURES prints them), and names of constants
where the pages say that they stand.

A number on a page is right if the program's rounds to it: 2.8 kB is anything from 2.75 to 2.85 kB.
"""
import os
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
UNITS = {"": 1, "B": 1, "bytes": 1, "kB": 1e3, "MB": 1e6, "KiB": 2**10, "MiB": 2**20, "GiB": 2**30}
NUMBER = re.compile(r"([0-9][0-9,.]*[0-9]|[0-9]) ?(kB|MB|KiB|MiB|GiB|bytes|B)?")


def figures():
    """{name: value}"""
    lines = subprocess.run([os.environ["TESSERA_FIGURES"]], check=True, text=True, capture_output=True).stdout.splitlines()
    return {name: float(value) for name, _, value in (line.rpartition(" ") for line in lines)}


def stated(text):
    """The number in the text and half of its last digit."""
    digits, unit = NUMBER.match(text.strip()).groups()
    digits = digits.replace(",", "")
    unit = UNITS[unit or ""]
    return float(digits) * unit, 0.5 * unit * 10.0 ** -len(digits.partition(".")[2])


def rows(text, heading):
    """The cells of the rows of the table whose first line begins so."""
    lines = text[text.index(heading):].splitlines()
    cells = []
    for line in lines[2:]:
        if not line.startswith("|"):
            break
        cells.append([cell.strip() for cell in line.strip("|").split("|")])
    return cells


def rounded_up(n, unit=64):
    return (n + unit - 1) // unit * unit


class PageCase(unittest.TestCase):
    page = ""

    @classmethod
    def setUpClass(cls):
        cls.is_ = figures()
        cls.text = (ROOT / "docs" / cls.page).read_text()
        cls.line = " ".join(cls.text.split())

    def check(self, text, value):
        number, precision = stated(text)
        self.assertLessEqual(abs(number - value), max(precision, 1e-9 * value), (text, value))

    def says(self, sentence, *values):
        """The page has the sentence, with a number for each {}."""
        pattern = re.escape(" ".join(sentence.split())).replace(r"\{\}", r"([0-9][0-9,.]*(?: (?:kB|MB|KiB|MiB|GiB|bytes)\b)?)")
        found = re.search(pattern, self.line)
        self.assertIsNotNone(found, sentence)
        for text, value in zip(found.groups(), values, strict=True):
            with self.subTest(sentence, text=text):
                self.check(text, value)


class Memory(PageCase):
    page = "reference/memory.md"

    def test_objects(self):
        f = self.is_
        self.says("`kArenaAlignment` ({})", f["kArenaAlignment"])
        self.says("`LocalMap` {}, `Integrator` {}; for saving and loading a `MapFileBuffer`, {}", f["sizeof LocalMap"],
                  f["sizeof Integrator"], f["sizeof MapFileBuffer"])
        self.says("Robot + Mapper + Sharer {}", f["robot"])
        self.says("is larger by {} plus the size of one stored block ({} with 19 classes)", f["tessera_robot"], f["stored block"])
        self.says("a reader takes {} (`MapReader`) or {} (`GlobalReader`), a `tessera_reader` {}", f["sizeof MapReader"],
                  f["sizeof GlobalReader"], f["sizeof tessera_reader"])
        self.says("a workspace of {} for each block", 2 * f["sizeof KeyedIndex"])
        self.says("`GlobalMap` itself takes {}, a `GlobalReader` {}", f["sizeof GlobalMap"], f["sizeof GlobalReader"])

    def test_budgets(self):
        table = rows(self.text, "| budget | S |")
        self.assertEqual(8, len(table))
        for budget, storage, index, required, blocks, compact, dense in table:
            with self.subTest(budget):
                name = f"budget {int(stated(budget)[0]) >> 20} "
                pages = int(self.is_[name + "S"]) // 4096
                self.check(storage, self.is_[name + "S"])
                self.check(required, self.is_[name + "required"])
                self.check(index, self.is_[name + "required"] - self.is_[name + "S"])
                self.check(blocks, self.is_[name + "blocks"])
                self.check(compact, pages * (4096 // int(self.is_["octet of compact tuples"])))
                self.check(dense, pages * (4096 // int(self.is_["octet of dense tuples"])))
                # The formulas above it.
                most = int(self.is_[name + "S"]) // 192 + 1
                leaves = most // 384 + 1
                self.check(blocks, most)
                self.check(required, rounded_up(12 * leaves) + 4096 * leaves + 4096 * pages)

    def test_parts(self):
        table = rows(self.text, "| part | bytes | in a page")
        self.assertEqual(6, len(table))
        for part, size, in_page, _ in table[:4]:
            with self.subTest(part):
                self.check(size, self.is_[part])
                self.check(in_page, 4096 // int(self.is_[part]))
        self.assertEqual("32 + 32 (C + 1); C = 19: 672", table[4][1])
        self.assertEqual(32 + 32 * (19 + 1), self.is_["octet of dense tuples"])
        self.says("So a label voxel costs {} (compact, all eight of its octet observed) or {} (dense, C = 19)",
                  self.is_["octet of compact tuples"] / 8, 4096 / (4096 // self.is_["octet of dense tuples"]) / 8)

    def test_scans_are_those_of_the_benchmarks(self):
        table = rows((ROOT / "docs/measured/benchmarks.md").read_text(), "|  | `--memory` | scratch, MB")
        whole = {(row[0], row[1]): row for row in table}
        compact = whole["multi-entropy", "512M"]
        self.says("{} label voxels in", float(compact[4].replace(",", "")))
        self.says("with any budget: {} bytes a label voxel", float(compact[6]))
        self.says("- dense: {} bytes a label voxel", float(whole["multi-entropy, dense counts", "512M"][6]))
        free = whole["multi-entropy, free space", "512M"]
        self.says("with free space: {} more voxels, {} bytes each", float(free[5].replace(",", "")), float(free[7]))

    def test_scratch(self):
        table = rows(self.text, "| P, T, R | without")
        self.assertEqual(4, len(table))
        images = self.is_["images"]
        for capacity, without, by_image, by_rays in table:
            with self.subTest(capacity):
                p, t, r = (int(n) for n in re.findall("[0-9]+", capacity))
                name = f"scratch {p} "
                self.check(without, self.is_[name + "without"])
                self.check(by_image, self.is_[name + "image"])
                self.check(by_rays, self.is_[name + "rays"])
                # The formula above it.
                points = 2 * rounded_up(36 * p) + rounded_up(32 * p) + rounded_up(24 * p) + rounded_up(16 * p)
                labels = points + 64 * (t // 4 + 2) + rounded_up(104 * t) + 2112 + 95808
                blocks = 64 * (r // 4 + 2) + rounded_up(152 * r) + 16384
                rays = rounded_up(4 * (r + 1)) + 884736
                self.assertEqual(self.is_[name + "without"], labels)
                self.assertEqual(self.is_[name + "image"], labels + blocks + images)
                self.assertEqual(self.is_[name + "rays"], labels + blocks + rays)
                self.assertEqual(self.is_[name + "kernel"], labels - 95808 + 657408)
        for number in ("2112", "95808", "657408", "884736", f"{images:.0f}"):
            self.assertIn(number, self.text)
        self.assertIn(f"{self.is_['scratch default']:.0f}, {self.is_['scratch default tiles']:.0f}, "
                      f"{self.is_['scratch default rays']:.0f} (the default)", self.text)

    def test_what_memory_is_divided_into(self):
        table = rows(self.text, "| --memory | free space |")
        self.assertEqual(7, len(table))
        self.says("With scans of {} returns", 123433)
        for memory, free_space, points, tiles, scratch, storage in table:
            with self.subTest(memory, free_space=free_space):
                number, unit = re.match("([0-9]+)([MG])", memory).groups()
                name = f"memory {int(number) << (10 if unit == 'G' else 0)} {free_space} "
                self.check(points, self.is_[name + "points"])
                self.check(tiles, self.is_[name + "tiles"])
                self.assertEqual(self.is_[name + "tiles"], self.is_[name + "rays"])
                self.check(scratch, self.is_[name + "scratch"])
                self.check(storage, self.is_[name + "S"])

    def test_sensors(self):
        self.assertEqual(2, self.is_["projector cell"])
        self.says("120,000 points and six cameras of 1280 x 800 pixels take {}", self.is_["projector"])
        self.says("= a({} P) + a(4 P) + a(P)", self.is_["projector a point"] - 5)
        self.says("= a({} N)", self.is_["pose"])
        self.says("= a({} ceil(W / s) ceil(H / s))", self.is_["depth pixel"])

    def test_window(self):
        limits = {row[1].strip("`"): row[2] for row in rows(self.text, "| limit a step | member")}
        self.assertEqual(6, len(limits))
        for member, limit in limits.items():
            with self.subTest(member):
                self.check(limit, self.is_[member])
        self.says("with the defaults and v = 512, all of a block, that is {}",
                  min(self.is_["evictions_per_step"], self.is_["label_voxels_per_step"] / 512))
        self.says("It has an index in memory, {} a block", self.is_["archived block"])
        self.says("a map for one block and two blocks in bytes: {} to {}", self.is_["archive least"], self.is_["archive most"])
        self.says("`EvictionQueue` takes {} for each block of the index, and {}", self.is_["evicted block"], self.is_["evictions"])

    def test_the_global_map(self):
        f = self.is_
        self.says("+ {} segments + {} blocks + {} contributions", f["segment"], f["replica"], f["contribution"])
        self.says("+ {} sum_segments", f["sum segment"])
        self.says("+ {} blocks of the grid", f["global block"])
        self.says("most_packed_bytes + {}", f["global rest"])
        self.says("{} for four iterations of 0.2 m at 0.1 m and C = 19, {} for four of 0.3 m", f["brick 0.2"], f["brick 0.3"])
        self.says("one content more, and {} for 512 voxels", f["share"])
        self.says("of all robots together, up to {}", f["contributions"])

    def test_exchange(self):
        self.says("With the defaults and 19 classes they are {}, most of it for 64 contributions, and {}", self.is_["exchange"],
                  self.is_["publisher"])
        self.says("beyond 64 takes {}, so `Exchange` has {} with the 4096 of a node", self.is_["exchange contribution"],
                  self.is_["exchange of a node"])


class ExchangePage(PageCase):
    page = "design/exchange.md"

    def test_memory(self):
        self.says("A place for a contribution takes {}, with its first 64 buckets", self.is_["exchange contribution"])
        self.says("two contents of a block: {} with the defaults and 19 classes", self.is_["publisher"])


class Theory(PageCase):
    page = "design/theory.md"

    def test_defaults(self):
        table = [row for row in rows(self.text, "| constant | default |") if row[2].strip("`") in self.is_]
        self.assertEqual(20, len(table))
        for constant, default, member, _ in table:
            with self.subTest(constant):
                power = re.match(r"2\^(-\d+)$", default)
                value = self.is_[member.strip("`")]
                self.assertAlmostEqual(2.0 ** int(power.group(1)) if power else stated(default)[0], value, delta=1e-6 * value)

    def test_options(self):
        options = {row[3].strip("`") for row in rows(self.text, "| constant | default |")} - {"-"}
        known = subprocess.run([os.environ["TESSERA_COMMAND"], "map", "--help"], check=True, text=True, capture_output=True).stdout
        self.assertGreater(len(options), 10)
        self.assertEqual([], sorted(option for option in options if f"{option} " not in known))


class Limits(PageCase):
    page = "reference/limits.md"

    def test_what_sets_a_limit_is_where_the_page_says(self):
        named = re.findall(r"`((?:platform|lib)?[a-z_/]+\.[chp]+)`((?:,? `\w+(?:::\w+)?`)*)", self.text)
        self.assertGreater(len(named), 50)
        for path, names in named:
            file = ROOT / path if path.startswith(("platform/", "lib/")) else ROOT / "lib/include/tessera" / path
            with self.subTest(path):
                code = file.read_text()
                for name in re.findall(r"`(?:\w+::)?(\w+)`", names):
                    self.assertRegex(code, rf"\b{name}\b")


if __name__ == "__main__":
    unittest.main()
