# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Tables and numbers as the documentation has them."""
import textwrap


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows])


def paragraph(text):
    """In lines as long as the pages may have."""
    return textwrap.fill(text, 160, break_long_words=False, break_on_hyphens=False)


def number(value, digits=3):
    """Formats value with that many significant digits, and separated thousands."""
    if value == 0:
        return "0"
    decimals = max(0, digits - 1 - int(f"{abs(value):e}".partition("e")[2]))
    return f"{value:,.{decimals}f}"
