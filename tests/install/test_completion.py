# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The completion, as bash itself uses it: the script that the command writes is read by bash, which is asked for words."""
import os
import re
import unittest

from install_case import SUBCOMMANDS, InstallCase

COMMAND = os.environ["TESSERA_COMMAND"]
# As readline does: it breaks words at = too, and calls the function that complete -p names.
ASK = r"""
source "$1"
shift
[[ $(complete -p tessera) == *' -F '* ]] || exit 9
function_name=$(complete -p tessera | sed 's/.* -F \([^ ]*\) .*/\1/')
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
"$function_name" tessera "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD-1]}"
printf '%s\n' "${COMPREPLY[@]}"
"""


class Completion(InstallCase):
    def setUp(self):
        super().setUp()
        self.needs("bash")
        self.script = self.folder / "tessera.bash"
        self.run_program(COMMAND, "pages", "--bash", self.script)
        self.work = self.folder / "work"
        (self.work / "folder").mkdir(parents=True)
        for name in ("a.tsm", "with space.tsm", "b.txt"):
            (self.work / name).write_text("")

    def complete(self, *words):
        answer = self.run_program("bash", "--norc", "-c", ASK, "ask", self.script, "tessera", *words, cwd=self.work)
        return set(answer.splitlines()) - {""}

    def test_the_script_is_sound(self):
        self.run_program("bash", "-n", self.script)
        self.assertNotIn("pages", self.complete(""))

    def test_subcommands(self):
        self.assertEqual(set(SUBCOMMANDS), {word for word in self.complete("") if not word.startswith("-")})
        self.assertEqual({"map"}, self.complete("m"))
        self.assertEqual({"new", "mission"}, self.complete("key", ""))
        self.assertLessEqual({"--fleet", "--robot", "--robots", "--dir"}, self.complete("key", "new", "--"))
        self.assertEqual(set(), self.complete("paint", ""))

    def test_every_option_of_every_help(self):
        for subcommand in (*SUBCOMMANDS, ""):
            with self.subTest(subcommand=subcommand):
                said = self.run_program(COMMAND, *([subcommand] if subcommand else []), "--help")
                options = set(re.findall(r"^  (?:-\w,)?(--[\w-]+)", said, re.M))
                self.assertEqual(options, self.complete(*([subcommand] if subcommand else []), "--"))

    def test_words_that_an_option_takes(self):
        self.assertEqual({"both", "top", "oblique"}, self.complete("export", "--view", ""))
        self.assertEqual({"oblique"}, self.complete("export", "--view", "o"))
        self.assertEqual({"oblique"}, self.complete("export", "--view", "=", "o"))
        self.assertEqual({"both", "top", "oblique"}, self.complete("export", "--view", "="))
        self.assertEqual({"contractive", "paper", "none"}, self.complete("fuse", "--diffusion", ""))
        self.assertEqual({"cameras", "none"}, self.complete("map", "--labels", ""))
        self.assertEqual({"lcm", "can", "none"}, self.complete("play", "--send-poses", ""))
        self.assertEqual(set(), self.complete("map", "--resolution", "") & {"on", "off"})

    def test_files_and_folders(self):
        maps = {"a.tsm", "with space.tsm", "folder"}
        self.assertEqual(maps, self.complete("export", "--map", ""))
        self.assertEqual(maps, self.complete("info", ""))
        self.assertEqual({"a.tsm"}, self.complete("fuse", "x.tsm", "a"))
        self.assertEqual({"folder"}, self.complete("map", "--dataset", ""))
        self.assertEqual(maps | {"b.txt"}, self.complete("map", "--poses", ""))
        self.assertEqual(maps | {"b.txt", "lcm", "can", "none"}, self.complete("play", "--poses", ""))

    def test_an_option_that_takes_many(self):
        self.assertEqual({"a.tsm"}, self.complete("export", "--of", "x.tsm", "y.tsm", "a"))
        self.assertEqual({"a.tsm"}, self.complete("eval", "--overlap-of", "x.tsm", "a"))
        # Two and no more.
        self.assertEqual(set(), self.complete("eval", "--overlap-of", "x.tsm", "y.tsm", "a"))
        self.assertEqual({"--of"}, self.complete("export", "--of", "x.tsm", "--of"))

    def test_words_are_those_that_the_command_takes(self):
        """A wrong word is refused with all that are allowed, where an option has such words."""
        given = {"export": ("--map", "a.tsm", "--out", "b", "--format", "png"), "map": ("--dataset", "folder", "--out", "b"),
                 "fuse": ("a.tsm", "b.tsm", "--out", "c"), "simulate": ("--out", "d"), "play": ("--dataset", "folder")}
        seen = 0
        for subcommand, rest in given.items():
            for option in sorted(self.complete(subcommand, "--")):
                words = self.complete(subcommand, option, "")
                if not words or words & {"a.tsm", "folder"} or option in ("--labels", "--downsample", "--scene") or any(
                        word.startswith("--") for word in words):
                    continue
                kept = [word for index, word in enumerate(rest) if option not in (word, rest[index - 1])]
                result = self.refused(subcommand, *kept, option, "no-such-word")
                for word in words:
                    self.assertIn(word, result, f"{subcommand} {option}")
                seen += 1
        self.assertGreater(seen, 12)

    def refused(self, *words):
        result = self.run_program("sh", "-c", '"$@" 2>&1 && exit 1 || exit 0', "sh", COMMAND, *words, cwd=self.work)
        self.assertIn("no-such-word", result)
        return result


if __name__ == "__main__":
    unittest.main()
