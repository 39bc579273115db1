# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Links between the pages lead somewhere, and docs/reference/cli.md has the options that --help has."""
import os
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), *sorted(ROOT.glob("*/README.md"))]
LINK = re.compile(r"\]\(([^)\s]+)\)")


def anchors(page):
    """Of its headings, as those who show Markdown name them."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S)
    return {re.sub(r"[^\w\- ]", "", line).lower().replace(" ", "-") for line in re.findall(r"^#+ +(.*)$", text, re.M)}


def faults(page):
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S)
    for target in LINK.findall(text):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        where = (page.parent / name).resolve() if name else page
        if not where.exists():
            yield f"{page.relative_to(ROOT)}: {target}: no such file"
        elif anchor and anchor not in anchors(where):
            yield f"{page.relative_to(ROOT)}: {target}: no such heading"


class Links(unittest.TestCase):
    def test_links_lead_somewhere(self):
        self.assertEqual([], [fault for page in PAGES for fault in faults(page)])

    def test_every_page_is_in_the_contents(self):
        contents = ROOT / "docs/README.md"
        linked = {(contents.parent / target).resolve() for target in LINK.findall(contents.read_text())}
        self.assertEqual(set(), {*(ROOT / "docs").rglob("*.md")} - linked - {contents})

    def test_options(self):
        text = (ROOT / "docs/reference/cli.md").read_text()
        sections = dict(re.findall(r"^## (\w+)\n(.*?)(?=^## |\Z)", text, re.M | re.S))
        help_of = lambda *words: subprocess.run([os.environ["TESSERA_COMMAND"], *words, "--help"], check=True, text=True,
                                                capture_output=True).stdout
        shown = re.findall(r"^  (\w+) {2,}", help_of().partition("Subcommands:")[2], re.M)
        self.assertGreater(len(shown), 9)
        everywhere = {"--help", "--version"}
        for subcommand in shown:
            with self.subTest(subcommand):
                said = set(re.findall(r"--[a-z][\w-]*", help_of(subcommand) + ("".join(help_of("key", inner) for inner in ("new", "mission")) if subcommand == "key" else "")))
                page = sections[subcommand] if subcommand != "node" else sections["node"] + (ROOT / "docs/reference/node.md").read_text()
                table = set(re.findall(r"`(--[a-z][\w-]*)", page)) | set(re.findall(r"^    tessera .*", page, re.M) and
                                                                         re.findall(r"(--[a-z][\w-]*)", page))
                self.assertEqual(set(), said - everywhere - table, "of --help, not on the page")
                rows = set(re.findall(r"--[a-z][\w-]*", "\n".join(re.findall(r"^\| (`--[^|]*)\|", page, re.M))))
                self.assertEqual(set(), rows - said, "on the page, not of --help")


if __name__ == "__main__":
    unittest.main()
