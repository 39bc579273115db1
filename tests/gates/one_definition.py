#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""one_definition.py ROOT: no type of the project has the name of another, tests, benches and examples included.

Two types of one name in one namespace are one to the linker, which takes the functions of either: no compiler says so, and
what breaks depends on which units are linked first. What is in unnamed namespaces clashes with nothing.
"""
import pathlib
import re
import sys

import tracked

NOISE = re.compile(r"""//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|(?<![0-9A-Fa-f])'(?:\\.|[^'\\\n])+'""", re.S)
SCOPE = re.compile(
    r"\bnamespace\s*(?P<namespace>[\w:]*)\s*\{"
    r"|\b(?:class|struct|union|enum(?:\s+class)?)\s+(?:\[\[[^\]]*\]\]\s*)?(?:alignas\([^)]*\)\s*)?(?P<type>\w+)(?:\s+final)?\s*(?::(?!:)[^;{(]*)?\{"
    r"|(?P<brace>[{}])")


def types(text):
    """(namespace, name) of the types that a file defines outside functions, other types and unnamed namespaces."""
    scopes = []  # the name of a namespace; None for any other brace
    for found in SCOPE.finditer(NOISE.sub(" ", text)):
        if found["brace"] == "}":
            if scopes:
                scopes.pop()
            continue
        if found["type"] and all(scopes):
            yield "::".join(scopes), found["type"]
        scopes.append(found["namespace"] or None)


def self_test():
    text = """namespace tessera { namespace { struct Hidden {}; }
      // struct Said {
      class alignas(64) Robot final : public std::span<int> { struct Part {}; void f() { struct Local {}; } };
      struct Later; enum class [[nodiscard]] Kind : int { kOne }; void f(struct Other& other) { char c = '{'; }
      struct Robot::Part { };
      namespace bench { struct Robot {}; } }"""
    expected = [("tessera", "Robot"), ("tessera", "Kind"), ("tessera::bench", "Robot")]
    assert list(types(text)) == expected, list(types(text))


def main():
    self_test()
    root = pathlib.Path(sys.argv[1])
    seen, found = {}, []
    for path in tracked.code(root):
        for name in types(tracked.text(root, path)):
            if name in seen:
                found.append(f"{path}: {'::'.join(name)} is also a type of {seen[name]}")
            seen.setdefault(name, path)
    if not seen:
        sys.exit(f"{root}: no sources there")
    print("\n".join(found), file=sys.stderr)
    return 1 if found else 0


sys.exit(main())
