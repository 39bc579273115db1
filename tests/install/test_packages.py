# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The Debian packages: made, looked at by lintian, unpacked, installed by dpkg into a root of their own, and used."""
import os
import pathlib
import re
import subprocess
import unittest

from install_case import BUILD, CMAKE, COMMAND_FILES, DEVELOPMENT_FILES, VERSION, InstallCase, files_below

FILES = {"tessera": COMMAND_FILES | {"share/doc/tessera/changelog.Debian.gz"},
         "libtessera-dev": DEVELOPMENT_FILES | {"share/doc/libtessera-dev/changelog.Debian.gz"}}
# What lintian may say, and why it stays so. It must say each of them, so that none is here for nothing.
WARNINGS = {
    "initial-upload-closes-no-bugs": "they are for whoever makes them; nobody has asked Debian for them",
    "pkg-config-unavailable-for-cross-compilation": "as the library itself: in /usr/lib, so for the machine that it was built for",
}


class Packages(InstallCase):
    def setUp(self):
        super().setUp()
        self.needs("cpack", "dpkg-deb", "dpkg-shlibdeps")
        made = self.folder / "made"
        self.run_program(pathlib.Path(CMAKE).with_name("cpack"), "-G", "DEB", "--config", BUILD / "CPackConfig.cmake", "-B", made)
        self.packages = {path.name.partition("_")[0]: path for path in made.glob("*.deb")}
        self.assertEqual(set(FILES), set(self.packages))

    def field(self, package, name):
        return self.run_program("dpkg-deb", "--field", self.packages[package], name).strip()

    def test_packages(self):
        """One test, as making them takes most of its time."""
        with self.subTest("the version is the project's, dependencies are what the command loads"):
            for package in FILES:
                self.assertEqual(f"{VERSION}-1", self.field(package, "Version"))
            depends = self.field("tessera", "Depends")
            for library in ("libc6", "libstdc++6", "libpng16-16", "libsodium23", "liblzf1"):
                self.assertIn(library, depends)
            self.assertNotIn("-dev", depends)
            self.assertRegex(self.field("libtessera-dev", "Depends"), r"^libeigen3-dev \(>= 3\.3\)$")

        roots = {}
        for package, path in self.packages.items():
            with self.subTest("contents", package=package):
                roots[package] = self.folder / f"unpacked-{package}"
                self.run_program("dpkg-deb", "-x", path, roots[package])
                self.assertEqual({f"usr/{name}" for name in FILES[package]}, files_below(roots[package]))
        with self.subTest("the unit names what the package installs"):
            unit = (roots["tessera"] / "usr/lib/systemd/system/tessera-node@.service").read_text()
            self.assertEqual(({"/usr/bin/tessera"}, {"/etc/tessera/%i.toml"}), self.unit_paths(unit))
        with self.subTest("the command runs from where it was unpacked"):
            self.assertEqual(f"tessera {VERSION}\n", self.run_program(roots["tessera"] / "usr/bin/tessera", "--version"))
        self.lintian()
        self.installed_by_dpkg()

    def lintian(self):
        with self.subTest("lintian"):
            self.needs("lintian")
            result = subprocess.run(["lintian", "--allow-root", "--no-cfg", "--fail-on", "error", *self.packages.values()], text=True,
                                    capture_output=True, timeout=300, check=False)
            said = re.findall(r"^([EWX]): \S+: (\S+)", result.stdout, re.M)
            self.assertEqual([], [tag for kind, tag in said if kind == "E"], result.stdout)
            self.assertEqual(set(WARNINGS), {tag for _, tag in said}, result.stdout)

    def installed_by_dpkg(self):
        with self.subTest("dpkg installs, and a user's program is built against it"):
            self.needs("pkg-config")
            if os.geteuid() != 0:
                self.skipTest("skipped: dpkg installs as root only")
            root = self.folder / "root"
            for folder in ("var/lib/dpkg/updates", "var/lib/dpkg/info", "etc"):
                (root / folder).mkdir(parents=True)
            (root / "var/lib/dpkg/status").write_text("")
            dpkg = ("dpkg", f"--root={root}", "--force-script-chrootless", "--force-depends", "--log=/dev/null")
            self.run_program(*dpkg, "--install", *self.packages.values())
            state = self.run_program("dpkg-query", f"--admindir={root}/var/lib/dpkg", "-W", "-f", "${Package} ${db:Status-Status}\n")
            self.assertEqual({f"{package} installed" for package in FILES}, set(state.split("\n")) - {""})
            self.assertEqual(f"tessera {VERSION}\n", self.consumer_by_pkg_config(root / "usr"))
            self.assertEqual(f"tessera {VERSION}\n", self.consumer_by_cmake(root / "usr"))
            self.run_program(*dpkg, "--purge", *FILES)
            self.assertEqual(set(), files_below(root / "usr") if (root / "usr").exists() else set())


if __name__ == "__main__":
    unittest.main()
