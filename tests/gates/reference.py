#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""reference.py ROOT DOXYGEN: Doxygen has nothing against the headers' comments, and every file, class and enumeration has one.

Members whose name says all go without, as the style of the headers is; so Doxygen is asked for what is undocumented apart.
"""
import pathlib
import re
import subprocess
import sys
import tempfile

NEEDS = re.compile(r"(Compound \S+|Member \S+ \(enumeration\) of .*) is not documented")


def messages(root, doxygen, folder, *settings):
    text = (root / "docs/Doxyfile").read_text()
    given = "\n".join([text, f"OUTPUT_DIRECTORY = {folder}", *settings, ""])
    result = subprocess.run([doxygen, "-"], input=given, text=True, capture_output=True, cwd=root, timeout=300, check=False)
    return result.returncode, result.stdout + result.stderr


def faults(text):
    return [line for line in text.splitlines() if NEEDS.search(line)]


def main():
    assert faults("a.hpp:1: warning: Compound tessera::A is not documented.")
    assert faults("a.hpp:1: warning: Member B (enumeration) of namespace tessera is not documented.")
    assert not faults("a.hpp:1: warning: Member size() const (function) of class tessera::A is not documented.")
    root, doxygen = pathlib.Path(sys.argv[1]), sys.argv[2]
    with tempfile.TemporaryDirectory(prefix="tessera-reference-") as folder:
        status, text = messages(root, doxygen, folder)
        if status != 0:
            print(text, file=sys.stderr)
            return 1
        pages = pathlib.Path(folder) / "html"
        if not (pages / "index.html").exists() or not (pages / "classtessera_1_1LocalMap.html").exists():
            print("Doxygen wrote no reference", file=sys.stderr)
            return 1
        _, text = messages(root, doxygen, folder, "WARN_IF_UNDOCUMENTED = YES", "WARN_AS_ERROR = NO", "EXCLUDE_PATTERNS =", "GENERATE_HTML = NO", "GENERATE_XML = YES")
        if "is not documented" not in text:
            print("Doxygen does not say what is undocumented any more; mend this gate", file=sys.stderr)
            return 1
    found = faults(text)
    print("\n".join(found), file=sys.stderr)
    return 1 if found else 0


sys.exit(main())
