# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""A code's bits, as docs/reference/wire-format.md has them."""

NUMBER = 170


class Corrupt(Exception):
    pass


def check(condition):
    if not condition:
        raise Corrupt


class Bits:
    def __init__(self, code, table):
        self.code, self.read = code, 0
        self.range, self.low, self.offset = 2**32 - 1, 0, 0
        for _ in range(4):
            self.offset = self.offset * 256 + self.next_byte()
        check(self.offset < self.range)
        self.learnt = [256 * initial for initial in table]
        self.plain = self.bit_of(1)

    def next_byte(self):
        self.read += 1
        return self.code[self.read - 1] if self.read <= len(self.code) else 0

    def bit_of(self, p):
        bound = (self.range >> 12) * p
        bit = self.offset < bound
        if bit:
            self.range = bound
        else:
            self.range -= bound
            self.offset -= bound
            self.low = (self.low + bound) % 2**32
        while self.range < 2**24:
            self.range *= 256
            self.low = self.low * 256 % 2**32
            self.offset = self.offset * 256 + self.next_byte()
        return bit

    def even(self):
        return self.bit_of(2048)

    def bit(self, k):
        if self.plain:
            return self.even()
        q = self.learnt[k]
        bit = self.bit_of(max(q // 16, 1))
        self.learnt[k] = q + (65536 - q) // 16 if bit else q - q // 16
        return bit

    def check_end(self):
        n = (2**32 - self.low) % 2**32
        check(self.offset == (n if n < self.range else (2**24 - self.low) % 2**24))
        check(1 <= len(self.code) <= self.read and (len(self.code) == 1 or self.code[-1] != 0))

    def number(self, group, expected, most):
        k = NUMBER + 9 * group
        if not self.bit(k):
            value = 0
            for _ in range(most.bit_length()):
                value = 2 * value + self.even()
            check(abs(value - expected) >= 16)
        else:
            digits = 0
            while digits < 4 and self.bit(k + 1 + digits):
                digits += 1
            size = min(digits, 1)
            negative = digits > 0 and self.bit(k + 5)
            for i in range(1, digits):
                size = 2 * size + (self.bit(k + 4 + digits) if i == 1 else self.even())
            value = expected - size if negative else expected + size
        check(1 <= value <= most)
        return value
