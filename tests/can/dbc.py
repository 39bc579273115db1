# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Reads what DBC files say of messages and signals, and frames by it. Only of what such files may hold, all that this
project's has: a line that is not known is an error, so that a mistake in the file does not pass as a comment."""
import dataclasses
import re


@dataclasses.dataclass
class Signal:
    name: str
    start: int
    length: int
    little_endian: bool
    signed: bool
    scale: float
    offset: float
    least: float
    most: float
    unit: str
    receivers: list
    comment: str = ""
    values: dict = dataclasses.field(default_factory=dict)

    def raw(self, data):
        """As a number without sign; bit i of the data is the bit i % 8 of byte i // 8."""
        assert self.little_endian
        whole = int.from_bytes(data, "little")
        return (whole >> self.start) & ((1 << self.length) - 1)

    def value(self, data):
        raw = self.raw(data)
        if self.signed and raw >> (self.length - 1):
            raw -= 1 << self.length
        return raw * self.scale + self.offset

    def named(self, data):
        return self.values.get(self.raw(data))

    def put(self, data, value):
        """data with the value, or with a code by its name."""
        codes = {name: code for code, name in self.values.items()}
        raw = codes[value] if isinstance(value, str) else round((value - self.offset) / self.scale)
        mask = (1 << self.length) - 1
        whole = int.from_bytes(data, "little") & ~(mask << self.start) | (raw & mask) << self.start
        return whole.to_bytes(len(data), "little")


@dataclasses.dataclass
class Message:
    id: int
    name: str
    size: int
    sender: str
    signals: dict = dataclasses.field(default_factory=dict)
    comment: str = ""
    attributes: dict = dataclasses.field(default_factory=dict)


class Invalid(Exception):
    pass


MESSAGE = re.compile(r"BO_ (\d+) (\w+): (\d+) (\w+)$")
SIGNAL = re.compile(r' SG_ (\w+) : (\d+)\|(\d+)@([01])([+-]) \(([^,]+),([^)]+)\) \[([^|]+)\|([^\]]+)\] "([^"]*)" (\w+(?:,\w+)*)$')
COMMENT = re.compile(r'CM_ (?:(BU_|BO_|SG_) (\w+) (?:(\w+) )?)?"([^"]*)";$')
DEFINITION = re.compile(r'BA_DEF_ (?:(BO_) )? ?"(\w+)" (STRING|INT|ENUM) ?([^;]*);$')
DEFAULT = re.compile(r'BA_DEF_DEF_ "(\w+)" ("?[^";]*"?);$')
ATTRIBUTE = re.compile(r'BA_ "(\w+)" (?:BO_ (\d+) )?("?[^";]*"?);$')
VALUES = re.compile(r'VAL_ (\d+) (\w+) ((?:\d+ "[^"]*" )+);$')


class File:
    def __init__(self, text):
        self.nodes, self.messages, self.definitions, self.defaults, self.attributes = [], {}, {}, {}, {}
        lines = text.splitlines()
        head = re.match(r'VERSION "([^"]*)"$', lines[0])
        if head is None:
            raise Invalid("it does not begin with its version")
        self.version = head[1]
        self.last = None
        in_symbols = False
        for number, line in enumerate(lines[1:], 2):
            if line == "NS_ :" or (in_symbols and re.match(r"\t\w+$", line)):
                in_symbols = True
                continue
            in_symbols = False
            try:
                if line not in ("", "BS_:"):
                    self.take(line)
            except (KeyError, ValueError, StopIteration) as error:
                raise Invalid(f"line {number}: {line!r}: {error!r}") from error

    def take(self, line):
        word = line.split()[0]
        {"BU_:": self.take_nodes, "BO_": self.take_message, "SG_": self.take_signal, "CM_": self.take_comment,
         "BA_DEF_": self.take_definition, "BA_DEF_DEF_": self.take_default, "BA_": self.take_attribute,
         "VAL_": self.take_values}[word](line)

    @staticmethod
    def parts(pattern, line):
        match = pattern.match(line)
        if match is None:
            raise ValueError("not as such lines are")
        return match.groups()

    def take_nodes(self, line):
        self.nodes = line.split()[1:]

    def take_message(self, line):
        number, name, size, sender = self.parts(MESSAGE, line)
        if int(number) in self.messages or sender not in self.nodes:
            raise ValueError("twice the identifier, or an unknown sender")
        self.last = self.messages[int(number)] = Message(int(number), name, int(size), sender)

    def take_signal(self, line):
        name, start, length, order, sign, scale, offset, least, most, unit, receivers = self.parts(SIGNAL, line)
        if name in self.last.signals or not set(receivers.split(",")) <= set(self.nodes):
            raise ValueError("twice the name, or an unknown receiver")
        self.last.signals[name] = Signal(name, int(start), int(length), order == "1", sign == "-", float(scale), float(offset),
                                         float(least), float(most), unit, receivers.split(","))

    def take_comment(self, line):
        kind, owner, signal, text = self.parts(COMMENT, line)
        if kind == "BO_":
            self.messages[int(owner)].comment = text
        elif kind == "SG_":
            self.messages[int(owner)].signals[signal].comment = text
        elif kind == "BU_" and owner not in self.nodes:
            raise ValueError("an unknown node")

    def take_definition(self, line):
        _, name, kind, rest = self.parts(DEFINITION, line)
        self.definitions[name] = re.findall(r'"([^"]*)"', rest) if kind == "ENUM" else kind

    def attribute_value(self, name, text):
        kind = self.definitions[name]
        if text.startswith('"'):
            text = text.strip('"')
            if isinstance(kind, list) and text not in kind:
                raise ValueError("not one of its values")
            return text
        return kind[int(text)] if isinstance(kind, list) else int(text)

    def take_default(self, line):
        name, text = self.parts(DEFAULT, line)
        self.defaults[name] = self.attribute_value(name, text)

    def take_attribute(self, line):
        name, owner, text = self.parts(ATTRIBUTE, line)
        to = self.attributes if owner is None else self.messages[int(owner)].attributes
        to[name] = self.attribute_value(name, text)

    def take_values(self, line):
        owner, signal, pairs = self.parts(VALUES, line)
        self.messages[int(owner)].signals[signal].values = {int(k): v for k, v in re.findall(r'(\d+) "([^"]*)"', pairs)}

    def attribute(self, message, name):
        return message.attributes.get(name, self.defaults.get(name))

    def named(self, name):
        return next(message for message in self.messages.values() if message.name == name)


def read(path):
    with open(path, encoding="utf-8") as file:
        return File(file.read())
