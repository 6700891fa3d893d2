"""Compiled tokenizer of text files: tokens by line, numbers, and new numbers in the places of old ones.

A token is known by its first byte. It ends where the table of bytes says so: at white space (what is that to C: space,
tab, line feed, vertical tab, form feed, carriage return) or where a comment begins, which runs to the end of its line.
A line ends at a line feed or a carriage return, so that LF, CR LF and lone CR all work (an empty line is no row).
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import kernel
from gmsnet.kernels.text.decimals import LONG, WIDEST, nearest_float, print_decimal, print_float

WORD, BLANK, LINE_END, COMMENT = 0, 1, 2, 3  # what a byte may be

SIGNED, FLOAT, UNSIGNED = 0, 1, 2  # how numbers are printed


@kernel
def find_rows(data, kinds, at, stop, limit, starts, first):
    """The tokens of the next ``limit`` lines that hold any, or as many as there is room for.

    Fills starts (the first byte of each token) and, if it has a length, first (the number of each row's first token).
    Returns the number of rows and of tokens, and the byte behind the last token.
    """
    rows, tokens, end = 0, 0, at
    fresh = True
    while at < stop and tokens < len(starts):
        kind = kinds[data[at]]
        if kind == WORD:
            if fresh:
                if rows == limit:
                    break
                if len(first):
                    first[rows] = tokens
                rows += 1
                fresh = False
            starts[tokens] = at
            tokens += 1
            at += 1
            while at < stop and kinds[data[at]] == WORD:
                at += 1
            end = at
        elif kind == COMMENT:
            while at < stop and kinds[data[at]] != LINE_END:
                at += 1
        else:
            fresh = fresh or kind == LINE_END
            at += 1
    return rows, tokens, end


@kernel
def parse_integers(data, kinds, stop, starts, slash, values):
    """Integers of tokens, [+-]? and 1 to 18 digits; returns the number of the first bad token, or -1.

    slash: a token may go on behind a slash, with digits, signs and slashes only.
    """
    for k in range(len(starts)):
        at = starts[k]
        negative = data[at] == 45
        if negative or data[at] == 43:
            at += 1
        begin = at
        value = np.int64(0)
        while at < stop and 48 <= data[at] <= 57:
            value = value * 10 + np.int64(data[at]) - 48
            at += 1
        if not 1 <= at - begin <= 18:
            return k
        if slash and at < stop and data[at] == 47:
            while at < stop and (47 <= data[at] <= 57 or data[at] == 43 or data[at] == 45):
                at += 1
        if at < stop and kinds[data[at]] == WORD:
            return k
        values[k] = -value if negative else value
    return -1


@kernel
def walk(values, at, head, code_at, more_at, sizes, codes, first):
    """Records one after another in values[at:]: ``head`` numbers, then as many as number ``more_at`` of these says.

    If code_at is not negative, number ``code_at`` is a type, of which ``sizes`` says how many more numbers follow yet,
    0 if it is not known. Fills codes (the types) and first (where each record begins) until first is full or a record
    is cut off or of an unknown type. Returns how many records there are and where the last ends.
    """
    for k in range(len(first)):
        if at + head > len(values):
            return k, at
        length = np.int64(head)
        if code_at >= 0:
            code = values[at + code_at]
            if not 0 <= code < len(sizes) or sizes[code] == 0:
                return k, at
            codes[k] = code
            length += sizes[code]
        if not 0 <= values[at + more_at] <= len(values) - at - length:
            return k, at
        first[k] = at
        at += length + values[at + more_at]
    return len(first), at


@kernel
def parse_floats(data, kinds, stop, starts, bits, ends, slow):
    """Decimal numbers of tokens: fills bits (those of each float64) and ends (the byte behind each token).

    Well-formed is [+-]? (digits [. digits?]? | . digits) ([eEdD] [+-]? 1 to 4 digits)?. Returns the number of the first
    token that is not so, or -1, and how many tokens of ``slow`` are left to a slower way.
    """
    left = 0
    for k in range(len(starts)):
        at = starts[k]
        negative = data[at] == 45
        if negative or data[at] == 43:
            at += 1
        number = np.uint64(0)
        digits, scale = 0, 0  # digits: from the first that is not zero
        good, point, cut = False, False, False
        while at < stop:
            c = data[at]
            if 48 <= c <= 57:
                good = True
                if digits < 19:
                    number = number * np.uint64(10) + np.uint64(c - 48)
                    digits += number > np.uint64(0)
                    scale -= point
                else:
                    cut = True
                    scale += not point
            elif c == 46 and not point:
                point = True
            else:
                break
            at += 1
        if good and at < stop and (data[at] | 32 == 101 or data[at] | 32 == 100):
            at += 1
            down = at < stop and data[at] == 45
            if down or (at < stop and data[at] == 43):
                at += 1
            begin = at
            exponent = 0
            while at < stop and 48 <= data[at] <= 57 and at - begin < 5:
                exponent = exponent * 10 + np.int64(data[at]) - 48
                at += 1
            good = 1 <= at - begin <= 4
            scale += -exponent if down else exponent
        if not good or (at < stop and kinds[data[at]] == WORD):
            return k, left
        ends[k] = at
        value = np.int64(0)
        if number > np.uint64(0):
            value = nearest_float(number, scale, cut)
            if value == LONG:
                slow[left] = k
                left += 1
        bits[k] = value | (np.int64(1) << 63) if negative else value
    return -1, left


@kernel
def replace_floats(data, at, starts, ends, values, out):
    """Copies data from byte ``at`` on into out, with numbers in the places of tokens, which ascend.

    Stops behind the last token, or where out might be too short for the next. Returns how many tokens were replaced,
    the byte of data that comes next and the length of what was written.
    """
    length = 0
    for k in range(len(starts)):
        if length + starts[k] - at + WIDEST > len(out):
            return k, at, length
        while at < starts[k]:
            out[length] = data[at]
            length += 1
            at += 1
        length = print_float(values[k], out, length)
        at = np.int64(ends[k])
    return len(starts), at, length


@kernel
def print_rows(text, cuts, kinds, integers, floats, out):
    """Rows of numbers with words between them. kinds (n,): FLOAT for those of ``floats`` (rows × …), SIGNED or UNSIGNED
    for those of ``integers`` (rows × …, int64 or the bits of uint64).

    text, cuts (n + 1,): text[: cuts[0]] comes before the first number, text[cuts[j] : cuts[j + 1]] behind number j.
    Returns the length of what was written into out, which must be long enough.
    """
    length = 0
    for row in range(len(integers)):
        whole, part, at = 0, 0, 0
        for j in range(len(cuts)):
            while at < cuts[j]:
                out[length] = text[at]
                length += 1
                at += 1
            if j == len(kinds):
                break
            if kinds[j] == FLOAT:
                length = print_float(floats[row, part], out, length)
                part += 1
            else:
                value = integers[row, whole]
                if kinds[j] == SIGNED and value < 0:
                    value = -value
                    out[length] = 45
                    length += 1
                length = print_decimal(np.uint64(value), np.int64(0), out, length)
                whole += 1
    return length
