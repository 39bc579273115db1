# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""End-to-end protection as docs/reference/can.md tells it, by tables: not how the code computes it."""


def table_of(polynomial, width):
    table = []
    for value in range(256):
        crc = value << (width - 8)
        for _ in range(8):
            crc = (crc << 1) ^ (polynomial if crc >> (width - 1) else 0)
            crc &= (1 << width) - 1
        table.append(crc)
    return table


CRC8, CRC16 = table_of(0x1D, 8), table_of(0x1021, 16)


def crc8(data, crc):
    for byte in data:
        crc = CRC8[crc ^ byte]
    return crc


def crc16(data, crc):
    for byte in data:
        crc = ((crc << 8) & 0xFFFF) ^ CRC16[(crc >> 8) ^ byte]
    return crc


def checksum(profile, data_id, data):
    identifier = data_id.to_bytes(2, "little")
    if profile == "Profile1A":
        return crc8(identifier + data[1:], 0)
    return crc16(data[2:] + identifier, 0xFFFF)


def is_right(profile, data_id, data):
    size = 1 if profile == "Profile1A" else 2
    return int.from_bytes(data[:size], "little") == checksum(profile, data_id, data)


def sealed(profile, data_id, counter, data):
    """data with its counter and checksum."""
    data = bytearray(data)
    if profile == "Profile1A":
        data[1] = data[1] & 0xF0 | counter % 15
        data[0] = checksum(profile, data_id, bytes(data))
    else:
        data[2] = counter % 256
        data[:2] = checksum(profile, data_id, bytes(data)).to_bytes(2, "little")
    return bytes(data)
