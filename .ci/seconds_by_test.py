#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""seconds_by_test.py JUNIT.xml: where the time of a run of ctest went: by executable or module, then the longest single tests."""
import collections
import sys
import xml.etree.ElementTree

SHOWN = 20


def main(path):
    tests = [(float(case.get("time")), case.get("name")) for case in xml.etree.ElementTree.parse(path).iter("testcase")]
    groups = collections.Counter()
    for seconds, name in tests:
        groups[name.split(":")[0]] += seconds
    print(f"\n{len(tests)} tests, {sum(groups.values()):.0f} s of them one after the other")
    for title, rows in ("of executables and modules", [(s, n) for n, s in groups.most_common(SHOWN)]), ("of single tests", sorted(tests, reverse=True)[:SHOWN]):
        print(f"\nseconds {title}")
        for seconds, name in rows:
            print(f"{seconds:8.1f}  {name}")


if __name__ == "__main__":
    main(sys.argv[1])
