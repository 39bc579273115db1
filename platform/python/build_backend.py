# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The build backend for pip (PEP 517): builds the module with CMake and writes the wheel. Needs only the standard library,
CMake, a compiler and some Debian packages, which it names if one is missing; never uses the network.

--config-settings=build-dir=FOLDER: the build folder, which is kept, and used as it is if it was configured; default
build/python. --config-settings=jobs=N: parallel compilers; default: as many as processors.
--config-settings=cmake-args=...: more arguments for configuring with CMake."""
import base64
import hashlib
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
NAME = "tessera"
# What CMake may fail to find, and the Debian package that has it.
DEBIAN = {"Eigen3": "libeigen3-dev", "nlohmann_json": "nlohmann-json3-dev", "tomlplusplus": "libtomlplusplus-dev", "fmt": "libfmt-dev",
          "PNG": "libpng-dev", "liblzf": "liblzf-dev", "TESSERA_SODIUM_INCLUDE_DIR": "libsodium-dev", "TESSERA_SODIUM": "libsodium-dev", "pybind11": "pybind11-dev", "Python": "python3-dev",
          "CMAKE_CXX_COMPILER": "g++"}
# The same date in every wheel, so that the same files give the same wheel.
DATE = (1980, 1, 1, 0, 0, 0)


class UnsupportedOperation(Exception):
    """As defined by PEP 517."""


def fail(sentence):
    # pip shows what is printed, without a traceback of an exit.
    sys.exit(f"tessera: {sentence}")


def version():
    """The version of project() in the top CMakeLists.txt, the only place that has it."""
    found = re.search(r"^project\(tessera VERSION (\d+\.\d+\.\d+)", (ROOT / "CMakeLists.txt").read_text(), re.M)
    if not found:
        fail(f"{ROOT / 'CMakeLists.txt'} has no project(tessera VERSION ...)")
    return found[1]


def lacking(text):
    """The Debian packages that are missing by this output of CMake."""
    said = (r"package configuration file provided by \"{}\"", r"Could NOT find {}\b", r"\b{} is not set", r"No {} could be found",
            r"Could not find {} using")
    packages = {package for name, package in DEBIAN.items() if any(re.search(s.format(name), text) for s in said)}
    return sorted(packages | set(re.findall(r"apt-get install ([\w.+-]+(?: [\w.+-]+)*)", text)))


def run(command, what):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", check=False)
    print(done.stdout, flush=True)
    if done.returncode == 0:
        return
    packages = lacking(done.stdout)
    mend = f"sudo apt-get install {' '.join(packages)}" if packages else "the lines above say why"
    fail(f"{what} failed; {mend}")


def configuration(folder, more):
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    return ["-S", str(ROOT), "-B", str(folder), *generator, "-DCMAKE_BUILD_TYPE=Release",
            "-DCMAKE_CXX_FLAGS_RELEASE=-O3 -DNDEBUG", "-DTESSERA_BUILD_PYTHON=ON", "-DTESSERA_BUILD_PLATFORM=OFF",
            "-DTESSERA_BUILD_TESTS=OFF", "-DTESSERA_BUILD_BENCH=OFF", f"-DTESSERA_PYTHON={sys.executable}", *shlex.split(more)]


def built(settings):
    """The folder of the package, built."""
    if shutil.which("cmake") is None:
        fail("cmake is missing; sudo apt-get install cmake g++")
    folder = pathlib.Path(settings.get("build-dir") or ROOT / "build" / "python").resolve()
    if not (folder / "CMakeCache.txt").exists():
        run(["cmake", *configuration(folder, settings.get("cmake-args", ""))], "configuring")
    jobs = settings.get("jobs") or str(os.cpu_count() or 1)
    run(["cmake", "--build", folder, "--target", "tessera_python", "--parallel", jobs], "building")
    package = folder / "python" / NAME
    if not (package / f"_tessera{sysconfig.get_config_var('EXT_SUFFIX')}").exists():
        fail(f"{folder} has a module for another Python than {sys.executable}; name another build-dir")
    return package


def tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{re.sub(r'[-.]', '_', sysconfig.get_platform())}"


def metadata():
    return (f"Metadata-Version: 2.1\nName: {NAME}\nVersion: {version()}\n"
            "Summary: Dense semantic occupancy maps that teams of robots build and share\n"
            "License: Apache-2.0\nRequires-Python: >=3.10\nRequires-Dist: numpy\n")


def write_wheel(path, files):
    """files: (name in the wheel, its bytes)."""
    record = f"{NAME}-{version()}.dist-info/RECORD"
    rows = []
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as wheel:
        def add(name, content):
            info = zipfile.ZipInfo(name, DATE)
            info.external_attr = (0o755 if name.endswith(".so") else 0o644) << 16
            info.compress_type = zipfile.ZIP_DEFLATED
            wheel.writestr(info, content)
        for name, content in files:
            add(name, content)
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            rows.append(f"{name},sha256={digest},{len(content)}\n")
        add(record, ("".join(rows) + f"{record},,\n").encode())


def wheel_text():
    return f"Wheel-Version: 1.0\nGenerator: tessera\nRoot-Is-Purelib: false\nTag: {tag()}\n"


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    """For pip, which then need not build to know the name."""
    info = pathlib.Path(metadata_directory) / f"{NAME}-{version()}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(metadata())
    (info / "WHEEL").write_text(wheel_text())
    return info.name


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    package = built(config_settings or {})
    info = f"{NAME}-{version()}.dist-info"
    names = ["__init__.py", "_refusals.py", "_tessera.pyi", "py.typed", f"_tessera{sysconfig.get_config_var('EXT_SUFFIX')}"]
    files = [(f"{NAME}/{name}", (package / name).read_bytes()) for name in names]
    files += [(f"{info}/METADATA", metadata().encode()),
              (f"{info}/LICENSE", (ROOT / "LICENSE").read_bytes()),
              (f"{info}/WHEEL", wheel_text().encode())]
    name = f"{NAME}-{version()}-{tag()}.whl"
    part = pathlib.Path(wheel_directory) / (name + ".part")
    write_wheel(part, files)
    part.rename(part.with_name(name))
    return name


def build_sdist(sdist_directory, config_settings=None):
    raise UnsupportedOperation("there is no source distribution; install from a clone of the repository")


def get_requires_for_build_wheel(config_settings=None):
    return []
