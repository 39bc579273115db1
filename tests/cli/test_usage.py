# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""How the command is called: help, version, and what it says to mistakes."""
import unittest

from command_case import CommandCase

SUBCOMMANDS = ("map", "fuse", "align", "eval", "fit-kernels", "query", "export", "info", "convert", "simulate", "doctor", "key")


class Usage(CommandCase):
    def test_help_has_an_example(self):
        for subcommand in SUBCOMMANDS:
            with self.subTest(subcommand):
                result = self.done(subcommand, "--help")
                self.assertIn(f"Example: tessera {subcommand} ", result.stdout)
                self.assertEqual("", result.stderr)

    def test_help_lists_the_subcommands(self):
        text = self.done("--help").stdout
        self.assertIn("Example: tessera ", text)
        for subcommand in SUBCOMMANDS:
            self.assertIn(subcommand, text)

    def test_version_everywhere(self):
        version = self.done("--version").stdout
        self.assertRegex(version, r"^tessera \d+\.\d+\.\d+\n$")
        for subcommand in SUBCOMMANDS:
            with self.subTest(subcommand):
                self.assertEqual(version, self.done(subcommand, "--version").stdout)

    def test_no_subcommand(self):
        self.refused(saying=("subcommand", "--help"))

    def test_unknown_subcommand(self):
        self.refused("paint", saying=("paint", "--help"))
        self.refused("paint", "--help", saying=("paint", "--help"))

    def test_unknown_option(self):
        self.refused("--loud", saying=("--loud", "--help"))
        for subcommand in SUBCOMMANDS:
            with self.subTest(subcommand):
                self.refused(subcommand, "--loud", saying=("--loud", "--help"))

    def test_a_folder_without_its_option(self):
        for subcommand in ("map", "eval", "play", "convert"):
            self.refused(subcommand, self.folder, saying=(f"give --dataset {self.folder}", f"{subcommand} --help"))
        self.assertNotIn("--dataset", self.refused("map", self.folder / "absent"))
        self.assertNotIn("--dataset", self.refused("export", self.folder))

    def test_option_without_its_value(self):
        self.refused("map", "--dataset", saying=("--dataset",))

    def test_option_given_twice(self):
        self.refused("export", "--map", "a", "--map", "b", "--format", "ply", "--out", "c", saying=("--map",))

    def test_missing_required_options(self):
        for subcommand, option in (("map", "--dataset"), ("eval", "--map"), ("query", "--map"), ("export", "--map"),
                                   ("info", "FILE"), ("simulate", "--out")):
            with self.subTest(subcommand):
                self.refused(subcommand, saying=(option,))

    def test_a_malformed_value_names_the_subcommands_help(self):
        self.refused("map", "--dataset", "a", "--out", "b", "--last", "2.5", saying=("--last", "2.5", "map --help"))
        self.refused("simulate", "--out", "b", "--scans", "x", saying=("--scans", "simulate --help"))

    def test_whole_numbers_are_decimal_and_never_clamped(self):
        required = {"map": ("--dataset", "a", "--out", "b"), "eval": ("--map", "a", "--dataset", "b"),
                    "export": ("--map", "a", "--format", "png", "--out", "b"), "simulate": ("--out", "b")}
        for subcommand, option in (("map", "--first"), ("map", "--last"), ("map", "--robot"), ("map", "--work-budget"),
                                   ("eval", "--first"), ("eval", "--last"), ("export", "--width"),
                                   ("simulate", "--robots"), ("simulate", "--scans"), ("simulate", "--seed")):
            for value in ("0x2", "1e3", "2.0", "", "+2", "18446744073709551616", "9" * 40, "--" + "9" * 40):
                with self.subTest(subcommand=subcommand, option=option, value=value):
                    message = self.refused(subcommand, *required[subcommand], f"{option}={value}", saying=(option,))
                    self.assertLess(len(message), 300)
        self.refused("simulate", "--out", "b", "--seed=-1", saying=("--seed", "from 0 to 18446744073709551615"))
        self.refused("map", "--dataset", "a", "--out", "b", "--work-budget=-1", saying=("--work-budget", "from 0 to"))

    def test_a_refusal_stays_one_line_whatever_is_typed(self):
        self.refused("info", "a\nb.tsm")
        self.refused("paint\nthe\ntown")
        self.refused("map", "--dataset", "a\nb", "--out", "c.tsm")


if __name__ == "__main__":
    unittest.main()
