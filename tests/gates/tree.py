#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""tree.py ROOT: what lies where, how long a file may be, and what must not stand in one."""
import pathlib
import re
import sys

import tracked

LISTS = ("lib/CMakeLists.txt", "lib/src/c/files.cmake", "lib/src/frames/files.cmake")  # Of the headers that are installed.
TOP = {"CMakeLists.txt", "CMakePresets.json", "LICENSE", "README.md", "pyproject.toml",
       "lib", "platform", "examples", "lcmtypes", "tests", "bench", "docs"}
MAX_LINES = 300
MAX_COLUMNS = 160  # Of Markdown: a line, and a cell of a table, whose rows may be longer.
# Files that may be longer, each with its number of lines and the reason why splitting it would make it worse.
LONGER = {
    "lib/CMakeLists.txt": 400,  # One list of headers and sources; worst cases are counted with units in its order.
    "tests/laws/scan_cases.cpp": 428,  # One generator: each part draws from what the others drew.
    "tests/laws/scan_laws.cpp": 315,  # One list of laws, read from top to bottom.
}
# The parts are joined so that this file does not contain them.
WORDS = re.compile(r"\b(" + "|".join(["TO" + "DO", "FIX" + "ME", "X" * 3]) + r")\b")
# Folders of one machine. Paths that the system itself has everywhere, as /usr, /dev and /proc, are none of these.
MACHINE_PATH = re.compile(r"(?<![\w./$}>~-])/(home|root|Users|work|farm|mnt|opt|media|tmp|scratch)/[\w.-]+")
LICENCE = "SPDX-License-Identifier: Apache-2.0"
PAGE = re.compile(r"(?<![\w/.$-])docs/[\w./-]+\.(?:md|png|dbc)\b")
SIGNED = (*tracked.CODE, ".py", ".sh", ".cmake", ".in", ".lcm")


def text_faults(path, text):
    lines = text.splitlines()
    if path.suffix in SIGNED or path.name == "CMakeLists.txt":
        if not any(LICENCE in line for line in lines[:4]):
            yield f"its first lines do not say {LICENCE}"
        allowed = LONGER.get(str(path), MAX_LINES)
        if len(lines) > allowed:
            yield f"{len(lines)} lines, and at most {allowed} are readable"
    if path.suffix in (".hpp", ".h") and "#pragma once" not in lines:
        yield "has no #pragma once"
    for number, line in enumerate(lines, 1):
        for match in (*WORDS.finditer(line), *MACHINE_PATH.finditer(line)):
            yield f"line {number} has {match.group(0)}"
    if path.suffix == ".md":
        yield from page_faults(lines)


def page_faults(lines):
    block = False
    for number, line in enumerate(lines, 1):
        block ^= line.lstrip().startswith("```")
        of_table = line.lstrip().startswith("|") and not block
        parts = re.split(r"(?<!\\)\|", line) if of_table else [line]
        if max(len(part.strip() if of_table else part) for part in parts) > MAX_COLUMNS:
            yield f"line {number} has more than {MAX_COLUMNS} columns" + " in a cell" * of_table


def missing_pages(text, names):
    """Pages that a text names and that are not there."""
    yield from (f"names {page}, which is not there" for page in sorted({*PAGE.findall(text)} - names))


def name_faults(path):
    if path.parts[0] not in TOP and not path.parts[0].startswith("."):
        yield f"{path.parts[0]} has no place at the top level"
    if path.suffix in tracked.CODE and not re.fullmatch(r"[a-z][a-z0-9_]*", path.stem):
        yield "is not named in snake_case"


def installed_faults(headers, listing):
    """Headers of the library that its lists do not install."""
    for header in sorted(headers):
        if not re.search(rf"^ *{re.escape(header)}$", listing, re.MULTILINE):
            yield f"no list of lib installs {header}"


def self_test():
    assert not [*installed_faults(["include/a.hpp"], "FILES\n  include/a.hpp\n")]
    assert [*installed_faults(["include/a.hpp"], "FILES\n  include/ba.hpp\n")]

    def refused(name, text):
        path = pathlib.PurePosixPath(name)
        return [*name_faults(path), *text_faults(path, text)]

    good = f"// {LICENCE}\n#pragma once\n"
    assert not refused("lib/a.hpp", good)
    assert not refused("README.md", "see `/usr/include`, `../shared/data`, ${HOME}/opt/x and https://a.org/home/x\n")
    assert refused("scripts/a.md", "")
    assert refused("lib/A.hpp", good)
    assert refused("lib/a.hpp", "#pragma once\n")
    assert refused("lib/a.hpp", f"// {LICENCE}\n")
    assert refused("lib/a.hpp", good + "//\n" * MAX_LINES)
    assert refused("README.md", "TO" + "DO: say more\n")
    assert refused("README.md", "run it in /ho" + "me/somebody/tessera\n")
    assert not refused("README.md", "a" * MAX_COLUMNS + "\n| " + "a" * MAX_COLUMNS + " | b |\n")
    assert refused("README.md", "a" * MAX_COLUMNS + "a\n")
    assert refused("README.md", "| b | " + "a" * MAX_COLUMNS + "a |\n")
    gone = "docs/" + "gone.md"
    assert [*missing_pages(f"see {gone}, and docs/README.md", {"docs/README.md"})] == [f"names {gone}, which is not there"]


def main():
    self_test()
    root = pathlib.Path(sys.argv[1])
    found = []
    names = {str(path) for path in tracked.files(root)}
    for path in tracked.files(root):
        text = tracked.text(root, path)
        if path.name == "LICENSE":
            continue
        found += [f"{path}: {fault}" for fault in missing_pages(text or "", names)]
        found += [f"{path}: {fault}" for fault in (*name_faults(path), *(text_faults(path, text) if text else ()))]
    headers = {str(path.relative_to("lib")) for path in tracked.files(root)
               if path.is_relative_to("lib/include") and path.suffix in (".hpp", ".h")}
    found += installed_faults(headers, "".join((root / path).read_text() for path in LISTS))
    tops = {path.parts[0] for path in tracked.files(root)}
    found += [f"{name} is missing at the top level" for name in sorted(TOP - tops)]
    print("\n".join(found), file=sys.stderr)
    return 1 if found else 0


sys.exit(main())
