# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Which state of the sources is measured."""
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent


def git(*arguments):
    done = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True)
    return done.stdout.strip() if done.returncode == 0 else ""


def commit():
    """Such as "cb9cc7577fd4", or "cb9cc7577fd4 with changes" where code is not as committed."""
    changed = [line for line in git("status", "--porcelain", "-uno").splitlines() if not line.endswith((".md", ".png"))]
    return (git("rev-parse", "--short=12", "HEAD") or "unknown") + (" with changes" if changed else "")
