# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""pip installs the package from the clone, without the network, and says what is missing where something is.

TESSERA_BUILD is the build folder, so that nothing is compiled again here."""
import os
import pathlib
import re
import subprocess
import sys
import zipfile

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ["TESSERA_BUILD"])
VERSION = re.search(r"project\(tessera VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1]
sys.path.insert(0, str(ROOT / "platform" / "python"))
import build_backend  # noqa: E402

WITHOUT_PATHS = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "TESSERA_COMMAND")}
PROGRAM = """
import numpy as np, tessera
made = tessera.LocalMap(memory_bytes=32 << 20, max_points=100)
assert made.integrate(np.full((1, 3), 2, np.float32)).admitted == 1
print(tessera.__version__, tessera.__file__)
"""


def run(*command, cwd, **arguments):
    return subprocess.run([str(word) for word in command], cwd=cwd, capture_output=True, text=True, timeout=300, check=False,
                          **{"env": WITHOUT_PATHS, **arguments})


@pytest.fixture(scope="module")
def venv(tmp_path_factory):
    folder = tmp_path_factory.mktemp("venv")
    made = run(sys.executable, "-m", "venv", "--system-site-packages", folder, cwd=folder)
    assert made.returncode == 0, made.stdout + made.stderr
    return folder


def test_pip_installs_it_offline(venv, tmp_path):
    pip = (venv / "bin" / "python", "-m", "pip", "--disable-pip-version-check")
    done = run(*pip, "install", "--no-index", f"--config-settings=build-dir={BUILD}", ROOT, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    used = run(venv / "bin" / "python", "-c", PROGRAM, cwd=tmp_path)
    assert used.returncode == 0, used.stderr
    version, path = used.stdout.split()
    assert version == VERSION and pathlib.Path(path).is_relative_to(venv)
    names = {p.name for p in pathlib.Path(path).parent.iterdir()}
    assert {"py.typed", "_tessera.pyi"} <= names
    assert f"tessera {VERSION}" in run(*pip, "list", "--format=freeze", cwd=tmp_path).stdout.replace("==", " ")
    assert run(*pip, "uninstall", "-y", "tessera", cwd=tmp_path).returncode == 0
    assert run(venv / "bin" / "python", "-c", "import tessera", cwd=tmp_path).returncode != 0
    # Building leaves nothing in the sources.
    assert not any((ROOT / name).exists() for name in ("tessera.egg-info", "dist", "platform/python/__pycache__/x"))


def test_the_same_files_give_the_same_wheel(tmp_path):
    wheels = []
    for name in ("a", "b"):
        folder = tmp_path / name
        folder.mkdir()
        wheels.append(folder / build_backend.build_wheel(folder, {"build-dir": str(BUILD)}))
    assert wheels[0].read_bytes() == wheels[1].read_bytes()
    assert re.fullmatch(rf"tessera-{VERSION}-cp3\d+-cp3\d+-linux_\w+\.whl", wheels[0].name)
    with zipfile.ZipFile(wheels[0]) as wheel:
        assert wheel.testzip() is None
        names = wheel.namelist()
        record = wheel.read(f"tessera-{VERSION}.dist-info/RECORD").decode()
    assert sorted(names) == sorted(line.split(",")[0] for line in record.splitlines())
    assert not [*tmp_path.rglob("*.part")]


def backend(tmp_path, *settings, **arguments):
    program = f"import build_backend; build_backend.build_wheel({str(tmp_path)!r}, dict({list(settings)!r}))"
    return run(sys.executable, "-B", "-c", program, cwd=ROOT / "platform" / "python", **arguments)


def test_it_is_configured_without_the_rest_of_the_platform(tmp_path):
    done = run("cmake", *build_backend.configuration(tmp_path, ""), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    targets = run("cmake", "--build", tmp_path, "--target", "help", cwd=tmp_path).stdout
    assert "tessera_python" in targets and "tessera_cli" not in targets and "tessera_link" not in targets


def test_what_it_needs_is_installed_by_the_script():
    listed = run(ROOT / "tests" / "install-packages.sh", "python", "--list", cwd=ROOT)
    assert {*build_backend.DEBIAN.values(), "cmake", "python3-pip", "python3-venv", "python3-numpy"} <= {*listed.stdout.split()}


def test_a_header_or_library_that_is_missing_is_named_by_its_package(tmp_path):
    for found in ("find_path(TESSERA_SODIUM_INCLUDE_DIR no_such_header.h REQUIRED)", "find_library(TESSERA_SODIUM no_such_library REQUIRED)"):
        (tmp_path / "CMakeLists.txt").write_text(f"cmake_minimum_required(VERSION 3.22)\nproject(lacks C)\n{found}\n")
        done = run("cmake", "-B", tmp_path / "build", cwd=tmp_path)
        assert done.returncode != 0 and build_backend.lacking(done.stderr) == ["libsodium-dev"], done.stderr


def test_what_is_missing_is_named(tmp_path):
    empty = tmp_path / "bin"
    empty.mkdir()
    done = backend(tmp_path, ("build-dir", str(tmp_path / "x")), env={**WITHOUT_PATHS, "PATH": str(empty)})
    assert done.returncode != 0 and "cmake is missing; sudo apt-get install cmake" in done.stderr
    for ignored, package in (("/usr/lib/cmake/pybind11;/lib/cmake/pybind11", "pybind11-dev"), ("/usr/share/eigen3/cmake", "libeigen3-dev")):
        done = backend(tmp_path, ("build-dir", str(tmp_path / package)), ("cmake-args", f"'-DCMAKE_IGNORE_PATH={ignored}'"))
        assert done.returncode != 0 and f"sudo apt-get install {package}" in done.stderr, done.stdout + done.stderr
    assert not [*tmp_path.glob("*.whl")]
