# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""docs/reference/versioning.md names the numbers that the sources have."""
import os
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs/reference/versioning.md").read_text()
GENERATED = pathlib.Path(os.environ["TESSERA_BUILD"]) / "lcmtypes/generated"


def found(path, pattern):
    match = re.search(pattern, (ROOT / path).read_text())
    return ".".join(match.groups()) if match else f"nothing in {path}"


def fingerprint(text):
    """As LCM 1.3.1's generated code computes it; none of our types holds another."""
    number = int(re.search(r"uint64_t hash = (0x[0-9a-f]+)LL", text)[1], 16)
    return f"{((number << 1) + (number >> 63)) % 2**64:016x}"


class Versions(unittest.TestCase):
    def test_numbers(self):
        told = dict(re.findall(r"^\| ([^|]+) \| (\d[\d.]*) \|", PAGE, re.M))
        self.assertEqual({
            "tessera": found("CMakeLists.txt", r"project\(tessera VERSION ([\d.]+)"),
            "C API (`TESSERA_API_VERSION`)": found("lib/include/tessera/tessera.h", r"TESSERA_API_VERSION (\d+)u"),
            "C ABI (`TESSERA_ABI_VERSION`)": found("lib/include/tessera/tessera.h", r"TESSERA_ABI_VERSION (\d+)u"),
            "map file, `.tsm`": found("lib/src/map/map_file_format.hpp", r"kMapMajor = (\d+);[^;]*kMapMinor = (\d+);"),
            "archive, `blocks.tsa`": found("platform/maps/archive_format.hpp", r"kMajor = (\d+);[^;]*kMinor = (\d+);"),
            "wire format between robots": found("lib/src/exchange/wire.cpp", r"kFormat = (\d+);"),
            "key files": found("platform/link/key_text.cpp", r'take_word\(rest\) != "(\d+)"'),
            "layout of the CAN bus": found("platform/vehicle/bus_messages.hpp", r"kBusLayoutVersion = (\d+);"),
        }, told)

    def test_fingerprints(self):
        told = dict(re.findall(r"^\| `(tessera_\w+)` \| ([0-9a-f]{16}) \|", PAGE, re.M))
        made = {path.stem: fingerprint((GENERATED / f"{path.stem}.hpp").read_text()) for path in (ROOT / "lcmtypes").glob("*.lcm")}
        self.assertEqual(made, told)

    def test_the_command_is_of_this_version(self):
        said = subprocess.run([os.environ["TESSERA_COMMAND"], "--version"], check=True, text=True, capture_output=True).stdout
        self.assertEqual("tessera " + found("CMakeLists.txt", r"project\(tessera VERSION ([\d.]+)") + "\n", said)


if __name__ == "__main__":
    unittest.main()
