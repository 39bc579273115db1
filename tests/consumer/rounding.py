# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""rounding.py ARCHIVE WORK FLAGS COMPILER...: compiles rounding.cpp, a user's unit, by each compiler at -O0 to -O3, links it with
the library and compares what it prints with the digests below. FLAGS: separated by spaces. Shows first that it refuses headers whose rounding
is a plain cast, if one of the compilers is the gcc that drops it."""

import pathlib
import re
import subprocess
import sys

GOLDEN = "925504ad13f642ea 221363ba18b347dd"
HERE = pathlib.Path(__file__).resolve().parent
HEADERS = HERE.parent.parent / "lib" / "include"


def printed(compiler: str, level: str, work: pathlib.Path, archive: str, flags: list[str]) -> str:
    program = work / f"rounding{level}"
    subprocess.run([compiler, "-std=c++20", "-ffp-contract=off", level, *flags, f"-I{HEADERS}", str(HERE / "rounding.cpp"),
                    archive, "-o", str(program)], check=True)
    return subprocess.run([str(program)], check=True, capture_output=True, text=True).stdout.strip()


def drops_roundings(compiler: str) -> bool:
    said = subprocess.run([compiler, "--version"], check=True, capture_output=True, text=True).stdout
    return "Free Software Foundation" in said and re.search(r"\b12\.\d+\.\d+\b", said.splitlines()[0]) is not None


def with_plain_cast(work: pathlib.Path) -> str:
    """A folder with a rounding.hpp whose barriers are gone, for the front of the include path."""
    folder = work / "plain" / "tessera" / "base" / "internal"
    folder.mkdir(parents=True, exist_ok=True)
    text, barriers = re.subn(r"__asm__\(.*\);", "", (HEADERS / "tessera" / "base" / "internal" / "rounding.hpp").read_text())
    assert barriers == 3, barriers
    (folder / "rounding.hpp").write_text(text)
    return f"-I{work / 'plain'}"


def main() -> None:
    archive, folder, flags, *compilers = sys.argv[1:]
    work = pathlib.Path(folder)
    work.mkdir(parents=True, exist_ok=True)
    failed = False
    for compiler in compilers:
        if drops_roundings(compiler):
            got = printed(compiler, "-O2", work, archive, [with_plain_cast(work), *flags.split()])
            print(f"{compiler} -O2, plain casts: {got}")
            assert got != GOLDEN, "this gate does not notice a dropped rounding"
    for compiler in compilers:
        for level in ("-O0", "-O1", "-O2", "-O3"):
            got = printed(compiler, level, work, archive, flags.split())
            print(f"{compiler} {level}: {got}")
            failed |= got != GOLDEN
    if failed:
        sys.exit(f"expected {GOLDEN} everywhere")


if __name__ == "__main__":
    main()
