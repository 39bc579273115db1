#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""worst.py --build FOLDER [--out FILE] [--check | --record]: what each public call costs on the input that costs it most.

Operations and times from a run as it is, instructions from one under callgrind, stack from the machine code. --check fails
if operations are over their formula or other than on record, or instructions over the record by more than SLACK or far
under it; --record takes them as the record."""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
RECORD = HERE / "worst" / "record.json"
sys.path.insert(0, str(HERE.parent / "tests" / "gates"))
import stack_use  # noqa: E402

# Other versions of the C library's memcpy, and of the compiler. Far fewer than on record is a fault too: either the record
# is out of date, or the input is not the worst one any more.
SLACK = 0.05
FEWER = 0.2
REPETITIONS = 5
# What a case may cost of what another does: a map that is full, and one that is not.
MOST_OF = {
    "scans_full_map": ("scans_fit", 1.3),
    "carving_scans_full_map": ("carving_scans_fit", 1.3),
    "integrate_rays_full_map": ("integrate_rays", 1.5),
}


def instructions(command, folder):
    """{case: instructions} of one run of a command under callgrind, which gets the file to write and a number of repetitions."""
    subprocess.run(["valgrind", "--tool=callgrind", "--instr-atstart=no", f"--callgrind-out-file={folder / 'counts'}", *command,
                    folder / "counted.json", "1"], check=True, capture_output=True)
    found = {}
    for part in folder.glob("counts.*"):
        text = part.read_text()
        name = re.search(r"^desc: Trigger: Client Request: (\S+)", text, re.M)
        total = re.search(r"^(?:summary|totals): (\d+)", text, re.M)
        if name and total:
            found[name[1]] = int(total[1])
    return found


def stack(build, call):
    """Bytes of stack of the deepest of the functions that call names; None where all of it is in the caller's code."""
    if not hasattr(stack, "found"):
        try:
            stack.found = stack_use.measure("objdump", [build / "lib" / "libtessera.a"])
        except (stack_use.Refused, FileNotFoundError, subprocess.CalledProcessError):
            stack.found = {}
    sizes = [stack.found[f"tessera::{name}"] for name in call.split(", ") if f"tessera::{name}" in stack.found]
    return max(sizes, default=None)


def measure(build, count_instructions=True):
    """{case: {call, input, formula, calls, operations, bound, ns, instructions, stack_bytes}}."""
    program = build / "bench" / "worst_cases"
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        done = subprocess.run([program, folder / "timed.json", str(REPETITIONS if count_instructions else 1)], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"worst_cases: {done.stderr.strip() or 'failed'}")
        found = json.loads((folder / "timed.json").read_text())
        counted = instructions([program], folder) if count_instructions and shutil.which("valgrind") else {}
    for case, figures in found.items():
        figures["instructions"] = counted[case] / figures["calls"] if case in counted else None
        figures["stack_bytes"] = stack(build, figures["call"])
    return found


def has_wide_lanes():
    """Whether the core uses AVX2 here, where it has code for it: as on record."""
    return re.search(r"^flags\s*:.*\bavx2\b", pathlib.Path("/proc/cpuinfo").read_text(), re.M) is not None


def faults(found, record):
    wide = has_wide_lanes()
    lines = [f"{case} is not on record" for case in found if case not in record]
    lines += [f"{case} is on record and was not measured" for case in record if case not in found]
    for case, figures in found.items():
        if case not in record:
            continue
        known = record[case]
        if figures["operations"] != known["operations"]:
            lines.append(f"{case}: {figures['operations']:,.1f} operations, on record {known['operations']:,.1f}")
        if figures["instructions"] is None:
            lines.append(f"{case}: instructions were not counted")
        elif not wide and "kernel" in case:
            continue
        elif figures["instructions"] > known["instructions"] * (1 + SLACK):
            lines.append(f"{case}: {figures['instructions']:,.0f} instructions, on record {known['instructions']:,.0f}")
        elif figures["instructions"] < known["instructions"] * (1 - FEWER):
            lines.append(f"{case}: {figures['instructions']:,.0f} instructions, far fewer than on record: {known['instructions']:,.0f}")
    for case, (other, most) in MOST_OF.items():
        counted, of = found[case]["instructions"], found[other]["instructions"]
        if counted is not None and counted > most * of:
            lines.append(f"{case}: {counted:,.0f} instructions, {counted / of:.2f} times those of {other}, which are {of:,.0f}: at most {most}")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True, type=pathlib.Path, help="folder that CMake built in")
    parser.add_argument("--out", type=pathlib.Path, help="JSON file to write")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--check", action="store_true", help="compare with what is on record")
    what.add_argument("--record", action="store_true", help="take what is found as the record")
    options = parser.parse_args()
    found = measure(options.build)
    if options.out:
        options.out.write_text(json.dumps(found, indent=1) + "\n")
    if options.record:
        record = {case: {key: figures[key] for key in ("operations", "instructions")} for case, figures in found.items()}
        RECORD.write_text(json.dumps(record, indent=1) + "\n")
    if options.check:
        record = json.loads(RECORD.read_text())
        # The comparison can fail: half of the record is refused.
        halved = {case: {**known, "instructions": known["instructions"] / 2} for case, known in record.items()}
        if len(faults(found, halved)) < len(found) / 2:
            sys.exit("worst.py does not see instructions that doubled")
        wrong = faults(found, record)
        if wrong:
            sys.exit("\n".join(wrong) + "\nIf that is on purpose: bench/worst.py --build build/release --record")
    for case, figures in found.items():
        counted = "-" if figures["instructions"] is None else f"{figures['instructions']:,.0f}"
        print(f"{case:32}{figures['operations']:>14,.0f} of {figures['bound']:>12,.0f} operations {counted:>14} instructions")


if __name__ == "__main__":
    main()
