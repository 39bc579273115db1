# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The exchange between processes on a network that delays, overtakes, repeats, damages and loses in bursts: netem, inside
User-Mode Linux, where netem_cases.py runs."""
import pathlib
import sys
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "support"))
import user_mode_linux
from team import program

LIMIT_S = 240


class Netem(unittest.TestCase):
    def test_in_a_kernel_with_netem(self):
        environment = {"TESSERA_MEMBER": program("TESSERA_MEMBER")}
        status, said = user_mode_linux.run([sys.executable, "-B", "-m", "unittest", "-v", "netem_cases"],
                                           pathlib.Path(__file__).parent, environment,
                                           modules=("bridge", "veth", "sch_netem"), limit_s=LIMIT_S)
        print(said, file=sys.stderr)
        self.assertEqual(0, status, said)
        self.assertRegex(said, r"Ran [1-9]\d* tests? in")
        self.assertNotIn("skipped", said)


if __name__ == "__main__":
    unittest.main()
