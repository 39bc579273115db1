#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""code_format.py ROOT CLANG_FORMAT: every source is as clang-format would leave it.

To mend: clang-format -i the files that it names.
"""
import pathlib
import re
import subprocess
import sys

import tracked


def main():
    root, program = pathlib.Path(sys.argv[1]), sys.argv[2]
    checked = subprocess.run([program, "--dry-run", "--Werror", *map(str, tracked.code(root))], cwd=root,
                             capture_output=True, text=True, check=False)
    unlike = sorted(set(re.findall(r"^(\S+?):\d+:\d+: error:", checked.stderr, re.M)))
    for name in unlike:
        print(f"{name}: not as clang-format leaves it", file=sys.stderr)
    if checked.returncode and not unlike:
        print(checked.stderr, file=sys.stderr)
    return 1 if checked.returncode else 0


sys.exit(main())
