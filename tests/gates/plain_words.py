#!/usr/bin/env python3
# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""plain_words.py ROOT: the words of the field, in pages, the library, the platform and the examples. Each expression below was written
for something that the field has a word for, which stands beside it."""
import pathlib
import re
import sys

import tracked

WORDS = {
    r"\bhangs? on\b": "depends on",
    r"\b(is|are) told\b(?! apart)": "receives, is notified, is given",
    r"\btold and tells\b": "inputs and outputs",
    r"\bsends for\b": "prefetches, requests",
    r"\b(speaks|spoken) for\b": "reserves, reserved",
    r"\bof no use\b": "invalid, unusable, has no effect",
    r"\bgo not together\b": "are mutually exclusive",
    r"\bis there twice\b": "duplicate",
    r"\bcounts? for nothing\b": "is ignored",
    r"\bsay(s)? nothing of\b": "does not mention",
    r"(?<!one )(?<!free )\bpass(es|ed)? over (it|them|label|what)\b": "skips, ignores",
    r"\bis passed over\b": "is skipped, is ignored",
    r"\bhalf as many again\b|\bhalf as much again\b": "1.5 times",
    r"\bin so many words\b": "explicitly",
    r"\bso-and-so-m": "every n-th",
    r"\baskance\b": "oblique",
    r"\bbehind your back\b": "silently",
    r"\bwho is meant\b": "addressing",
    r"\bwhen all is told\b": "once everything is shared",
    r"\bis no keyword of\b": "unknown keyword",
    r"\bgo on from\b": "continue",
    r"\blies? in its hands\b": "is up to",
}
# As above, for what people read at a terminal or in a log: messages, help, pages of the browser, and the code that makes them.
WORDS_OF_PROGRAMS = {
    r"\bin vain\b": "unsuccessfully, without effect",
    r"\banew\b": "again, from the start",
    r"\bat hand\b": "available",
    r"\blacks\b": "has no",
    r"\b(goes|go) on( with)?\b": "continues, resumes",
    r"\bso many\b": "that many, the number",
    r"\bwhoever\b": "every process that, everyone who",
    r"\bsign of life\b": "does not respond",
    r"\bspeaks? as\b": "uses the number of",
    r"\bthe (map|file|one) of before\b": "the earlier, the previous",
    r"\bthere is no (option|subcommand|table)\b": "unknown option, ...",
    r"(?<!there )\bis no (map|scan|file|number|key|folder|PNG|PLY|PCD|image|archive|keyword|picture|recording)\b": "is not a",
}
PROGRAMS = ("platform/", "examples/", "lcmtypes/")
WHERE = ("README.md", "docs/", "lib/include/", "lib/src/", *PROGRAMS)
SUFFIXES = (*tracked.CODE, ".md", ".py", ".pyi", ".js", ".html", ".sh", ".in", ".txt", ".lcm")


def line_faults(line, words=WORDS):
    for pattern, instead in words.items():
        for match in re.finditer(pattern, line, re.I):
            yield f'"{match.group(0)}": {instead}'


def faults(root):
    for path in tracked.files(root):
        name = str(path)
        if not name.startswith(WHERE) or path.suffix not in SUFFIXES:
            continue
        words = {**WORDS, **WORDS_OF_PROGRAMS} if name.startswith(PROGRAMS) else WORDS
        text = tracked.text(root, path)
        words = {pattern: instead for pattern, instead in words.items() if re.search(pattern, text, re.I)}
        for number, line in enumerate(text.splitlines(), 1):
            yield from (f"{name}:{number}: {fault}" for fault in line_faults(line, words))


def main():
    assert list(line_faults("Time hangs on the machine"))
    assert list(line_faults("A block that left the map is told by nobody"))
    assert not list(line_faults("so that the two are told apart"))
    assert not list(line_faults("Times depend on the machine"))
    assert not list(line_faults("An estimate lacks evidence"))
    assert list(line_faults("the file lacks a header", WORDS_OF_PROGRAMS))
    found = list(faults(pathlib.Path(sys.argv[1])))
    print("\n".join(found), file=sys.stderr)
    return 1 if found else 0


sys.exit(main())
