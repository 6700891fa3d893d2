"""Medit's values at vertices: text and binary, of either byte order and every version; damage is refused."""

from __future__ import annotations

import contextlib
import struct

import numpy as np
import pytest

from gmsnet.errors import FormatError, InputError
from gmsnet.io.sol import read_metric, read_sizes

METRIC = np.array([[4.0, 0.5, 1.0], [2.0, -0.25, 3.0], [1e-3, 0.0, 1e3]])
TEXT = b"""MeshVersionFormatted 2
Dimension 2
SolAtVertices
3
1 3
4 0.5 1
2 -0.25 3 # a comment
1e-3 0 1e3
End
"""
SIZES = b"MeshVersionFormatted 2\nDimension\n3\n\nSolAtVertices\n2\n1 1\n0.5\n.25\n"


def binary(version, order, values, kind, dimension=2):
    place, number, real = "i" if version < 3 else "q", "i" if version < 4 else "q", "f" if version == 1 else "d"
    size = struct.calcsize
    head = struct.pack(order + "ii", 1, version)
    first = len(head) + 4 + size(place) + 4
    start = struct.pack(order + "i", 3) + struct.pack(order + place, first) + struct.pack(order + "i", dimension)
    body = struct.pack(order + number, len(values)) + struct.pack(order + "ii", 1, kind)
    body += struct.pack(f"{order}{values.size}{real}", *values.ravel())
    end = first + 4 + size(place) + len(body)
    keyword = struct.pack(order + "i", 62) + struct.pack(order + place, end)
    return head + start + keyword + body + struct.pack(order + "i", 54) + struct.pack(order + place, 0)


@pytest.fixture
def saved(tmp_path):
    def save(data, name="a.sol"):
        path = tmp_path / name
        path.write_bytes(data)
        return path

    return save


def test_text_is_read(saved):
    assert (read_metric(saved(TEXT)) == METRIC).all()
    assert read_sizes(saved(SIZES)).tolist() == [0.5, 0.25]


@pytest.mark.parametrize("version", [1, 2, 3, 4])
@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_files_are_read(saved, version, order):
    found = read_metric(saved(binary(version, order, METRIC, 3), "a.solb"))
    np.testing.assert_allclose(found, METRIC, rtol=1e-7 if version == 1 else 0)
    sizes = read_sizes(saved(binary(version, order, METRIC[:, :1], 1, dimension=3), "a.solb"))
    np.testing.assert_allclose(sizes, METRIC[:, 0], rtol=1e-7)


@pytest.mark.parametrize("read", [read_metric, read_sizes])
def test_files_that_are_cut_are_refused_at_every_byte(saved, read):
    for data, last in ((TEXT, TEXT.index(b"1e3") + 3), (SIZES, SIZES.index(b".25") + 1)):
        for cut in range(last - 2):
            with pytest.raises(FormatError, match=r"a\.sol: "):
                read(saved(data[:cut]))
    data = binary(2, "<", METRIC, 3)
    for cut in range(len(data) - 8):
        with pytest.raises(FormatError, match=r"a\.sol: "):
            read(saved(data[:cut]))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (SIZES, "at each vertex it holds a number, but a metric is a symmetric tensor"),
        (TEXT.replace(b"Dimension 2", b"Dimension 3"), "Dimension 3: vectors and tensors are read in two dimensions"),
        (TEXT.replace(b"1 3\n", b"2 1 3\n"), r"the types of its fields are \[1, 3\]: one field"),
        (TEXT.replace(b"1 3\n", b"1 7\n"), r"the types of its fields are \[7\]"),
        (TEXT.replace(b"SolAtVertices", b"SolAtTriangles"), "line 3: unknown keyword 'SolAtTriangles'"),
        (TEXT.replace(b"0.5", b"half"), "line 6"),
        (TEXT.replace(b"\n3\n", b"\n-3\n", 1), "line 4"),
        (TEXT.replace(b"\n3\n", b"\n9999999999\n", 1), "is it cut off"),
        (binary(2, "<", METRIC, 3)[:4] + b"\x09\0\0\0", "version 9: known are 1 to 4"),
        (binary(2, "<", METRIC, 1), "it holds a number"),
        (binary(2, "<", METRIC, 3).replace(struct.pack("<ii", 3, 1), struct.pack("<ii", 2**30, 1)), "it is cut off"),
    ],
)
def test_what_is_no_metric_is_refused(saved, data, message):
    with pytest.raises(FormatError, match=message):
        read_metric(saved(data))


def test_files_that_do_not_exist_are_refused(tmp_path):
    with pytest.raises(InputError, match="there is no such file"):
        read_sizes(tmp_path / "none.sol")
    with pytest.raises(InputError, match="folder"):
        read_sizes(tmp_path)


def test_random_damage_is_read_or_refused(saved):
    rng = np.random.default_rng(0)
    for data in (TEXT, binary(3, ">", METRIC, 3)):
        for _ in range(150):
            spoilt = bytearray(data)
            for _ in range(rng.integers(1, 4)):
                spoilt[rng.integers(len(data))] = rng.integers(256)
            with contextlib.suppress(InputError):
                assert read_metric(saved(bytes(spoilt))).shape[1] == 3
