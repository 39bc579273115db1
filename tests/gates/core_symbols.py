#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""core_symbols.py ARCHIVE: the core needs nothing from outside but a short list of functions.

An allow-list: whatever is undefined in the archive and not defined in it must be named here. So heap, exceptions, RTTI,
clocks, I/O and threads are all refused without naming them.
"""
import re
import subprocess
import sys

ALLOWED = re.compile(
    r"^(mem(cpy|move|set|cmp)|sqrtf?|_GLOBAL_OFFSET_TABLE_|tessera_assert_failed|__stack_chk_fail|"
    r"__asan_\w+|__ubsan_\w+|__sanitizer_\w+|__popcountdi2)$")


def undefined(nm_text):
    defined, wanted = set(), set()
    for line in nm_text.splitlines():
        fields = line.split()
        if len(fields) < 2:
            continue
        kind, name = fields[-2], fields[-1]
        (wanted if kind in "Uw" else defined).add(name)
    return wanted - defined


def refused(nm_text):
    return sorted(name for name in undefined(nm_text) if not ALLOWED.match(name))


def main():
    # The gate must catch what it is for.
    for symbol in ("malloc", "_Znwm", "__cxa_throw", "_ZTVN10__cxxabiv117__class_type_infoE", "clock_gettime", "pthread_create", "printf"):
        assert refused(f"                 U {symbol}\n") == [symbol], symbol
    assert refused("0000 T own\n                 U own\n                 U memcpy\n") == []
    text = subprocess.run(["nm", sys.argv[1]], check=True, capture_output=True, text=True).stdout
    assert "tessera" in text, "the archive has no symbol of the core"
    bad = refused(text)
    for name in bad:
        print(f"the core needs {name}, which is not on the list of {__file__}", file=sys.stderr)
    return 1 if bad else 0


sys.exit(main())
