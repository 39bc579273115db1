# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""One sentence where an argument has the wrong type, is missing or fits no whole number of C++. pybind11's own text lists every signature and prints all that was given."""
import functools
import inspect
import numbers
import os
import re

import numpy

PYBIND11_SAYS = "incompatible function arguments", "incompatible constructor arguments"
ARGUMENT = re.compile(r"(\w+)(?:: (.+?))?( = .*)?$")


def split(text):
    """At the commas outside of brackets."""
    parts, depth, start = [], 0, 0
    for at, letter in enumerate(text):
        depth += (letter in "([{<") - (letter in ")]}>")
        if letter == "," and depth == 0:
            parts.append(text[start:at].strip())
            start = at + 1
    return [*parts, text[start:].strip()]


def arguments_of(function):
    """By the first line of a docstring of pybind11: {name: annotation}; those without a default; whether more may be given by
    keyword; how many may be given by place."""
    text = re.search(r"\((.*)\) -> ", (function.__doc__ or "").splitlines()[0])
    words = split(text[1]) if text else []
    by_place = words.index("*") if "*" in words else len(words)
    found = [argument for argument in map(ARGUMENT.match, words) if argument]
    required = [argument[1] for argument in found if not argument[3]]
    return {argument[1]: argument[2] or "" for argument in found}, required, any(w.startswith("**") for w in words), by_place


def choices(annotation):
    """Annotations of which one must fit: pybind11 writes Optional[A] and Union[A, B], tessera A | B."""
    if annotation.startswith("Optional["):
        return [*choices(annotation[9:-1]), "None"]
    if annotation.startswith("Union["):
        return [choice for part in split(annotation[6:-1]) for choice in choices(part)]
    return annotation.split(" | ")


def fits(value, annotation, classes):
    if len(parts := choices(annotation)) > 1:
        return any(fits(value, part, classes) for part in parts)
    if annotation == "None":
        return value is None
    if annotation.startswith("List["):
        return isinstance(value, (list, tuple)) and all(fits(item, annotation[5:-1], classes) for item in value)
    if annotation.startswith("Dict["):
        return isinstance(value, dict)
    kinds = {"numpy.ndarray": numpy.ndarray, "int": numbers.Integral, "float": numbers.Real, "bool": (bool, numpy.bool_), "str": str,
             "bytes": bytes, "list": (list, tuple), "os.PathLike": (str, os.PathLike)}
    kind = kinds.get(annotation.split("[")[0]) or classes.get(annotation.rsplit(".", 1)[-1])
    return kind is None or isinstance(value, kind)


def wanted(annotation):
    """In words."""
    if len(parts := choices(annotation)) > 1:
        return " or ".join(map(wanted, parts))
    if annotation.startswith("List["):
        return f"a list, each of it {wanted(annotation[5:-1])}"
    words = {"numpy.ndarray": "a numpy array", "int": "a whole number", "float": "a number", "bool": "True or False", "str": "text",
             "bytes": "bytes", "list": "a list", "os.PathLike": "a path", "None": "None"}
    return words.get(annotation.split("[")[0], f"a {annotation.rsplit('.', 1)[-1]}")


def misfit(argument, value, annotation):
    """Of a value of the right type; empty: it fits."""
    items = value if isinstance(value, (list, tuple)) else [value]
    too_long = [item for item in items if isinstance(item, numbers.Integral) and not -(1 << 63) <= item < 1 << 63]
    if too_long:
        return f"{argument} {too_long[0]} is not allowed; give a whole number from -2^63 to 2^63 - 1"
    length = re.match(r"List\[\w+\[(\d+)\]\]", annotation)
    return f"{argument} has {len(items)} items; give {length[1]}" if length and len(items) != int(length[1]) else ""


def wrong_call(name, function, given, keywords):
    """Whether each argument is there, once; empty: it is."""
    arguments, required, open_ended, by_place = arguments_of(function)
    if len(given) > by_place:
        return f"{name} takes {by_place - ('self' in arguments)} arguments without their names; help({name}) lists them"
    for keyword in keywords:
        if keyword not in arguments and not open_ended:
            return f"{name} has no argument {keyword}; help({name}) lists them"
    by_name = list(arguments)[len(given):]
    for keyword in keywords:
        if keyword in arguments and keyword not in by_name:
            return f"{keyword} is given twice, once without its name; give it once"
    missing = [argument for argument in by_name if argument in required and argument not in keywords]
    return f"{name} needs {' and '.join(missing)}; help({name}) lists its arguments" if missing else ""


def refusal(name, function, given, keywords, classes):
    """The exception."""
    if wrong := wrong_call(name, function, given, keywords):
        return TypeError(wrong)
    arguments = arguments_of(function)[0]
    named = [(argument, value) for argument, value in (*zip(arguments, given), *keywords.items()) if argument != "self"]
    for argument, value in named:
        annotation = arguments.get(argument, "")
        if not fits(value, annotation, classes):
            misfits = [v for v in value if not fits(v, annotation[5:-1], classes)] if isinstance(value, (list, tuple)) and annotation.startswith("List[") else []
            what = f"{argument} has an item of type {type(misfits[0]).__name__}" if misfits else f"{argument} is of type {type(value).__name__}"
            return TypeError(f"{what}; give {wanted(annotation)}")
    for argument, value in named:
        if wrong := misfit(argument, value, arguments.get(argument, "")):
            return classes["InputError"](wrong)
    return TypeError(f"{name} was given arguments that do not fit together; help({name}) lists them")


def with_short_refusals(name, function, classes):
    @functools.wraps(function)
    def call(*given, **keywords):
        try:
            return function(*given, **keywords)
        except TypeError as error:
            if not any(says in str(error) for says in PYBIND11_SAYS):
                raise
            short = refusal(name, function, given, keywords, classes)
        raise short

    return call


def shorten(module):
    """Gives the functions of a module and the methods of its classes refusals of one sentence."""
    classes = {name: item for name, item in vars(module).items() if inspect.isclass(item)}
    for class_name, item in classes.items():
        for name, member in list(vars(item).items()):
            where = f"tessera.{class_name}" + ("" if name == "__init__" else f".{name}")
            if isinstance(member, staticmethod):
                setattr(item, name, staticmethod(with_short_refusals(where, member.__func__, classes)))
            elif type(member).__name__ == "instancemethod" and (name == "__init__" or not name.startswith("__")):
                setattr(item, name, with_short_refusals(where, member, classes))
    for name, member in list(vars(module).items()):
        if inspect.isbuiltin(member):
            setattr(module, name, with_short_refusals(f"tessera.{name}", member, classes))
