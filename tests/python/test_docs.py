# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""What docs/reference/python.md and the example say works as it stands there."""
import pathlib
import re
import subprocess
import sys

import pytest

image = pytest.importorskip("matplotlib.image")
ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs/reference/python.md").read_text()


def test_every_program_of_the_page_runs(street, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "street").symlink_to(street)
    names = {}
    programs = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    assert len(programs) >= 5
    for number, program in enumerate(programs):
        exec(compile(program, f"program {number + 1} of python.md", "exec"), names)
    for name in ("here.tsm", "global.tsm"):
        assert (tmp_path / name).exists()


def test_the_page_names_everything():
    import tessera
    for name in tessera.__all__:
        assert f"{name}" in PAGE, name


def test_the_example_draws_a_picture(street, tmp_path):
    example = ROOT / "examples" / "kitti_to_picture.py"
    assert len(example.read_text().splitlines()) <= 30
    done = subprocess.run([sys.executable, "-B", str(example), str(street / "robot_0"), str(tmp_path / "map.png"), "1"],
                          capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert "scan 1 of 1" in done.stdout and " 0 left out" in done.stdout
    picture = image.imread(tmp_path / "map.png")
    colors = {tuple((255 * c).astype(int)) for c in picture[::3, ::3, :3].reshape(-1, 3)}
    assert picture.shape[0] > 300 and picture.shape[1] > 500
    # Road and building are seen.
    assert (255, 0, 255) in colors and (255, 200, 0) in colors
