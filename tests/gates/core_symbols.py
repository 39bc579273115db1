#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""core_symbols.py NM ARCHIVE FORBIDDEN: the core needs nothing from outside but a short list of functions.

An allow-list: whatever is undefined in ARCHIVE and not defined in it must be named here. So heap, exceptions, RTTI,
clocks, I/O and threads are all refused without naming them. FORBIDDEN is an object file that uses one of each, built as
the core is: the gate fails if it does not refuse all of them.
"""
import re
import subprocess
import sys

ALLOWED = re.compile(
    r"^(mem(cpy|move|set|cmp)|sqrtf?|__popcountdi2|_GLOBAL_OFFSET_TABLE_|__stack_chk_(fail|guard))$")
# What FORBIDDEN must be refused for, as patterns of mangled names.
MUST_REFUSE = {
    "the heap of C": "malloc", "operator new": "_Znwm", "operator delete": "_ZdlPv(m)?",
    "exceptions": "__cxa_throw", "checks that throw": "_ZSt.*__throw_.*", "unwinding": "_Unwind_Resume",
    "RTTI": "_ZTVN10__cxxabiv1.*", "guarded statics": "__cxa_guard_acquire", "clocks": "clock_gettime",
    "formatted output": "printf", "files": "fopen", "threads": "pthread_create", "sockets": "socket", "exits": "abort"}


def outside(nm_text):
    """Names that are undefined in one of the objects and defined in none."""
    defined, wanted = set(), set()
    for line in nm_text.splitlines():
        fields = line.split()
        if len(fields) >= 2 and len(fields[-2]) == 1:
            (wanted if fields[-2] in "Uvw" else defined).add(fields[-1])
    return wanted - defined, len(defined)


def refused(names):
    return sorted(name for name in names if not ALLOWED.match(name))


def foreign(nm_text):
    """Symbols of units for one kind of machine that the linker could take for those of other units, or that run
    unasked: such a unit may define nothing but local ones and strong functions."""
    unit, found = "", []
    for line in nm_text.splitlines():
        fields = line.split()
        if len(fields) == 1 and line.endswith(":"):
            unit = line[:-1]
        elif "_avx2." in unit and len(fields) >= 2 and len(fields[-2]) == 1:
            if fields[-2] in "WVuwi" or fields[-1].startswith("_GLOBAL__sub_I"):
                found.append(f"{unit}: {fields[-1]}")
    return found


def symbols(nm, path):
    return subprocess.run([nm, path], check=True, capture_output=True, text=True).stdout


def main():
    nm, archive, forbidden = sys.argv[1:]
    assert outside("0000 T own\n                 U own\n                 w absent\n") == ({"absent"}, 1)
    assert foreign("x_avx2.cpp.o:\n00 W f\n00 t _GLOBAL__sub_I_f\n00 T g\n00 t h\n\ny.cpp.o:\n00 W f\n") == [
        "x_avx2.cpp.o: f", "x_avx2.cpp.o: _GLOBAL__sub_I_f"]
    faults = []
    caught = refused(outside(symbols(nm, forbidden))[0])
    for what, pattern in MUST_REFUSE.items():
        if not any(re.fullmatch(pattern, name) for name in caught):
            faults.append(f"this gate would not notice {what}: {forbidden} should be refused for {pattern}")
    names, defined = outside(symbols(nm, archive))
    if defined < 10:
        faults.append(f"{archive} defines {defined} symbols: that is not the core")
    faults += [f"the core needs {name}, which is not on the list of allowed symbols" for name in refused(names)]
    if "_avx2." not in symbols(nm, archive):
        faults.append(f"{archive} has no unit named *_avx2: this gate would not notice what one leaves behind")
    faults += [f"{name} of a unit for one kind of machine may be taken for another unit's, or runs unasked"
               for name in foreign(symbols(nm, archive))]
    print("\n".join(faults), file=sys.stderr)
    return 1 if faults else 0


sys.exit(main())
