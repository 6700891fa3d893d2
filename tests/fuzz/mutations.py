"""Damage to files: of bytes, of numbers in text and binary, of words and lines, and pieces of other files."""

from __future__ import annotations

import base64
import binascii
import re
import struct
from collections.abc import Callable, Sequence
from random import Random

WORDS = [
    b"0", b"1", b"-1", b"2", b"3", b"4", b"7", b"9", b"127", b"128", b"255", b"256", b"65536", b"2147483647",
    b"2147483648", b"-2147483648", b"4294967295", b"4294967296", b"1000000000000", b"999999999999999999",
    b"9223372036854775807", b"9223372036854775808", b"18446744073709551615", b"-9223372036854775808", b"9" * 40,
    b"1e308", b"1e309", b"-1e308", b"1e-320", b"1e-400", b"5e-324", b"3.5e38", b"nan", b"-nan", b"inf", b"-inf",
    b"nan(1)", b"0.1", b"-0.0", b"-0", b"+1", b"1.", b".5", b"1d3", b"1_0", b"0x1", b"1/2/3", b"-", b"x", b"", b"\xff",
    b'"', b"<", b">", b"&#48;", b"=", b"#", b"%", b"$", b"\\", b"%20",
]  # fmt: skip
NUMBERS = [0, 1, 2, 3, 5, 7, 127, 128, 255, 2**15, 2**16, 2**31 - 1, 2**31, 2**32 - 1, 2**32, 10**12, 2**62,
           2**63 - 1, 2**63, 2**64 - 1]  # fmt: skip
BYTES = b"\0\1\2\3\x7f\x80\xff \t\n\r\v\f0129+-./eE\"'<>=#%$&\\_"
ENDS = [b"\n", b"\r\n", b"\r"]

_NUMBER = re.compile(rb"[-+]?\d[-+.\w/]*")
_WORD = re.compile(rb"[^\s\"'=<>]+")
_LINE = re.compile(rb"[^\r\n]*(?:\r\n?|\n)?")
_BASE64 = re.compile(rb"[A-Za-z0-9+/]{8,}=*")

Mutation = Callable[[bytes, Random, Sequence[bytes]], bytes]


def mutate(data: bytes, random: Random, others: Sequence[bytes], most: int) -> bytes:
    """The file with one to five changes, cut after ``most`` bytes. others: files that pieces may be of."""
    for _ in range(random.choice((1, 1, 1, 2, 2, 3, 5))):
        data = random.choice(MUTATIONS)(data, random, others)
    return data[:most]


def _span(data: bytes, random: Random, most: int | None = None) -> slice:
    start = random.randint(0, len(data))
    size = random.randint(0, min(len(data) - start, random.choice((4, 40, 400, 10**9)) if most is None else most))
    return slice(start, start + size)


def _put(data: bytes, where: slice, new: bytes) -> bytes:
    return data[: where.start] + new + data[where.stop :]


def _find(pattern: re.Pattern[bytes], data: bytes, random: Random) -> slice | None:
    """One of the places where a pattern fits: the next from somewhere on."""
    match = pattern.search(data, random.randint(0, len(data))) or pattern.search(data)
    return slice(*match.span()) if match else None


def _replace_number(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    where = _find(_NUMBER, data, random)
    return data if where is None else _put(data, where, random.choice(WORDS))


def _step_number(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    where = _find(re.compile(rb"(?<![\w.])\d{1,18}(?![\w.])"), data, random)
    return data if where is None else _put(data, where, b"%d" % (int(data[where]) + random.choice((-2, -1, 1, 2, 10))))


def _replace_word(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    where = _find(_WORD, data, random)
    other = _find(_WORD, source := random.choice(others), random) if others else None
    new = source[other] if other and random.random() < 0.7 else random.choice(WORDS)
    return data if where is None else _put(data, where, new)


def _swap(pattern: re.Pattern[bytes], data: bytes, random: Random) -> bytes:
    one, two = sorted((_find(pattern, data, random) or slice(0, 0) for _ in range(2)), key=lambda s: (s.start, s.stop))
    if one.stop > two.start:
        return data
    return data[: one.start] + data[two] + data[one.stop : two.start] + data[one] + data[two.stop :]


def _swap_words(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    return _swap(_WORD, data, random)


def _lines(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    start = random.randrange(len(lines))
    chosen = lines[start : start + random.choice((1, 1, 1, 2, 4, 30))]
    rest = lines[:start] + lines[start + len(chosen) :]
    to = random.randint(0, len(rest))
    way = random.randrange(4)
    if way == 0:
        return b"".join(rest)
    if way == 1:
        return b"".join([*rest[:to], *chosen, *rest[to:]])
    if way == 2:
        return b"".join([*lines[:start], *chosen * random.choice((2, 2, 3, 30)), *lines[start:]])
    shuffled = random.sample(chosen, len(chosen))
    return b"".join([*lines[:start], *shuffled, *lines[start + len(chosen) :]])


def _cut(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    at = random.randint(0, len(data))
    return data[:at] if random.random() < 0.8 else data[at:]


def _drop(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    return _put(data, _span(data, random), b"")


def _repeat(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    where = _span(data, random)
    times = random.choice((2, 2, 3, 50, 1000)) if where.stop - where.start < 20 else 2
    return _put(data, where, data[where] * times)


def _copy(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    to = random.randint(0, len(data))
    return data[:to] + data[_span(data, random)] + data[to:]


def _join(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    if not others:
        return data
    other = random.choice(others)
    if random.random() < 0.5:
        return data[: random.randint(0, len(data))] + other[random.randint(0, len(other)) :]
    return _put(data, _span(data, random), other[_span(other, random)])


def _byte(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    at = random.randint(0, len(data))
    new = bytes([random.choice(BYTES) if random.random() < 0.7 else random.randrange(256)])
    return data[:at] + new * random.choice((1, 1, 1, 1, 2, 8, 300)) + data[at + random.randrange(2) :]


def _bit(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    at = random.randint(0, len(data))
    return data[:at] + bytes(byte ^ 1 << random.randrange(8) for byte in data[at : at + 1]) + data[at + 1 :]


def _binary(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    """A number of two to eight bytes in place of others, or more or less by a little."""
    size, order = random.choice((2, 4, 4, 8)), random.choice(("little", "big"))
    if len(data) < size:
        return data
    at = random.randint(0, len(data) - size)
    old, way = data[at : at + size], random.randrange(3)
    if way == 0:
        new = random.choice(NUMBERS) * random.choice((1, 1, -1))
    elif way == 1:
        new = int.from_bytes(old, order) + random.choice((-2, -1, 1, 2))
    else:
        code = {2: "e", 4: "f", 8: "d"}[size]
        real = random.choice((0.0, -0.0, 1.0, 65504.0, float("nan"), float("inf"), -float("inf")))
        return data[:at] + struct.pack("<>"[order == "big"] + code, real) + data[at + size :]
    return data[:at] + (new % (1 << 8 * size)).to_bytes(size, order) + data[at + size :]


def _ends(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    new = random.choice(ENDS)
    if random.random() < 0.5:
        return new.join(data.splitlines())
    where = _find(re.compile(rb"\r\n?|\n"), data, random)
    return data if where is None else _put(data, where, random.choice((new, b"", b" ", new * 2)))


def _blanks(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    where = _find(re.compile(rb"\s+"), data, random)
    new = random.choice(
        (b" ", b"  ", b"\t", b"\v", b"\f", b" \t ", b"\n", b"\r", b"\r\n", b"\n\n", b"\0", b"\xa0", b"")
    )
    return data if where is None else _put(data, where, new)


def _encoded(data: bytes, random: Random, others: Sequence[bytes]) -> bytes:
    """Changes what stands in base64."""
    where = _find(_BASE64, data, random)
    if where is None:
        return data
    try:
        inside = base64.b64decode(data[where])
    except binascii.Error:
        return data
    return _put(data, where, base64.b64encode(random.choice((_binary, _byte, _bit, _cut, _drop))(inside, random, ())))


MUTATIONS: list[Mutation] = [
    _replace_number, _replace_number, _step_number, _replace_word, _replace_word, _swap_words, _lines, _lines, _cut,
    _drop, _repeat, _copy, _join, _byte, _bit, _binary, _binary, _ends, _blanks, _encoded,
]  # fmt: skip
