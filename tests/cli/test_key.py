# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""tessera key new."""
import json
import os
import stat
import unittest

from command_case import CommandCase, crc32c


class Key(CommandCase):
    def words(self, name):
        """Of the one line that says something; its checksum is held."""
        lines = [line for line in (self.folder / name).read_text().splitlines() if line and not line.startswith("#")]
        self.assertEqual(1, len(lines))
        text, check = lines[0].rsplit(" ", 1)
        self.assertEqual(f"{crc32c(text.encode()):08x}", check)
        return text.split()

    def mode(self, name):
        return stat.S_IMODE((self.folder / name).stat().st_mode)

    def test_a_fleet_key(self):
        before = os.umask(0)
        self.addCleanup(os.umask, before)
        result = self.done("key", "new", "--fleet", "fleet.key", "--report", "report.json")
        kind, version, key = self.words("fleet.key")
        self.assertEqual(("tessera-fleet-key", "1", 64), (kind, version, len(key)))
        self.assertEqual(0o600, self.mode("fleet.key"))
        report = (self.folder / "report.json").read_text()
        self.assertEqual(["fleet.key"], json.loads(report)["files"])
        for text in (result.stdout, result.stderr, report):
            self.assertNotIn(key, text)

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
        (self.folder / "link.key").symlink_to("nowhere")
        self.refused("key", "new", "--fleet", "link.key")
        self.assertFalse((self.folder / "nowhere").exists())

    def test_bad_usage(self):
        self.refused("key", saying=("--help",))
        self.refused("key", "old", saying=("old",))
        self.refused("key", "new", saying=("--fleet", "--robot"))
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
