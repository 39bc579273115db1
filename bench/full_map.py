#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""full_map.py --build FOLDER --dataset FOLDER [--out FILE]: what scans 3 to 5 cost in a map that has no room for them, against
the same with 512 MiB: instructions under callgrind. Takes about two minutes."""
import argparse
import json
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import worst  # noqa: E402

MOST = 1.3


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True, type=pathlib.Path, help="folder that CMake built in")
    parser.add_argument("--dataset", required=True, type=pathlib.Path, help="folder in the KITTI layout, of six scans and more")
    parser.add_argument("--out", type=pathlib.Path, help="JSON file to write")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        counted = worst.instructions([options.build / "bench" / "full_map", options.dataset], folder)
        found = json.loads((folder / "counted.json").read_text())
    print(f"{'':26}{'storage, MiB':>14}{'refused':>10}{'of':>10}{'instructions':>16}{'ratio':>8}")
    beyond, enough = [], {}
    for case, figures in found.items():  # where there is room comes first
        figures["instructions"] = counted[case]
        figures["ratio"] = counted[case] / enough.setdefault(figures["free_space"], counted[case])
        if figures["ratio"] > MOST:
            beyond.append(case)
        print(f"{case:26}{figures['storage_bytes'] / 2**20:>14.1f}{figures['refused']:>10,}{figures['thinned']:>10,}"
              f"{counted[case]:>16,}{figures['ratio']:>8.2f}")
    if options.out:
        options.out.write_text(json.dumps(found, indent=1) + "\n")
    if beyond:
        sys.exit(f"full_map.py: over {MOST}: {', '.join(beyond)}")


if __name__ == "__main__":
    main()
