# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The unit that runs a node at boot, as systemd itself reads it."""
import os
import pathlib
import re
import shutil
import subprocess
import unittest

from command_case import CommandCase, command_path

NAME = "tessera-node@.service"
# As docs/reference/operations.md says; systemd rates from 0 to 10.
MOST_EXPOSURE = 2.0


def unit():
    """As it was configured, but for the program, which is installed nowhere yet."""
    return re.sub(r"(?m)^(ExecStart(?:Pre)?=)\S+", rf"\g<1>{command_path()}", pathlib.Path(os.environ["TESSERA_UNIT"]).read_text())


class Unit(CommandCase):
    def analyze(self, *words):
        if shutil.which("systemd-analyze") is None:
            self.skipTest("skipped: systemd-analyze is not installed (Debian package systemd)")
        # Its instance "x".
        path = self.folder / NAME.replace("@", "@x")
        path.write_text(unit())
        return subprocess.run(["systemd-analyze", "--no-pager", *words, str(path)], text=True, capture_output=True, timeout=60, check=False)

    def test_systemd_has_nothing_against_it(self):
        result = self.analyze("verify")
        self.assertEqual((0, ""), (result.returncode, result.stdout + result.stderr))

    def test_it_is_as_little_exposed_as_is_said(self):
        result = self.analyze("security", "--offline=true", f"--threshold={round(10 * MOST_EXPOSURE)}")
        exposure = float(re.search(r"exposure level for \S+: ([\d.]+)", result.stdout)[1])
        print(f"exposure {exposure}")
        self.assertEqual(0, result.returncode, result.stdout)
        self.assertLessEqual(exposure, MOST_EXPOSURE)

    def test_what_it_starts_is_there(self):
        lines = re.findall(r"(?m)^ExecStart(?:Pre)?=(\S+) (\S+) (.*)$", unit())
        self.assertEqual(2, len(lines))
        said = self.done("node", "--help").stdout
        for program, command, rest in lines:
            self.assertEqual((command_path(), "node"), (program, command))
            for option in re.findall(r"--\w+", rest):
                self.assertIn(option, said)
            self.assertRegex(rest, r"--config \S+/tessera/%i\.toml$")
        # None is left of what CMake puts in.
        self.assertNotIn("@CMAKE", unit())


if __name__ == "__main__":
    unittest.main()
