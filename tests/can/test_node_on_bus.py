# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A whole node on a vehicle's bus, inside User-Mode Linux, where node_cases.py runs."""
import os
import pathlib
import sys
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "support"))
import user_mode_linux

LIMIT_S = 360


class NodeOnBus(unittest.TestCase):
    def test_in_a_kernel_with_vcan(self):
        environment = {name: os.environ[name] for name in ("TESSERA_COMMAND", "TESSERA_SOURCE")}
        status, said = user_mode_linux.run(["sh", "-c", 'ip link set lo multicast on; exec "$0" "$@"', sys.executable, "-B", "-m",
                                            "unittest", "-v", *os.environ.get("TESSERA_CASES", "node_cases").split()],
                                           pathlib.Path(__file__).parent, environment, modules=("can", "can-raw", "vcan"),
                                           limit_s=LIMIT_S, memory="384M")
        print(said, file=sys.stderr)
        self.assertEqual(0, status, said)
        self.assertRegex(said, r"Ran [1-9]\d* tests? in")
        self.assertNotIn("skipped", said)


if __name__ == "__main__":
    unittest.main()
