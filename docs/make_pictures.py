#!/usr/bin/python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""make_pictures.py BUILD: runs the commands of the pages for a task, and puts the pictures that these make beside the pages.

Needs Debian's python3-pil, for pictures of few bytes, and for the package's page the Python module of BUILD.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[1]
# The page, the picture that its commands leave, and what it is called here.
PICTURES = (("tasks/map-my-data", "street.png", "tasks/map-my-data.png"), ("tasks/two-robots", "both.png", "tasks/two-robots.png"),
            ("tasks/moving-things", "rays.png", "tasks/moving-rays.png"), ("tasks/moving-things", "moved.png", "tasks/moving-moved.png"))
WIDTH_PX = 1200


def blocks(page):
    return re.findall(r"^```sh\n(.*?)^```", page.read_text(), re.M | re.S)


def put(picture, name):
    image = Image.open(picture).convert("RGB")
    image = image.resize((WIDTH_PX, round(image.height * WIDTH_PX / image.width)), Image.Resampling.LANCZOS)
    image.quantize(128, dither=Image.Dither.NONE).save(ROOT / "docs" / name, optimize=True)
    print(f"docs/{name}: {(ROOT / 'docs' / name).stat().st_size} bytes")


def run(words, folder, build, **more):
    environment = {**os.environ, "PATH": f"{build}:{os.environ['PATH']}", **more}
    subprocess.run(words, cwd=folder, check=True, env=environment, stdout=subprocess.DEVNULL)


def main(build):
    for page, made, name in PICTURES:
        with tempfile.TemporaryDirectory(prefix="tessera-docs-") as folder:
            # The block that draws, whole: those before it are for data of the reader's.
            script = next(block for block in blocks(ROOT / "docs" / f"{page}.md") if f"--out {made}" in block)
            script = "".join(line for line in script.splitlines(True) if not line.startswith("tessera doctor"))
            run([ROOT / "tests/in-own-network.sh", "bash", "-euc", script], folder, build)
            put(f"{folder}/{made}", name)
    with tempfile.TemporaryDirectory(prefix="tessera-docs-") as folder:
        run(["tessera", "simulate", "--robots", "1", "--scans", "6", "--out", "street"], folder, build)
        run(["/usr/bin/python3", ROOT / "examples/kitti_to_picture.py", "street/robot_0", "map.png"], folder, build,
            PYTHONPATH=f"{build}/python")
        put(f"{folder}/map.png", "reference/python.png")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]).resolve())
