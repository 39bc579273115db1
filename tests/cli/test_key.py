# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""tessera key new and tessera key mission."""
import json
import os
import stat
import unittest

from command_case import CommandCase, crc32c


class Key(CommandCase):
    def lines(self, name):
        """The words of each line that says something; its checksum is held."""
        lines = [line for line in (self.folder / name).read_text().splitlines() if line and not line.startswith("#")]
        parted = [line.rsplit(" ", 1) for line in lines]
        for text, check in parted:
            self.assertEqual(f"{crc32c(text.encode()):08x}", check)
        return [text.split() for text, _ in parted]

    def words(self, name):
        """Of the one line that says something."""
        lines = self.lines(name)
        self.assertEqual(1, len(lines))
        return lines[0]

    def mission(self, name="fleet.key"):
        return " ".join(self.lines(name)[1][2:])

    def mode(self, name):
        return stat.S_IMODE((self.folder / name).stat().st_mode)

    def test_a_fleet_key(self):
        before = os.umask(0)
        self.addCleanup(os.umask, before)
        result = self.done("key", "new", "--fleet", "fleet.key", "--without-signatures", "--report", "report.json")
        (kind, version, key), mission = self.lines("fleet.key")
        self.assertEqual(("tessera-fleet-key", "1", 64), (kind, version, len(key)))
        self.assertEqual(["tessera-mission", "1"], mission[:2])
        self.assertRegex(mission[2], "^mission-[0-9a-f]{10}$")
        self.assertEqual(0o600, self.mode("fleet.key"))
        self.assertEqual("", result.stderr)
        report = (self.folder / "report.json").read_text()
        self.assertEqual((["fleet.key"], mission[2]), (json.loads(report)["files"], json.loads(report)["mission"]))
        for text in (result.stdout, result.stderr, report):
            self.assertNotIn(key, text)

    def test_a_fleet_key_alone_is_warned_about_as_it_signs_nothing(self):
        self.assertIn("warning: with this key alone nothing is signed", self.done("key", "new", "--fleet", "fleet.key").stderr)

    def test_a_fleet_that_signs_in_one_command(self):
        before = os.umask(0o022)
        self.addCleanup(os.umask, before)
        result = self.done("key", "new", "--robots", 3, "--dir", "keys", "--report", "report.json")
        names = ["fleet.key", *(f"robot_{robot}.{kind}" for robot in range(3) for kind in ("key", "pub")), "fleet.pub"]
        self.assertEqual([f"keys/{name}" for name in names], json.loads((self.folder / "report.json").read_text())["files"])
        self.assertEqual(sorted(names), sorted(path.name for path in (self.folder / "keys").iterdir()))
        self.assertEqual([self.words(f"keys/robot_{robot}.pub") for robot in range(3)], self.lines("keys/fleet.pub"))
        self.assertEqual({0o600}, {self.mode(f"keys/{name}") for name in names if name.endswith(".key")})
        self.assertEqual({0o644}, {self.mode(f"keys/{name}") for name in names if name.endswith(".pub")})
        self.assertEqual(7, len({line[-1] for name in names[:-1] for line in self.lines(f"keys/{name}")[:1]}))
        for name in names:
            if name.endswith(".key"):
                self.assertNotIn(self.lines(f"keys/{name}")[0][-1], result.stdout + result.stderr)

    def test_a_fleet_without_signatures(self):
        self.done("key", "new", "--robots", 3, "--dir", "keys", "--without-signatures")
        self.done("key", "new", "--dir", "more", "--without-signatures")
        self.assertEqual(["fleet.key"], [path.name for path in (self.folder / "keys").iterdir()])
        self.assertEqual(["fleet.key"], [path.name for path in (self.folder / "more").iterdir()])

    def test_a_mission_is_named_and_all_else_in_the_file_stays(self):
        self.done("key", "new", "--robots", 1, "--dir", "keys")
        key, before = self.lines("keys/fleet.key")[0], self.mission("keys/fleet.key")
        self.done("key", "mission", "harbour 7", "--fleet", "keys/fleet.key", "--report", "report.json")
        self.assertEqual("harbour 7", self.mission("keys/fleet.key"))
        self.assertEqual("harbour 7", json.loads((self.folder / "report.json").read_text())["mission"])
        result = self.done("key", "mission", "--new", "--fleet", "keys/fleet.key")
        after = self.mission("keys/fleet.key")
        self.assertRegex(after, "^mission-[0-9a-f]{10}$")
        self.assertNotEqual(before, after)
        self.assertIn(after, result.stdout)
        self.assertEqual(key, self.lines("keys/fleet.key")[0])
        self.assertEqual(0o600, self.mode("keys/fleet.key"))
        self.assertNotIn(key[2], result.stdout + result.stderr)

    def test_a_mission_is_added_to_a_key_of_version_0_1_0(self):
        self.done("key", "new", "--fleet", "fleet.key", "--without-signatures")
        path = self.folder / "fleet.key"
        path.write_text("".join(line for line in path.read_text().splitlines(True) if not line.startswith("tessera-mission")))
        self.assertEqual(1, len(self.lines("fleet.key")))
        self.done("key", "mission", "x" * 64)  # fleet.key is the default.
        self.assertEqual("x" * 64, self.mission())

    def test_bad_missions(self):
        self.done("key", "new", "--robots", 1, "--dir", "keys")
        fleet = self.folder / "keys/fleet.key"
        before = fleet.read_bytes()
        for words, said in (((), "a name or --new"), (("",), "a name or --new"), (("m", "--new"), "a name or --new"), (("x" * 65,), "over 64"),
                            (("a\nb",), "control character"), ((" a",), "space")):
            self.refused("key", "mission", *words, "--fleet", fleet, saying=(said,))
        self.refused("key", "mission", "m", saying=("fleet.key",))
        self.refused("key", "mission", "m", "--fleet", "keys/robot_0.key", saying=("another kind",))
        self.refused("key", "mission", "m", "--fleet", fleet, "--report", fleet, saying=("--report",))
        self.assertEqual(before, fleet.read_bytes())
        fleet.chmod(0o644)
        self.refused("key", "mission", "m", "--fleet", fleet, saying=("chmod 600",))
        self.assertEqual(before, fleet.read_bytes())

    def test_a_pair_for_a_robot(self):
        self.done("key", "new", "--robot", 3, "--dir", ".")
        self.assertEqual(["tessera-robot-secret", "1", "3"], self.words("robot_3.key")[:3])
        self.assertEqual(["tessera-robot-public", "1", "3"], self.words("robot_3.pub")[:3])
        self.assertEqual(0o600, self.mode("robot_3.key"))
        self.assertEqual(0, self.mode("robot_3.pub") & 0o022)

    def test_the_folder_is_made(self):
        self.done("key", "new", "--robot", 3, "--dir", "keys")
        self.done("key", "new", "--robot", 4, "--dir", "keys")
        self.assertEqual(0o700, self.mode("keys"))
        self.assertEqual(4, len(list((self.folder / "keys").iterdir())))

    def test_nothing_is_replaced(self):
        self.done("key", "new", "--fleet", "fleet.key")
        before = (self.folder / "fleet.key").read_bytes()
        self.refused("key", "new", "--fleet", "fleet.key", saying=("not replaced",))
        self.assertEqual(before, (self.folder / "fleet.key").read_bytes())
        (self.folder / "robot_3.key").write_text("mine")
        self.refused("key", "new", "--robot", 3, "--dir", ".", saying=("not replaced",))
        self.assertEqual("mine", (self.folder / "robot_3.key").read_text())
        self.assertFalse((self.folder / "robot_3.pub").exists())
        (self.folder / "robot_1.pub").write_text("mine")
        self.refused("key", "new", "--robots", 3, "--dir", ".", saying=("not replaced",))
        self.assertEqual({"fleet.key", "robot_3.key", "robot_1.pub"}, {path.name for path in self.folder.iterdir()})
        (self.folder / "link.key").symlink_to("nowhere")
        self.refused("key", "new", "--fleet", "link.key")
        self.assertFalse((self.folder / "nowhere").exists())

    def test_bad_usage(self):
        self.refused("key", saying=("--help",))
        self.refused("key", "old", saying=("old",))
        self.refused("key", "new", saying=("--robots", "--fleet", "--robot"))
        self.refused("key", "new", "--robots", 3, saying=("--dir",))
        self.refused("key", "new", "--robots", 0, "--dir", ".", saying=("--robots 0",))
        self.refused("key", "new", "--robots", 1025, "--dir", ".", saying=("1 to 1024",))
        self.refused("key", "new", "--robots", 2, "--robot", 3, "--dir", ".", saying=("either",))
        self.refused("key", "new", "--robots", 2, "--fleet", "a", saying=("either",))
        self.refused("key", "new", "--robot", 2, "--dir", ".", "--without-signatures", saying=("either",))
        self.refused("key", "new", "--without-signatures", saying=("--dir",))
        self.refused("key", "new", "--fleet", "a", "--robot", 3, "--dir", ".", saying=("either",))
        self.refused("key", "new", "--robot", 3, saying=("--dir",))
        self.refused("key", "new", "--fleet", "a", "--dir", ".", saying=("--dir",))
        self.refused("key", "new", "--robot", 3, "--dir", "no/where", saying=("cannot make the folder no/where",))
        self.refused("key", "new", "--robot", "4294967296", "--dir", ".", saying=("--robot",))
        self.refused("key", "new", "--fleet", "no/where", saying=("no/where",))
        self.refused("key", "new", "--fleet", "a", "--report", "a", saying=("--report",))
        self.assertEqual([], list(self.folder.iterdir()))

    def test_help_of_new(self):
        self.assertIn("Example: tessera key new ", self.done("key", "new", "--help").stdout)


if __name__ == "__main__":
    unittest.main()
