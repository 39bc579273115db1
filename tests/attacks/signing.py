# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Keys as `tessera key new` writes them, and signatures with them."""
import hashlib
import pathlib

import wire_trust


def keys_of(path, kind):
    """Of a key file: the words between the kind's version and the check, of each line."""
    lines = [line.split(" ") for line in pathlib.Path(path).read_text().splitlines()]
    return [words[2:-1] for words in lines if words[0] == kind]


def sign(seed, message):
    """Ed25519, RFC 8032 section 5.1.6."""
    digest = hashlib.sha512(seed).digest()
    secret = int.from_bytes(digest[:32], "little") & (2**254 - 8) | 2**254

    def bytes_of(scalar):
        x, y, z, _ = wire_trust.times((scalar, 0), (wire_trust.BASE, wire_trust.BASE))
        inverse = pow(z, wire_trust.P - 2, wire_trust.P)
        x, y = x * inverse % wire_trust.P, y * inverse % wire_trust.P
        return (y | (x & 1) << 255).to_bytes(32, "little")

    def number(data):
        return int.from_bytes(hashlib.sha512(data).digest(), "little") % wire_trust.ORDER

    r = number(digest[32:] + message)
    first = bytes_of(r)
    last = (r + number(first + bytes_of(secret) + message) * secret) % wire_trust.ORDER
    return first + last.to_bytes(32, "little")
