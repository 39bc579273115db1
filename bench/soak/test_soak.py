# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A soak of two virtual minutes, stopped after the first: all that must hold does, and a kill of every robot is among what happens."""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

SOAK = pathlib.Path(os.environ["TESSERA_BUILD"]) / "bench/soak"


def soak(folder, *options):
    command = [SOAK, "--state", folder, "--seed", "6", "--kills", "1", "--submap-length", "8", "--map-submaps", "12", "--resolution", "0.5", *options]
    return subprocess.run(command, capture_output=True, text=True)


class Smoke(unittest.TestCase):
    def test_two_minutes_with_a_stop(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            first = soak(folder, "--minutes", "1")
            self.assertEqual(0, first.returncode, first.stdout + first.stderr)
            second = soak(folder, "--minutes", "2", "--resume")
            self.assertEqual(0, second.returncode, second.stdout + second.stderr)
            rows = [json.loads(line) for line in (folder / "minutes.jsonl").read_text().splitlines()]
            self.assertEqual([1, 2], [row["minute"] for row in rows])
            last = rows[-1]
            self.assertEqual(6, last["kills"])
            # Those that were killed, and all that were started again after the stop.
            self.assertEqual(6 + 3, last["restarts"])
            self.assertEqual(0, last["violations"])
            self.assertTrue(all(row["agrees"] for row in rows))
            # Each robot has begun a map again, and the others have given up its first one.
            self.assertEqual(6, last["maps"])
            self.assertLess(last["contributions"], rows[0]["contributions"])
            self.assertGreater(last["occupied"], 20_000)
            self.assertGreater(last["km"], rows[0]["km"])
            # A folder of another soak is refused.
            other = soak(folder, "--minutes", "3", "--resume", "--robots", "2")
            self.assertEqual(2, other.returncode)
            self.assertIn("give the same", other.stderr)


if __name__ == "__main__":
    unittest.main()
