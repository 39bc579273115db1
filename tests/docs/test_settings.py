# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The tables of options, settings and counters in docs/reference are those of the program. "python3 tests/docs/test_settings.py --write" writes them anew
(TESSERA_COMMAND: the command that has them).

Each stands below a line <!-- settings: NAME -->; NAME is a heading of what "tessera pages --tables" writes.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ("docs/reference/cli.md", "docs/reference/counters.md", "docs/reference/node.md")
TABLE = re.compile(r"<!-- settings: (.*?) -->\n\n((?:\|.*\n)+)")


def tables():
    """{name: table}"""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "tables.md")
        subprocess.run([os.environ["TESSERA_COMMAND"], "pages", "--tables", str(path)], check=True)
        parts = re.split(r"^## (.*)\n", path.read_text(), flags=re.M)[1:]
    return {name: body.strip() + "\n" for name, body in zip(parts[::2], parts[1::2])}


def pages():
    return {path: (ROOT / path).read_text() for path in PAGES}


class Settings(unittest.TestCase):
    def test_each_table_is_that_of_the_program(self):
        self.maxDiff = None
        made = tables()
        found = {}
        for text in pages().values():
            for name, table in TABLE.findall(text):
                self.assertNotIn(name, found)
                found[name] = table
        self.assertEqual(found.keys(), made.keys())
        for name, table in made.items():
            self.assertEqual(found[name], table, f'{name}: run "python3 tests/docs/test_settings.py --write"')


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        made = tables()
        for path, text in pages().items():
            (ROOT / path).write_text(TABLE.sub(lambda m: f"<!-- settings: {m[1]} -->\n\n{made[m[1]]}", text))
    else:
        unittest.main()
