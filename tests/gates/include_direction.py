#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""include_direction.py ROOT: who may include whom.

Files of the core see the folders below theirs, and of the standard library only what needs neither heap nor system. Who uses
the library, examples and command included, includes no header in a folder named internal.
Folders of platform see the core and the platform folders before them. LCM, SocketCAN and OctoMap stay in the folder of that name.
"""
import pathlib
import re
import sys

import tracked

# A folder of the core may include itself and what is listed for it.
CORE = {
    "base": [],
    "grid": ["base"],
    "semantics": ["base", "grid"],
    "map": ["base", "grid", "semantics"],
    "registration": ["base", "grid", "semantics", "map"],
    "inference": ["base", "grid", "semantics", "map", "registration"],
    "replica": ["base", "grid", "semantics", "map"],
    "fusion": ["base", "grid", "semantics", "map", "inference", "replica", "frames"],
    "exchange": ["base", "grid", "semantics", "map", "replica", "frames"],
    "submap": ["base", "grid", "semantics", "map"],
    "frames": ["base", "grid", "semantics", "map", "replica"],
    "robot": ["base", "grid", "semantics", "map", "registration", "inference", "replica", "fusion", "exchange", "submap", "frames"],
}
# The sources of the C interface, whose headers are C: they may use all of the core.
CORE["c"] = list(CORE)
# What the core may include that is not its own: an allow-list, so <vector>, <iostream>, <thread>, <unistd.h> and the
# rest of them are refused without being named.
# The C interface includes nothing of the C++ headers, and these alone.
C_OUTSIDE = {"stddef.h", "stdint.h"}
OUTSIDE = {
    "algorithm", "array", "atomic", "bit", "cfloat", "climits", "cmath", "compare", "concepts", "cstddef", "cstdint",
    "cstring", "initializer_list", "iterator", "limits", "new", "numeric", "optional", "span", "string_view", "tuple",
    "type_traits", "utility", "Eigen/Core", "Eigen/Geometry", "Eigen/LU"}
# A folder of platform may include the core, itself and those before it.
PLATFORM = ["base", "settings", "pictures", "link", "vehicle", "scans", "maps", "simulator", "view", "node", "cli", "python"]
# Foreign headers that one folder of platform has to itself, by how their names begin. LCM's own are lcm/lcm.h,
# lcm/lcm-cpp.hpp, lcm/lcm_coretypes.h and lcm/eventlog.h.
RESERVED = {"lcm/lcm": "link", "lcm/eventlog": "link", "linux/can": "vehicle", "png.h": "pictures", "lzf.h": "scans",
            "octomap/OcTree": "maps", "octomap/octomap": "maps", "octomap/ColorOcTree": "maps",
            "sodium": "link", "microhttpd": "view", "pybind11": "python", "Python.h": "python"}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.M)


def c_faults(text):
    """Of a header of the C interface. Lists of counters are for both languages."""
    for kind, name in INCLUDE.findall(text):
        if not name.startswith("tessera/c/") and not name.endswith("_counters.h") and not (kind == "<" and name in C_OUTSIDE):
            yield f"a header for C must not include {name}"


def core_faults(folder, text):
    """folder: that of the header or source."""
    for kind, name in INCLUDE.findall(text):
        if name.startswith("tessera/"):
            target = name.split("/")[1]
            if folder == "c" and name == "tessera/tessera.h":
                continue
            if target not in CORE:
                yield f"{name}: no such folder in the core"
            elif target != folder and target not in CORE.get(folder, []):
                yield f"{folder} must not include {name}"
        elif kind == "<" and name not in OUTSIDE:
            yield f"the core must not include <{name}>"
        elif kind == '"' and "/" in name:
            yield f'the core must not include "{name}"'


def user_faults(text):
    """Of those who show how the library is used."""
    for _, name in INCLUDE.findall(text):
        if name.startswith("tessera/") and "internal" in name.split("/"):
            yield f"{name} is for the library itself"


def platform_faults(folder, text):
    seen = PLATFORM[:PLATFORM.index(folder) + 1] if folder in PLATFORM else [*PLATFORM[:-1], folder]
    for _, name in INCLUDE.findall(text):
        target = name.split("/")[0]
        for prefix, owner in RESERVED.items():
            if name.startswith(prefix) and folder != owner:
                yield f"{folder} must not include {name}: that is for platform/{owner}"
        if "/" in name and target not in seen and target in PLATFORM:
            yield f"{folder} must not include {name}"
        if ".." in name.split("/"):
            yield f"{folder} includes {name} past its folder"


def self_test():
    """Each rule refuses what it is for, and lets through what it should."""
    for folder, line in (("base", '"tessera/grid/lattice.hpp"'), ("map", '"tessera/inference/kernel.hpp"'),
                         ("registration", '"tessera/inference/kernel.hpp"'), ("map", "<vector>"), ("map", "<thread>"),
                         ("map", "<unistd.h>"), ("map", "<sys/stat.h>"), ("map", '"base/outcome.hpp"'),
                         ("c", '"base/outcome.hpp"'), ("robot", "<iostream>"), ("robot", "<tessera/nowhere/x.hpp>"),
                         ("exchange", '"tessera/fusion/global_map.hpp"'), ("fusion", '"tessera/exchange/exchange.hpp"')):
        assert list(core_faults(folder, f"#include {line}\n")), (folder, line)
    for folder, line in (("map", '"tessera/grid/lattice.hpp"'), ("inference", '"tessera/registration/scan.hpp"'),
                         ("base", "<array>"), ("map", '"map_file_format.hpp"'), ("c", "<tessera/tessera.h>"),
                         ("exchange", '"tessera/replica/replicas.hpp"')):
        assert not list(core_faults(folder, f"#  include {line}\n")), (folder, line)
    assert list(user_faults('#include "tessera/exchange/internal/gate.hpp"\n'))
    assert not list(user_faults('#include "tessera/exchange/exchange.hpp"\n'))
    for line in ("<string.h>", "<cstdint>", '"tessera/map/local_map.hpp"', '"config.h"'):
        assert list(c_faults(f"#include {line}\n")), line
    for line in ("<stdint.h>", '"tessera/c/config.h"'):
        assert not list(c_faults(f"#include {line}\n")), line
    for folder, line in (("base", '"cli/command.hpp"'), ("scans", '"maps/stored_map.hpp"'), ("cli", "<lcm/lcm-cpp.hpp>"),
                         ("base", "<linux/can.h>"), ("node", "<linux/can.h>"), ("cli", "<png.h>"), ("cli", "<octomap/OcTree.h>"),
                         ("maps", "<lzf.h>"), ("link", '"scans/cloud.hpp"'), ("scans", "<png.h>"), ("base", '"pictures/png_image.hpp"'),
                         ("pictures", '"../cli/command.hpp"'), ("cli", "<lcm/eventlog.h>"), ("node", "<sodium.h>"),
                         ("maps", "<pybind11/pybind11.h>"), ("node", '"python/arrays.hpp"'), ("cli", '"python/arrays.hpp"'),
                         ("node", "<microhttpd.h>"), ("view", '"node/node.hpp"')):
        assert list(platform_faults(folder, f"#include {line}\n")), (folder, line)
    for folder, line in (("cli", '"base/outcome.hpp"'), ("link", '"base/outcome.hpp"'), ("link", "<lcm/lcm-cpp.hpp>"),
                         ("cli", '"link/datagram_link.hpp"'), ("link", "<sodium.h>"), ("view", "<microhttpd.h>"),
                         ("node", '"view/viewer.hpp"'), ("vehicle", "<linux/can.h>"), ("base", "<sys/stat.h>")):
        assert not list(platform_faults(folder, f"#include {line}\n")), (folder, line)


def faults(root):
    seen = 0
    for path in tracked.code(root):
        if path.parts[0] == "lib":
            # The probe in lib/cmake is compiled with the headers of base alone.
            folder = {"include": path.parts[3:4], "src": path.parts[2:3]}.get(path.parts[1], ("base",))[0]
            found = (c_faults if path.suffix == ".h" else lambda text: core_faults(folder, text))(tracked.text(root, path))
        elif path.parts[0] == "platform":
            found = [*platform_faults(path.parts[1], tracked.text(root, path))]
            if path.parts[1] == "cli":
                found += user_faults(tracked.text(root, path))
        elif path.parts[0] == "examples":
            found = user_faults(tracked.text(root, path))
        else:
            continue
        seen += 1
        yield from (f"{path}: {fault}" for fault in found)
    if seen == 0:
        yield f"{root}: no sources there"


def main():
    self_test()
    found = list(faults(pathlib.Path(sys.argv[1])))
    print("\n".join(found), file=sys.stderr)
    return 1 if found else 0


sys.exit(main())
