# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The port on real SocketCAN, which the machine's own kernel may lack: inside User-Mode Linux, where vcan_cases.py runs."""
import os
import pathlib
import sys
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "support"))
import user_mode_linux

LIMIT_S = 120


class VirtualCan(unittest.TestCase):
    def test_in_a_kernel_with_vcan(self):
        environment = {name: os.environ[name] for name in ("TESSERA_CAN_MEMBER", "TESSERA_SOURCE")}
        status, said = user_mode_linux.run([sys.executable, "-B", "-m", "unittest", "-v", "vcan_cases"],
                                           pathlib.Path(__file__).parent, environment,
                                           modules=("can", "can-raw", "vcan", "sch_netem"), limit_s=LIMIT_S)
        print(said, file=sys.stderr)
        self.assertEqual(0, status, said)
        self.assertRegex(said, r"Ran [1-9]\d* tests? in")
        self.assertNotIn("skipped", said)


if __name__ == "__main__":
    unittest.main()
