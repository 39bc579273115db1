# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""stack_use.py OBJDUMP ARCHIVE PROBE [--list]: how much stack the core's calls take at most, by their machine code (x86-64).

A function's frame is what its pushes and subtractions take, all paths added; a call's stack is the deepest chain of frames.
Refused: a call over LIMIT, recursion, a frame whose size is not in the code. A call through a pointer may lead to any of
the core's own TARGETS for its caller; what is not the core's (functions that the caller injected, and those of ALLOWED) comes on top.
PROBE: objects that must be refused, so that the gate shows it works."""
import collections
import re
import subprocess
import sys

LIMIT = 12 * 1024
# Of the C library and the compiler's: what they take comes on top.
ALLOWED = re.compile(r"^(mem(cpy|set|move|cmp)|sqrtf?|__popcountdi2|__stack_chk_fail)$")
# Functions of the core that it calls through pointers, and who does: parts of their mangled names. "": anyone.
TARGETS = {"add_rows_of_four": "", "add_rows_of_eight": "", "add_by_eights": "", "OctetsOnAny": "12CompactTuple", "OctetsWithAvx2": "12CompactTuple", "SpanReader4read": "", "SpanWriter5write": "", "4_FUN": "",
           "ExchangePublication": "9Publisher", "MapperArchive": "12MovingWindow",
           "12ArchiveCalls": "Mapper", "13WholeMapCalls4find": "10KeyedIndex", "13WholeMapCalls1": "8WholeMap", "CallbacksOfC": "7tessera", "FileOfC": "7tessera",
           "take_of_map": "11FrameFinder", "19ReplicaSketchSource4take": "11FrameFinder"}
FUNCTION = re.compile(r"^[0-9a-f]+ <([^>]+)>:$")
OBJECT = re.compile(r"^(\S+\.o):\s+file format")
INSTRUCTION = re.compile(r"^\s+[0-9a-f]+:\s+(?:(?:rep|repz|notrack|bnd|data16|cs|lock)\s+)*(\S+)\s*(.*)$")
RELOCATION = re.compile(r"^\s+[0-9a-f]+: R_X86_64_\w+\s+([^\s+-]+)")
RETURN_ADDRESS = 8


class Refused(Exception):
    pass


class Function:
    def __init__(self):
        self.frame = RETURN_ADDRESS
        self.callees = set()
        self.unbounded = False
        self.calls_pointer = False


def signed(text):
    value = int(text, 16)
    return value - (1 << 64) if value >> 63 else value


def read_frame(function, mnemonic, operands):
    if mnemonic.startswith("push"):
        function.frame += 8
    elif operands.endswith(",%rsp"):
        step = re.match(r"\$(0x[0-9a-f]+),%rsp$", operands)
        down = re.match(r"-(0x[0-9a-f]+)\(%rsp\),%rsp$", operands)
        if mnemonic.startswith("sub"):
            function.unbounded = function.unbounded or step is None
            function.frame += max(signed(step[1]), 0) if step else 0
        elif mnemonic.startswith("add") and step:
            function.frame += max(-signed(step[1]), 0)
        elif mnemonic.startswith("and") and step:
            function.frame += max(-signed(step[1]), 0)
        elif mnemonic.startswith("lea") and down:
            function.frame += int(down[1], 16)


def read(objdump, files):
    """{(object, name): Function} of all functions, and {name: object} of those that others can call."""
    functions, owner = {}, {}
    for path in files:
        if "file format elf64-x86-64" not in subprocess.run([objdump, "-f", path], capture_output=True, text=True, check=True).stdout:
            raise Refused(f"{path} is not of x86-64")
        text = subprocess.run([objdump, "-dr", "--no-show-raw-insn", path], capture_output=True, text=True, check=True).stdout
        where, at, branch, printed = path, None, None, None
        for line in text.splitlines():
            if match := OBJECT.match(line):
                where = match[1]
            elif match := FUNCTION.match(line):
                at = functions.setdefault((where, match[1]), Function())
                owner[match[1]] = where
                branch = None
            elif match := RELOCATION.match(line):
                if branch is not None:
                    branch.callees.discard(printed)  # Whatever has that address before linking.
                    branch.callees.add(match[1])
                    branch = None
            elif at is not None and (match := INSTRUCTION.match(line)):
                mnemonic, operands = match[1], match[2].strip()
                branch = printed = None
                if mnemonic.startswith(("call", "jmp")):
                    branch = None if operands.startswith("*") else at
                    at.calls_pointer = at.calls_pointer or (branch is None and mnemonic.startswith("call"))
                    target = re.search(r"<([^>+]+)>$", operands)
                    if target and (mnemonic.startswith("call") or functions.get((where, target[1])) is not at):
                        printed = None if target[1] in at.callees else target[1]
                        at.callees.add(target[1])
                else:
                    read_frame(at, mnemonic, operands)
    return functions, owner


def depths(functions, owner, probing):
    """{(object, name): bytes}; raises Refused, but for calls of others if probing."""
    found, on_path = {}, []
    targets = [(key, caller) for key in functions for target, caller in TARGETS.items() if target in key[1]]
    for target in TARGETS:
        if not probing and not any(target in name for (_, name), _ in targets):
            raise Refused(f"no function is named {target} any more: TARGETS is out of date")

    def depth(key):
        if key in found:
            return found[key]
        if key in on_path:
            raise Refused(f"recursion: {' -> '.join(name for _, name in on_path[on_path.index(key):] + [key])}")
        function = functions[key]
        if function.unbounded:
            raise Refused(f"{key[1]} takes stack whose size its code does not tell")
        on_path.append(key)
        deepest = 0
        for target, caller in targets if function.calls_pointer else []:
            # What calls back calls what its embedder gave, not another one of its kind.
            if caller in key[1] and not ("CallbacksOfC" in key[1] and "CallbacksOfC" in target[1]):
                deepest = max(deepest, depth(target))
        for name in sorted(function.callees):
            callee = (key[0], name) if (key[0], name) in functions else (owner.get(name), name)
            if callee in functions:
                deepest = max(deepest, depth(callee))
            elif not ALLOWED.match(name) and not name.startswith(".") and not probing:
                raise Refused(f"{key[1]} calls {name}, which is not known")
        on_path.pop()
        found[key] = function.frame + deepest
        return found[key]

    for key in sorted(functions):
        depth(key)
    return found


def demangled(names):
    text = subprocess.run(["c++filt", "-p"], input="\n".join(names), capture_output=True, text=True, check=True).stdout
    return dict(zip(names, text.splitlines()))


def measure(objdump, files, probing=False):
    """{function: bytes}, the largest first; of functions that share a name, the largest."""
    found = depths(*read(objdump, files), probing)
    names = demangled([name for _, name in found])
    most = collections.defaultdict(int)
    for (_, name), size in found.items():
        if "(anonymous" not in names[name] and ".part" not in name and ".cold" not in name:
            most[names[name]] = max(most[names[name]], size)
    return dict(sorted(most.items(), key=lambda item: (-item[1], item[0])))


def main():
    objdump, archive, *rest = sys.argv[1:]
    listing = "--list" in rest
    probes = [word for word in rest if word != "--list"]
    for probe in probes:
        try:
            worst = max(measure(objdump, [probe], probing=True).values())
        except Refused:
            continue
        if worst <= LIMIT:
            sys.exit(f"stack_use.py does not refuse {probe}: the gate is broken")
    try:
        found = measure(objdump, [archive])
    except Refused as refused:
        sys.exit(f"stack: {refused}")
    if listing:
        for name, size in found.items():
            print(f"{size:7} {name}")
    over = [f"{name}: {size} bytes" for name, size in found.items() if size > LIMIT]
    if over:
        sys.exit(f"stack: over {LIMIT} bytes:\n  " + "\n  ".join(over))
    if len(found) < 50:
        sys.exit(f"stack: only {len(found)} functions found; is {archive} of x86-64?")
    print(f"{len(found)} functions, at most {max(found.values())} bytes of stack (limit {LIMIT})")


if __name__ == "__main__":
    main()
