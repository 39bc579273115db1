# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""cmake --install, to a prefix and with DESTDIR."""
import gzip
import unittest

from install_case import BUILD, CMAKE, COMMAND_FILES, DEVELOPMENT_FILES, SUBCOMMANDS, VERSION, InstallCase, files_below

UNIT = "lib/systemd/system/tessera-node@.service"


class Prefix(InstallCase):
    def install(self, prefix, **environment):
        self.run_program(CMAKE, "--install", BUILD, "--prefix", prefix, **environment)

    def test_what_is_installed_and_nothing_else(self):
        prefix = self.folder / "prefix"
        self.install(prefix)
        self.assertEqual(COMMAND_FILES | DEVELOPMENT_FILES, files_below(prefix))
        self.assertEqual(f"tessera {VERSION}\n", self.run_program(prefix / "bin/tessera", "--version"))
        programs, configurations = self.unit_paths((prefix / UNIT).read_text())
        self.assertEqual(({str(prefix / "bin/tessera")}, {str(prefix / "etc/tessera/%i.toml")}), (programs, configurations))

    def test_destdir_is_in_no_file(self):
        root = self.folder / "root"
        self.install("/usr", DESTDIR=str(root))
        self.assertEqual({"usr"}, {path.name for path in root.iterdir()})
        self.assertEqual(COMMAND_FILES | DEVELOPMENT_FILES, files_below(root / "usr"))
        programs, configurations = self.unit_paths((root / "usr" / UNIT).read_text())
        self.assertEqual(({"/usr/bin/tessera"}, {"/etc/tessera/%i.toml"}), (programs, configurations))
        for name in files_below(root / "usr"):
            if "/lib/" in f"/{name}" and not name.endswith(".a"):
                self.assertNotIn(str(self.folder), (root / "usr" / name).read_text(), name)

    def test_a_moved_prefix_works_by_pkg_config_and_by_cmake(self):
        self.needs("pkg-config")
        self.install(self.folder / "first")
        moved = self.folder / "elsewhere"
        (self.folder / "first").rename(moved)
        self.assertEqual(f"tessera {VERSION}\n", self.consumer_by_pkg_config(moved))
        self.assertEqual(f"tessera {VERSION}\n", self.consumer_by_cmake(moved))

    def test_manual_pages_have_no_warnings_and_every_option(self):
        self.needs("man")
        prefix = self.folder / "prefix"
        self.install(prefix)
        pages = sorted((prefix / "share/man/man1").iterdir())
        self.assertEqual(1 + len(SUBCOMMANDS), len(pages))
        for page in pages:
            with self.subTest(page=page.name):
                words = ("man", "--local-file", "--warnings", "-E", "UTF-8", page)
                shown = self.run_program("sh", "-c", 'exec "$@" 2>&1', "sh", *words, MANWIDTH="100", LC_ALL="C.UTF-8")
                self.assertNotIn("warning", shown.lower().replace("warnings, if any", ""))
                self.assertIn("EXIT STATUS", shown)
                subcommand = page.name.partition(".")[0].removeprefix("tessera").removeprefix("-")
                said = self.run_program(prefix / "bin/tessera", *([subcommand] if subcommand else []), "--help")
                source = gzip.decompress(page.read_bytes()).decode().replace("\\-", "-")
                for word in said.split():
                    if word.startswith("--") and word != "--":
                        self.assertIn(word, source)


if __name__ == "__main__":
    unittest.main()
