# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Installs into folders of its own, and builds a user's program against what is there."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

CMAKE, CXX, CC = (os.environ[name] for name in ("TESSERA_CMAKE", "TESSERA_CXX", "TESSERA_CC"))
BUILD = pathlib.Path(os.environ["TESSERA_BUILD"])
VERSION = os.environ["TESSERA_VERSION"]
SOURCE = pathlib.Path(__file__).resolve().parents[2]
CONSUMER = SOURCE / "tests/consumer"
SUBCOMMANDS = ("align", "convert", "doctor", "eval", "export", "fit-kernels", "fuse", "info", "key", "map", "node", "play", "query", "simulate", "view")

# Of the package tessera, below /usr: what people and other programs look for under these names.
COMMAND_FILES = {
    "bin/tessera",
    "lib/systemd/system/tessera-node@.service",
    "lib/sysusers.d/tessera.conf",
    "share/bash-completion/completions/tessera",
    "share/man/man1/tessera.1.gz",
    *(f"share/man/man1/tessera-{name}.1.gz" for name in SUBCOMMANDS),
    *(f"share/tessera/lcmtypes/{path.name}" for path in (SOURCE / "lcmtypes").glob("*.lcm")),
    "share/tessera/can/tessera.dbc",
    *(f"share/doc/tessera/{path.relative_to(SOURCE / 'docs')}" for kind in ("*.md", "*.png") for path in (SOURCE / "docs").rglob(kind)
      if path.name != "changelog.md"),
    "share/doc/tessera/copyright",
    "share/doc/tessera/changelog.gz",
}
# Of libtessera-dev.
DEVELOPMENT_FILES = {
    "lib/libtessera.a",
    "lib/pkgconfig/tessera.pc",
    *(f"lib/cmake/tessera/{name}" for name in
      ("tesseraConfig.cmake", "tesseraConfigVersion.cmake", "tessera-targets.cmake", "tessera-targets-release.cmake",
       "tesseraRounding.cmake", "rounding_probe.cpp")),
    "include/tessera/base/version.hpp",
    *(str(path.relative_to(SOURCE / "lib")) for kind in ("*.hpp", "*.h") for path in (SOURCE / "lib/include").rglob(kind)),
    "share/doc/libtessera-dev/copyright",
    "share/doc/libtessera-dev/changelog.gz",
}


def files_below(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if not path.is_dir()}


class InstallCase(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="tessera-install-")
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def run_program(self, *words, cwd=None, **environment):
        result = subprocess.run([str(word) for word in words], cwd=cwd or self.folder, env={**os.environ, **environment},
                                text=True, capture_output=True, stdin=subprocess.DEVNULL, timeout=300, check=False)
        self.assertEqual(0, result.returncode, f"{words}\n{result.stdout}{result.stderr}")
        return result.stdout

    def needs(self, *programs):
        for program in programs:
            if shutil.which(program) is None:
                self.skipTest(f"skipped: {program} is not installed")

    def consumer_by_pkg_config(self, prefix):
        """Builds tests/consumer without CMake, by what pkg-config says of the tessera in prefix. Gives what it prints."""
        path = {"PKG_CONFIG_PATH": str(prefix / "lib/pkgconfig")}
        self.assertEqual(VERSION, self.run_program("pkg-config", "--modversion", "tessera", **path).strip())
        flags = self.run_program("pkg-config", "--cflags", "tessera", **path).split()
        libraries = self.run_program("pkg-config", "--libs", "tessera", **path).split()
        self.assertIn("-ffp-contract=off", flags)
        self.assertNotIn("-std", " ".join(flags), "the standard is the user's to choose")
        # Of the prefix that is asked, wherever that was moved; pkg-config leaves /usr/include and /usr/lib out itself.
        self.assertIn(prefix.resolve(), [pathlib.Path(flag[2:]).resolve().parent for flag in flags if flag.startswith("-I")])
        program = self.folder / "by_pkg_config"
        self.run_program(CXX, "-std=c++20", *flags, CONSUMER / "consumer.cpp", *libraries, "-o", program)
        return self.run_program(program)

    def consumer_by_cmake(self, prefix):
        build = self.folder / "by_cmake"
        self.run_program(CMAKE, "-S", CONSUMER, "-B", build, "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}",
                         f"-DCMAKE_CXX_COMPILER={CXX}", f"-DCMAKE_C_COMPILER={CC}")
        self.assertIn(str(prefix), (build / "CMakeCache.txt").read_text())
        self.run_program(CMAKE, "--build", build)
        return self.run_program(build / "consumer")

    def unit_paths(self, text):
        """Programs and configurations that the unit names."""
        lines = [line.partition("=")[2].split() for line in text.splitlines() if line.startswith("ExecStart")]
        self.assertEqual(2, len(lines))
        return {line[0] for line in lines}, {line[-1] for line in lines}
