#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""headers_alone.py ROOT BUILD COMPILER [FLAG...]: every header of the core compiles alone.

Most of the time would go into Eigen, so that is compiled once, and put in front of those headers that include it anyway, by
whatever way. The gate fails if it does not refuse a header that needs another one.
"""
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile

INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)
NEEDS_ANOTHER = "#pragma once\ninline tessera::Point3d origin() { return tessera::Point3d::Zero(); }\n"


def reached(header, root, seen):
    """All that a header includes, by the names in its includes."""
    for name in INCLUDE.findall((root / header).read_text(encoding="utf-8")):
        if name in seen:
            continue
        seen.add(name)
        if (root / name).exists():
            reached(name, root, seen)
    return seen


def main(root, build, compiler, *flags):
    root = pathlib.Path(root) / "lib/include"
    common = [compiler, *flags, "-std=c++20", "-I", str(root), "-I", f"{build}/lib/include", "-x"]
    headers = sorted(str(path.relative_to(root)) for path in root.rglob("*") if path.suffix in (".h", ".hpp"))
    with tempfile.TemporaryDirectory() as folder:
        eigen = pathlib.Path(folder) / "eigen.hpp"
        eigen.write_text("#include <Eigen/Core>\n", encoding="utf-8")
        output = eigen.with_name("eigen.hpp.gch")
        subprocess.run([*common, "c++-header", str(eigen), "-o", str(output)], check=True)
        using = ["-include-pch", str(output)] if "clang" in compiler else ["-include", str(eigen)]

        def compiles(text, with_eigen=False):
            command = [*common, "c++", "-fsyntax-only", *(using if with_eigen else []), "-"]
            ran = subprocess.run(command, input=text, text=True, capture_output=True, check=False)
            return ran.returncode == 0, ran.stderr

        def check(header):
            with_eigen = any(name.startswith("Eigen/") for name in reached(header, root, set()))
            return header, *compiles(f"#include <{header}>\n", with_eigen)

        for text, with_eigen, wanted in ((NEEDS_ANOTHER, False, False), (NEEDS_ANOTHER, True, False),
                                         ("#include <tessera/base/geometry.hpp>\n" + NEEDS_ANOTHER, True, True)):
            if compiles(text, with_eigen)[0] != wanted:
                sys.exit(f"the gate {'refuses' if wanted else 'takes'} a header that it must not:\n{text}")
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            failed = [(header, said) for header, good, said in pool.map(check, headers) if not good]
    for header, said in failed:
        print(f"{header} does not compile alone:\n{said}", file=sys.stderr)
    print(f"{len(headers)} headers, {len(failed)} do not compile alone")
    return 1 if failed or not headers else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
