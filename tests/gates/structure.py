#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""structure.py ROOT: who may include whom, how long a file may be, what lies at the top level."""
import pathlib
import re
import sys

# A folder may include itself and what is listed for it.
CORE = {
    "base": [],
    "grid": ["base"],
    "semantics": ["base", "grid"],
    "map": ["base", "grid", "semantics"],
    "registration": ["base", "grid", "semantics", "map"],
    "inference": ["base", "grid", "semantics", "map", "registration"],
}
PLATFORM = ["posix", "dataset", "render", "simulator", "cli"]  # each may use those before it, and the core
STANDARD = {  # what a core file may include beside its own
    "algorithm", "array", "bit", "cmath", "compare", "concepts", "cstddef", "cstdint", "cstring", "limits", "new",
    "optional", "span", "string_view", "type_traits", "utility", "Eigen/Core", "Eigen/Geometry", "Eigen/LU"}
TOP = {"CMakeLists.txt", "CMakePresets.json", "LICENSE", "README.md", "lib", "platform", "examples", "lcmtypes", "tests",
       "bench", "docs", "build", "out"}
MAX_LINES = 320
INCLUDE = re.compile(r'^\s*#\s*include\s+([<"])([^>"]+)[>"]', re.M)


def core_faults(folder, text):
    """folder: of the header, or None for a source file, which may use all of the core."""
    for kind, name in INCLUDE.findall(text):
        if name.startswith("tessera/"):
            target = name.split("/")[1]
            if folder and target != folder and target not in CORE.get(folder, []):
                yield f"{folder} must not include {name}"
        elif kind == "<" and name not in STANDARD:
            yield f"the core must not include <{name}>"
        elif kind == '"' and "/" in name:
            yield f'the core must not include "{name}"'


def platform_faults(folder, text):
    if "lcm/" in text and folder != "lcm" and re.search(r"#\s*include\s+<lcm/", text):
        yield "LCM's headers are seen by platform/lcm alone"
    if "linux/can" in text and folder != "socketcan":
        yield "SocketCAN's headers are seen by platform/socketcan alone"
    for kind, name in INCLUDE.findall(text):
        first = name.split("/")[0]
        if kind == '"' and first in PLATFORM and first != folder and PLATFORM.index(first) > PLATFORM.index(folder):
            yield f"{folder} must not include {name}"


def self_test():
    assert list(core_faults("base", '#include "tessera/grid/lattice.hpp"'))
    assert list(core_faults("map", "#include <vector>"))
    assert list(core_faults("map", '#include "posix/outcome.hpp"'))
    assert not list(core_faults("map", '#include "tessera/grid/lattice.hpp"\n#include <array>'))
    assert list(platform_faults("posix", '#include "cli/command.hpp"'))
    assert not list(platform_faults("cli", '#include "posix/outcome.hpp"'))


def main():
    self_test()
    root = pathlib.Path(sys.argv[1])
    faults = []
    for path in sorted(root.glob("lib/**/*.?pp")):
        parts = path.relative_to(root).parts
        folder = parts[3] if parts[1] == "include" else None
        faults += [f"{path}: {f}" for f in core_faults(folder, path.read_text())]
    for path in sorted(root.glob("platform/*/*.?pp")):
        faults += [f"{path}: {f}" for f in platform_faults(path.parent.name, path.read_text())]
    for pattern in ("lib/**/*.?pp", "platform/**/*.?pp", "tests/**/*.?pp", "examples/**/*.?pp"):
        for path in sorted(root.glob(pattern)):
            lines = len(path.read_text().splitlines())
            if lines > MAX_LINES:
                faults.append(f"{path}: {lines} lines, at most {MAX_LINES} are readable")
    for path in root.iterdir():
        if not path.name.startswith(".") and path.name not in TOP:
            faults.append(f"{path.name} has no place at the top level")
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


sys.exit(main())
