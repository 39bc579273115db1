# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Frames of docs/reference/wire-format.md and their short codes, from that page alone."""
import math
import struct

from wire_trust import check

FIRST_SESSION = 0xffff0000
STEPS, STEPS_PER_M = 2**23, 2**12
MOST_PART, MOST_SHIFT = 5_931_642, 524_287 * STEPS_PER_M


def varint(value):
    out = b""
    while value >= 128:
        out += bytes([value & 127 | 128])
        value >>= 7
    return out + bytes([value])


def zigzag(value):
    return varint(2 * value if value >= 0 else -2 * value - 1)


def is_rigid(T, tolerance):
    if not all(map(math.isfinite, T)):
        return False
    columns = [T[i::4] for i in range(3)]
    for i in range(3):
        for j in range(3):
            if abs(sum(a * b for a, b in zip(columns[i], columns[j])) - (i == j)) > tolerance:
                return False
    a, b, c = columns
    return sum(a[i] * (b[i - 2] * c[i - 1] - b[i - 1] * c[i - 2]) for i in range(3)) > 0


def read_code(r):
    """The shift in steps, three parts of the rotation in steps, and which is left out."""
    shift = r.take("3i")
    parts = tuple(int.from_bytes(r.bytes(3), "little", signed=True) for _ in range(3))
    return shift, parts, r.u8()


def code_bytes(code):
    shift, parts, out = code
    return struct.pack("<3i", *shift) + b"".join(part.to_bytes(3, "little", signed=True) for part in parts) + bytes([out])


def transform_of(code):
    """None for what is no code."""
    shift, parts, out = code
    if out > 3 or any(abs(part) > MOST_PART for part in parts) or any(abs(t) > MOST_SHIFT for t in shift):
        return None
    q, rest = [part / STEPS for part in parts], 1.0
    for part in q:
        rest -= part * part
    if rest < 0.2499:
        return None
    q.insert(out, math.sqrt(rest))
    length = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    w, x, y, z = (part / length for part in q)
    rows = ((1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)))
    return tuple(number for row, t in zip(rows, shift) for number in (*row, t / STEPS_PER_M))


def quaternion_of(T):
    """Any way will do that is exact to 1e-12; this one divides by a part that is not small."""
    r = [T[0:3], T[4:7], T[8:11]]
    trace = r[0][0] + r[1][1] + r[2][2]
    if trace > 0:
        q = [1 + trace, r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]
    else:
        i = max(range(3), key=lambda at: r[at][at])
        j, k = (i + 1) % 3, (i + 2) % 3
        q = [r[k][j] - r[j][k], 0, 0, 0]
        q[i + 1], q[j + 1], q[k + 1] = 1 + r[i][i] - r[j][j] - r[k][k], r[j][i] + r[i][j], r[k][i] + r[i][k]
    length = math.sqrt(sum(part * part for part in q))
    return [part / length for part in q]


def code_of(T):
    """The short code of a transform, None if it has none."""
    if not is_rigid(T, 1e-3) or any(abs(t) * STEPS_PER_M > MOST_SHIFT for t in T[3::4]):
        return None
    q = quaternion_of(T)
    largest = max(map(abs, q))
    for out in range(4):
        if abs(q[out]) < largest - 1e-6:
            continue
        sign = -1 if q[out] < 0 else 1
        parts = tuple(round(sign * q[i] * STEPS) for i in range(4) if i != out)
        code = tuple(round(t * STEPS_PER_M) for t in T[3::4]), parts, out
        if transform_of(code) == tuple(T):  # 0 and -0 are equal here
            return code if struct.pack("<12d", *transform_of(code)) == struct.pack("<12d", *T) else None
    return None


def read(robot, before, r, resolution_m):
    """A frame without its proof, after one with these numbers: epoch, submap and revision."""
    flags = r.u8()
    check(flags <= 3, "flags of a frame")
    epoch, submap, revision = ((number + r.zigzag()) % 2**32 for number in before)
    one = {"name": (robot, epoch, submap), "revision": revision, "extent": None, "session": None}
    check(revision >= 1, "revision")
    if flags & 1:
        one["T"] = r.take("12d")
        check(code_of(one["T"]) is None, "a matrix of which there is a short code")
    else:
        code = read_code(r)
        one["T"] = transform_of(code)
        check(one["T"] is not None and code_of(one["T"]) == code, "short code")
    if not flags & 2:
        low = [r.zigzag() for _ in range(3)]
        one["extent"] = (*low, *(a + r.varint() for a in low))
        check(all(-2**20 <= a < 2**20 for a in one["extent"]), "extent")
    if submap >= FIRST_SESSION:
        one["session"] = r.take("QqH")
        check(one["session"][2] <= 2**15, "weight of a map session")
    check(is_rigid(one["T"], 1e-3), "frame")
    check(all(abs(t) <= 2**20 * resolution_m for t in one["T"][3::4]), "shift")
    return one


def one_bytes(one, before):
    """A frame without its proof, after one with these numbers."""
    code, extent = code_of(one["T"]), one["extent"]
    numbers = zip((*one["name"][1:], one["revision"]), before)
    steps = [(number - previous + 2**31) % 2**32 - 2**31 for number, previous in numbers]
    out = bytes([(code is None) + 2 * (extent is None)]) + b"".join(map(zigzag, steps))
    out += struct.pack("<12d", *one["T"]) if code is None else code_bytes(code)
    if extent:
        out += b"".join(map(zigzag, extent[:3])) + b"".join(varint(high - low) for low, high in zip(extent[:3], extent[3:]))
    return out + (struct.pack("<QqH", *one["session"]) if one["session"] else b"")


def alone(one):
    """The body of a datagram that its robot sends with this frame alone."""
    return struct.pack("<BI", 0, one["name"][0]) + one_bytes(one, (0, 0, 0))


def body_bytes(body):
    out, before = struct.pack("<BI", body["flags"], body["robot"]), (0, 0, 0)
    for one in body["frames"]:
        out += one_bytes(one, before) + one["proof"]
        before = *one["name"][1:], one["revision"]
    return out
