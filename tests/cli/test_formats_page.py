# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The commands of docs/reference/formats.md, run as they stand there."""
import pathlib
import shlex
import unittest

import kitti_folder as kitti
import test_clouds as clouds
import test_depth as depth
from command_case import MEMORY

PAGE = pathlib.Path(__file__).parents[2] / "docs/reference/formats.md"


class Page(depth.DepthCase):
    def test_every_command(self):
        for name, write in (("scans", clouds.pcd_binary), ("meshes", clouds.ply_ascii)):
            (self.folder / name).mkdir()
            for i in range(2):
                (self.folder / name / f"{i}.{name == 'scans' and 'pcd' or 'ply'}").write_bytes(write(kitti.corner_scan(i)))
        lines = [line[4:] for line in PAGE.read_text().splitlines() if line.startswith("    tessera ")]
        self.assertGreaterEqual(len(lines), 10)
        for line in lines:
            with self.subTest(line):
                arguments = shlex.split(line)[1:]
                out = self.folder / arguments[arguments.index("--out") + 1]
                out.unlink(missing_ok=True)
                self.done(*arguments, *(MEMORY if arguments[0] == "map" else ()))
                self.assertGreater(out.stat().st_size, 0)

    def test_its_camera(self):
        text = PAGE.read_text().partition("```toml\n")[2].partition("```")[0]
        (self.folder / "camera.toml").write_text(text)
        self.depth_refused("64 x 48 pixels, but its camera 640 x 480")


if __name__ == "__main__":
    unittest.main()
