"""Compiled tokenizer of text files: spans of tokens, tokens by line, decimal numbers.

White space is what it is to C: space, tab, line feed, vertical tab, form feed, carriage return. A line ends at a
line feed or a carriage return, so that LF, CR LF and lone CR all work (an empty line is no row).
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.compile import kernel

# 10**0 … 10**22: the powers of ten that float64 holds exactly
POWERS = np.array([float(10**k) for k in range(23)])

DONE, LONG, BAD = 0, 1, 2


@kernel
def find_tokens(data, start, stop, spans):
    """Fills spans (n, 2) with the first n tokens of data[start:stop]; returns how many there were, at most n."""
    found = 0
    at = start
    while found < len(spans):
        while at < stop and (data[at] == 32 or 9 <= data[at] <= 13):
            at += 1
        if at == stop:
            break
        spans[found, 0] = at
        while at < stop and not (data[at] == 32 or 9 <= data[at] <= 13):
            at += 1
        spans[found, 1] = at
        found += 1
    return found


@kernel
def find_rows(data, start, stop, limit, spans, first):
    """The tokens of the next ``limit`` lines that hold any.

    Fills spans (tokens, 2) and first (rows,), the number of each row's first token, as far as their lengths go (none
    at all: it only counts). Returns the number of rows, of tokens, and the byte behind the last token.
    """
    rows = 0
    tokens = 0
    end = start
    at = start
    fresh = True
    while at < stop:
        c = data[at]
        if c == 10 or c == 13:
            fresh = True
            at += 1
        elif c == 32 or 9 <= c <= 12:
            at += 1
        else:
            if fresh:
                if rows == limit:
                    break
                if rows < len(first):
                    first[rows] = tokens
                rows += 1
                fresh = False
            begin = at
            while at < stop and not (data[at] == 32 or 9 <= data[at] <= 13):
                at += 1
            if tokens < len(spans):
                spans[tokens, 0] = begin
                spans[tokens, 1] = at
            tokens += 1
            end = at
    return rows, tokens, end


@kernel
def parse_floats(data, spans, powers, values, state):
    """Decimal numbers of tokens. state: 0 if the value is exact, 1 if well-formed but left to a slower way, 2 if bad.

    Well-formed is [+-]? (digits [. digits?]? | . digits) ([eEdD] [+-]? 1 to 4 digits)?. A mantissa below 2**53 times
    or divided by an exact power of ten is rounded once, hence correctly; all others are not attempted here.
    """
    for k in range(len(spans)):
        at, end = spans[k, 0], spans[k, 1]
        negative = False
        if at < end and (data[at] == 43 or data[at] == 45):
            negative = data[at] == 45
            at += 1
        mantissa = np.int64(0)
        digits = 0
        scale = 0
        point = False
        exact = True
        while at < end:
            c = data[at]
            if 48 <= c <= 57:
                digits += 1
                if mantissa < 900719925474099:  # times ten plus nine stays below 2**53
                    mantissa = mantissa * 10 + np.int64(c - 48)
                    scale -= point
                else:
                    exact = False
            elif c == 46 and not point:
                point = True
            else:
                break
            at += 1
        good = digits > 0
        if good and at < end:
            c = data[at]
            good = c == 69 or c == 101 or c == 68 or c == 100
            at += 1
            down = False
            if at < end and (data[at] == 43 or data[at] == 45):
                down = data[at] == 45
                at += 1
            good = good and 1 <= end - at <= 4
            exponent = 0
            while good and at < end:
                good = 48 <= data[at] <= 57
                exponent = exponent * 10 + np.int64(data[at]) - 48
                at += 1
            scale += -exponent if down else exponent
        values[k] = 0.0
        if not good:
            state[k] = 2
        elif not exact or abs(scale) > 22:
            state[k] = 1
        else:
            value = float(mantissa)
            value = value * powers[scale] if scale >= 0 else value / powers[-scale]
            values[k] = -value if negative else value
            state[k] = 0


@kernel
def parse_ints(data, spans, values):
    """Integers of tokens, [+-]? and 1 to 18 digits; returns the number of the first bad token, or -1."""
    for k in range(len(spans)):
        at, end = spans[k, 0], spans[k, 1]
        negative = False
        if at < end and (data[at] == 43 or data[at] == 45):
            negative = data[at] == 45
            at += 1
        if not 1 <= end - at <= 18:
            return k
        value = np.int64(0)
        while at < end:
            c = data[at]
            if not 48 <= c <= 57:
                return k
            value = value * 10 + np.int64(c - 48)
            at += 1
        values[k] = -value if negative else value
    return -1


@kernel
def gather_tokens(data, spans, out):
    """Copies tokens into the rows of out (tokens, width), which is zero where a token is shorter."""
    for k in range(len(spans)):
        for j in range(spans[k, 1] - spans[k, 0]):
            out[k, j] = data[spans[k, 0] + j]


@kernel
def cut_at_slash(data, spans):
    """Ends each token at its first slash; behind it there may be digits, signs and slashes only.

    Returns the number of the first token in which something else follows, or -1.
    """
    for k in range(len(spans)):
        at, end = spans[k, 0], spans[k, 1]
        while at < end and data[at] != 47:
            at += 1
        spans[k, 1] = at
        while at < end:
            if not (47 <= data[at] <= 57 or data[at] == 43 or data[at] == 45):
                return k
            at += 1
    return -1


@kernel
def replace_spans(data, spans, text, words, out):
    """Copies data into out, with word k of text in the place of span k; both (n, 2), spans ascending and disjoint."""
    at = 0
    end = 0
    for k in range(len(spans)):
        for j in range(at, spans[k, 0]):
            out[end] = data[j]
            end += 1
        for j in range(words[k, 0], words[k, 1]):
            out[end] = text[j]
            end += 1
        at = spans[k, 1]
    for j in range(at, len(data)):
        out[end] = data[j]
        end += 1
