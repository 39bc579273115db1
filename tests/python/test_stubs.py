# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The stub has every public name of the module, with its arguments, and nothing else; and each has a docstring.
"python3 tests/python/test_stubs.py PATH/_tessera.pyi" writes the counters of ScanReport into it, with the built package on PYTHONPATH."""
import ast
import inspect
import pathlib
import re
import subprocess
import sys

import pytest

import tessera
from tessera import _tessera

STUB = pathlib.Path(tessera.__file__).with_name("_tessera.pyi")
# What a class has of object or of pybind11.
COMMON = {"__init__", "__len__", "__eq__", "__getitem__", "__iter__"}


def is_public(name):
    return not name.startswith("_") or name == "__version__"


def stub():
    """{class: {member: arguments or None}}; functions of the module are of the class ""."""
    tree = ast.parse(STUB.read_text())
    found = {"": {}}

    def arguments_of(function):
        a = function.args
        return [x.arg for x in (*a.posonlyargs, *a.args, *a.kwonlyargs) if x.arg != "self"]

    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            members = found.setdefault(node.name, {})
            for item in node.body:
                if isinstance(item, ast.FunctionDef):
                    is_property = any(isinstance(d, ast.Name) and d.id == "property" for d in item.decorator_list)
                    members[item.name] = None if is_property else arguments_of(item)
                elif isinstance(item, ast.AnnAssign):
                    members[item.target.id] = None
        elif isinstance(node, ast.FunctionDef):
            found[""][node.name] = arguments_of(node)
    return found


def arguments_of(member):
    """By what pybind11 says of them in the first line of the docstring."""
    signature = re.match(r"\w+\((.*)\) -> ", member.__doc__.splitlines()[0])
    depth, words, word = 0, [], ""
    for letter in signature[1] + ",":
        depth += (letter in "([{<") - (letter in ")]}>")
        if letter == "," and depth <= 0:
            words.append(word.strip())
            word = ""
        else:
            word += letter
    names = [re.match(r"\**(\w*)", w)[1] for w in words]
    return [n for n in names if n and n != "self"]


def test_every_name_and_argument_is_in_both():
    described = stub()
    classes = {name: c for name, c in vars(_tessera).items() if inspect.isclass(c) and is_public(name)}
    assert classes.keys() == described.keys() - {""}
    for name, c in classes.items():
        if issubclass(c, Exception):
            continue
        public = {n: m for n, m in vars(c).items() if is_public(n)}
        assert public.keys() == described[name].keys() - COMMON, name
        for n, member in public.items():
            if isinstance(member, property):
                assert described[name][n] is None, (name, n)
            else:
                assert described[name][n] == arguments_of(getattr(c, n)), (name, n)
        if "__init__" in described[name]:
            assert described[name]["__init__"] == arguments_of(c.__init__), name
    functions = {n: f for n, f in vars(_tessera).items() if inspect.isroutine(f) and is_public(n)}
    assert functions.keys() == described[""].keys()
    for n, f in functions.items():
        assert described[""][n] == arguments_of(f), n


def test_the_package_gives_every_name():
    assert set(tessera.__all__) - {"State", "RayEnd"} == {n for n in vars(_tessera) if is_public(n)}
    assert tessera.__all__ == sorted(tessera.__all__)
    assert STUB.with_name("py.typed").exists()


def test_everything_says_what_it_is():
    for name in set(tessera.__all__) - {"__version__"}:
        thing = getattr(tessera, name)
        assert thing.__doc__, name
        for n, member in vars(thing).items() if inspect.isclass(thing) else ():
            if not n.startswith("_") and not isinstance(thing, type(tessera.State)):
                lines = (member.__doc__ or "").splitlines()
                assert any(line and "self:" not in line for line in lines), (name, n)


def test_types_are_right_where_there_is_mypy(tmp_path):
    program = tmp_path / "program.py"
    program.write_text("""import numpy as np
import tessera
made: tessera.LocalMap = tessera.LocalMap(resolution_m=0.2)
report = made.integrate(np.zeros((1, 3), np.float32), np.zeros(1, np.uint8), np.eye(4))
count: int = report.admitted
center = made.box((0, 0, 0), (1, 1, 1)).center
names: list[str] = tessera.Dataset("kitti").classes.names
sent: list[bytes] = tessera.Sharer(made).tick()
""")
    command = [sys.executable, "-m", "mypy", "--strict", "--no-incremental", f"--cache-dir={tmp_path}"]
    if subprocess.run([*command, "--version"], capture_output=True, check=False).returncode != 0:
        pytest.skip("no mypy")
    package = str(STUB.parent)
    done = subprocess.run([*command, str(program), package], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    program.write_text("import tessera\ncount: str = tessera.ClassTable(['a']).num_classes\n")
    assert subprocess.run([*command, str(program), package], capture_output=True, check=False).returncode == 1


def write_counters(path):
    """Those of the module, in its order."""
    numbers = [name for name, member in vars(_tessera.ScanReport).items() if isinstance(member, property) and name != "unknown_id_examples"]
    text = re.sub(r"(class ScanReport:\n)(?:    \w+: Final\[int\]\n)+", lambda m: m[1] + "".join(f"    {n}: Final[int]\n" for n in numbers), path.read_text())
    path.write_text(text)


if __name__ == "__main__":
    write_counters(pathlib.Path(sys.argv[1]))
