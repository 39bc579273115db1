# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""The text of docs/reference/can/tessera.dbc: messages, signals, attributes and names of values from the tables of the code
(platform/vehicle/bus_messages.hpp, bus_table.hpp, bus_values.hpp); comments, and names of single codes, as the file has them."""
import re

E2E_PROFILES = ["None", "Profile1A", "Profile5"]
FD_FORMAT = 14  # of the enumeration VFrameFormat; 0, the default, is a classic frame


def number(value):
    text = f"{value:.10f}".rstrip("0").rstrip(".")
    return "0" if text in ("", "-0") else text


def names_of(header, names):
    """Of each signal with an enumeration: kStanding = 1 is 1 "Standing"."""
    enums = {name: [(int(code), word) for word, code in re.findall(r"\bk(\w+) = (\d+)", body)]
             for name, body in re.findall(r"enum class (\w+) : std::uint8_t \{(.*?)\};", header, re.S)}
    enums["Command"] = enums.pop("VehicleCommand")
    return {name: enums[name] for name in names}


def message_lines(message):
    sender, receiver = ("VEHICLE", "TESSERA") if message["from_vehicle"] else ("TESSERA", "VEHICLE")
    yield f'BO_ {message["id"]} {message["name"]}: {message["size"]} {sender}'
    for s in message["signals"]:
        sign = "-" if s["signed"] else "+"
        yield (f' SG_ {s["name"]} : {s["start"]}|{s["length"]}@1{sign} ({number(s["scale"])},{number(s["offset"])}) '
               f'[{number(s["least"])}|{number(s["most"])}] "{s["unit"]}" {receiver}')
    yield ""


def attribute_lines(message):
    yield f'BA_ "GenMsgCycleTime" BO_ {message["id"]} {message["cycle_ms"]};'
    if message["fd"]:
        yield f'BA_ "VFrameFormat" BO_ {message["id"]} {FD_FORMAT};'
    if message["e2e"]:
        yield f'BA_ "E2EProfile" BO_ {message["id"]} {message["e2e"]};'
        yield f'BA_ "E2EDataID" BO_ {message["id"]} {message["e2e_data_id"]};'


def value_lines(message, names, codes, kept):
    for signal in message["signals"]:
        name = signal["name"]
        values = names.get(name) or (codes if name.endswith("Distance") else None)
        if values:
            listed = " ".join(f'{code} "{word}"' for code, word in sorted(values, reverse=True))
            yield f'VAL_ {message["id"]} {name} {listed} ;'
        else:
            yield from (line for line in kept if line.startswith(f'VAL_ {message["id"]} {name} '))


def text_of(tables, header, file):
    """tables: what bus_tables prints; header: bus_values.hpp; file: the DBC as it is."""
    lines = file.splitlines()
    messages = tables["messages"]
    names = names_of(header, tables["names"])
    distance = list(zip(tables["codes"]["Distance"], ("NothingFound", "NotAvailable")))
    begin, comments, attributes = (next(i for i, line in enumerate(lines) if line.startswith(word)) for word in ("BO_ ", "CM_ ", "BA_ "))
    of_the_bus = [line for line in lines[attributes:] if line.startswith("BA_ ") and " BO_ " not in line]
    kept = [line for line in lines[attributes:] if line.startswith("VAL_ ")]
    written = lines[:begin]
    for message in messages:
        written += message_lines(message)
    written += ["", *lines[comments:attributes], *of_the_bus]
    for message in messages:
        written += attribute_lines(message)
    written.append("")
    for message in messages:
        written += value_lines(message, names, distance, kept)
    return "\n".join(written) + "\n"
