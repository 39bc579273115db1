#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""can_reaction.py --tessera COMMAND [--times N] --into JSON: reactions of a node to frames of its vehicle's bus, N of each kind,
measured in User-Mode Linux, which has vcan. Adds reactions_ms to the file: milliseconds by kind."""
import argparse
import json
import pathlib
import re
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(SOURCE / "tests" / "support"))
import user_mode_linux  # noqa: E402  needs the path above


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tessera", required=True)
    parser.add_argument("--times", type=int, default=100)
    parser.add_argument("--into", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    environment = {"TESSERA_COMMAND": str(pathlib.Path(arguments.tessera).resolve()), "TESSERA_SOURCE": str(SOURCE),
                   "TESSERA_TIMES": str(arguments.times)}
    _, said = user_mode_linux.run(["sh", "-c", 'ip link set lo multicast on; exec "$0" "$@"', sys.executable, "-B", "-m", "unittest",
                                   "reaction_cases"],
                                  pathlib.Path(__file__).parent, environment, modules=("can", "can-raw", "vcan"),
                                  limit_s=60 + 3 * arguments.times, memory="384M")
    found = re.search(r"^measured (.*)$", said, re.MULTILINE)
    if found is None:
        sys.exit(f"can_reaction.py: nothing was measured:\n{said}")
    measured = json.loads(arguments.into.read_text())
    measured["reactions_ms"] = json.loads(found[1])
    arguments.into.write_text(json.dumps(measured, indent=1) + "\n")


if __name__ == "__main__":
    main()
