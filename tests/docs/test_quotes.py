# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The C++ that docs/tasks/embedding.md quotes is that of the examples, which are compiled and run."""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Quotes(unittest.TestCase):
    def test_each_is_part_of_an_example(self):
        code = [path.read_text() for path in sorted((ROOT / "examples").glob("*.[ch]pp"))]
        quotes = re.findall(r"```cpp\n(.*?)```", (ROOT / "docs/tasks/embedding.md").read_text(), flags=re.S)
        self.assertGreater(len(quotes), 5)
        for quote in quotes:
            with self.subTest(quote.splitlines()[0]):
                self.assertTrue(any(quote in text for text in code), quote)


if __name__ == "__main__":
    unittest.main()
