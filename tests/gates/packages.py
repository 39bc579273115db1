#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""packages.py ROOT: what CMake looks for, tests/install-packages.sh installs.

Otherwise a machine that has it already, as every developer's has, would hide that a fresh one does not.
"""
import pathlib
import re
import subprocess
import sys

import tracked

# The Debian package that gives what find_package(), find_program(), find_path() or find_library() looks for.
DEBIAN = {
    "Eigen3": "libeigen3-dev",
    "CLI11": "libcli11-dev",
    "nlohmann_json": "nlohmann-json3-dev",
    "tomlplusplus": "libtomlplusplus-dev",
    "fmt": "libfmt-dev",
    "PNG": "libpng-dev",
    "ZLIB": "libpng-dev",  # Needs zlib1g-dev.
    "liblzf": "liblzf-dev",
    "Catch2": "catch2",
    "Python3": "python3",
    "Python": "python3-dev",
    "python3": "python3",
    "pybind11": "pybind11-dev",
    "octomap": "liboctomap-dev",
    "clang-format": "clang-format",
    "clang++": "clang",
    "g++": "g++",
    "doxygen": "doxygen",
    "gzip": "gzip",
    "Threads": "g++",
    "lcm": "liblcm-dev",
    "lcm/lcm.h": "liblcm-dev",
    "lcm/lcm_coretypes.h": "liblcm-dev",
    "lcm-gen": "liblcm-bin",
    "sodium": "libsodium-dev",
    "sodium.h": "libsodium-dev",
    "microhttpd": "libmicrohttpd-dev",
    "microhttpd.h": "libmicrohttpd-dev",
}
FIND = re.compile(r"^\s*find_(package|program|path|library)\s*\(([^)]*)\)", re.M)
# What is only looked for, and left out where it is not there.
ONLY_IN_CI = {"clang-format", "clang++", "doxygen"}
ONLY_IN_TESTS = {"Python", "pybind11"}


def wanted(text):
    for kind, arguments in FIND.findall(text):
        words = arguments.split()
        yield words[0] if kind == "package" else words[1]


def faults(role, path, text, installed):
    """installed: role to the packages that the script names for it."""
    for name in wanted(text):
        package = DEBIAN.get(name)
        where = "ci" if name in ONLY_IN_CI else "tests" if name in ONLY_IN_TESTS else role
        if package is None:
            yield f"{path} looks for {name}: say in {pathlib.Path(__file__).name} which Debian package has it"
        elif package not in installed[where]:
            yield f"{path} looks for {name}, but install-packages.sh {where} does not install {package}"


def self_test():
    installed = {"demo": {"libpng-dev"}, "tests": {"catch2"}, "bench": set(), "ci": set()}
    assert not list(faults("demo", "a", "find_package(PNG REQUIRED)", installed))
    assert not list(faults("tests", "a", "  find_package(Catch2 2 REQUIRED)", installed))
    assert list(faults("demo", "a", "find_package(Catch2 2 REQUIRED)", installed))
    assert list(faults("demo", "a", "find_package(Unheard)", installed))
    assert list(faults("demo", "a", "find_package(octomap QUIET)", installed))
    assert list(faults("demo", "a", "find_library(SODIUM sodium REQUIRED)", installed))
    assert list(faults("demo", "a", "find_path(SODIUM_INCLUDE_DIR sodium.h REQUIRED)", installed))
    assert list(faults("tests", "a", "find_program(PROGRAM clang-format)", installed))


def main():
    self_test()
    root = pathlib.Path(sys.argv[1])
    installed = {}
    for role in ("demo", "tests", "bench", "ci"):
        listed = subprocess.run([str(root / "tests/install-packages.sh"), role, "--list"], check=True,
                                capture_output=True, text=True)
        installed[role] = set(listed.stdout.split())
    found = []
    for path in tracked.files(root):
        if path.name == "CMakeLists.txt" and path.parts[:2] != ("tests", "consumer"):
            role = "tests" if path.parts[0] == "tests" else "demo"
            found += faults(role, path, tracked.text(root, path), installed)
    for needed in ("g++", "cmake", "ninja-build", "python3"):
        if needed not in installed["demo"]:
            found.append(f"install-packages.sh demo does not install {needed}")
    print("\n".join(found), file=sys.stderr)
    return 1 if found else 0


sys.exit(main())
