# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The files of the project, for the gates that read them: what git tracks or would, or all if this is no checkout."""
import pathlib
import subprocess

CODE = (".hpp", ".cpp", ".h", ".c")


def files(root):
    """Paths below root, relative to it, sorted. Built, generated and ignored files are not among them."""
    git = subprocess.run(["git", "-C", str(root), "ls-files", "--cached", "--others", "--exclude-standard"],
                         capture_output=True, text=True, check=False) if (root / ".git").exists() else None
    if git and git.returncode == 0:
        found = [pathlib.PurePosixPath(line) for line in git.stdout.splitlines()]
    else:  # an archive of the sources, or a checkout that git refuses to read
        found = [pathlib.PurePosixPath(path.relative_to(root).as_posix()) for path in root.rglob("*")]
        found = [path for path in found if path.parts[0] not in ("build", "out", ".git")]
    return sorted(path for path in found if (root / path).is_file())


def code(root):
    return [path for path in files(root) if path.suffix in CODE]


def text(root, path):
    """None if the file is not text."""
    try:
        return (root / path).read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return None
