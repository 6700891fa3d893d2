"""Bad input and bad usage: one line that names the place and the mend, exit 2, nothing written, the input as it was."""

from __future__ import annotations

import os
import sys

import pytest
from support.hand_made import vtk_text

TRIANGLES = [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
FLAT = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 2.0, 0.0), (0.0, 2.0, 0.0), (0.9, 1.2, 0.0)]
BENT = [*FLAT[:4], (0.9, 1.2, 0.7)]


def change(old: bytes, new: bytes):
    def changed(data: bytes) -> bytes:
        assert old in data
        return data.replace(old, new, 1)

    return changed


def first_point(text: bytes):
    """The first coordinate of the first point becomes ``text``."""

    def changed(data: bytes) -> bytes:
        head, mark, tail = data.partition(b"NPOIN")
        count, _, rest = tail.partition(b"\n")
        line, _, rest = rest.partition(b"\n")
        return b"\n".join([head + mark + count, b" ".join([text, *line.split()[1:]]), rest])

    return changed


def far_index(data: bytes) -> bytes:
    head, mark, tail = data.partition(b"NELEM")
    count, _, rest = tail.partition(b"\n")
    line, _, rest = rest.partition(b"\n")
    words = line.split()
    return b"\n".join([head + mark + count, b" ".join([words[0], b"99999", *words[2:]]), rest])


FILES = {  # name of the input → its bytes, made from those of a good SU2 file
    "empty.su2": lambda good: b"",
    "blank.su2": lambda good: b" \n\n",
    "cut.su2": lambda good: good[: len(good) // 2],
    "garbage.su2": lambda good: bytes(range(256)) * 40,
    "text.su2": lambda good: b"Dear Sir or Madam,\nthis is no mesh.\n",
    "vtk-inside.su2": lambda good: vtk_text(FLAT, TRIANGLES, 5).encode(),
    "nan.su2": first_point(b"nan"),
    "inf.su2": first_point(b"-inf"),
    "word.su2": first_point(b"1.2.3"),
    "far-index.su2": far_index,
    "hexes.vtk": lambda good: vtk_text(BENT, [(0, 1, 2, 3, 4, 0, 1, 2)], 12).encode(),
    "cut.vtk": lambda good: vtk_text(FLAT, TRIANGLES, 5).encode()[:-30],
    "good.xyz": lambda good: good,
    "packed.su2.gz": lambda good: b"\x1f\x8b" + good,
}

BAD_FILES = [  # input, what the message must hold
    ("missing.su2", ["missing.su2", "no such file"]),
    ("empty.su2", ["empty.su2", "empty"]),
    ("blank.su2", ["blank.su2", "empty"]),
    ("cut.su2", ["cut.su2", "line"]),
    ("garbage.su2", ["garbage.su2", "binary"]),
    ("text.su2", ["text.su2"]),
    ("vtk-inside.su2", ["vtk-inside.su2", "VTK", ".vtk"]),
    ("nan.su2", ["nan.su2", "nan"]),
    ("inf.su2", ["inf.su2", "inf"]),
    ("word.su2", ["word.su2", "line", "1.2.3"]),
    ("far-index.su2", ["far-index.su2", "99999", "line"]),
    ("cut.vtk", ["cut.vtk"]),
    ("good.xyz", ["good.xyz", ".su2", "--format"]),
    ("packed.su2.gz", ["packed.su2.gz", "damaged", "unpack"]),
    ("", ["folder"]),
]

BAD_USAGE = [  # arguments after ``smooth``, what the message must hold; {in} is a good input, {dir} its folder
    (["{in}"], ["output is missing", "--in-place"]),
    (["{in}", "{in}"], ["is the input", "--in-place"]),
    (["{in}", "{dir}/./square.su2"], ["is the input", "--in-place"]),
    (["{in}", "{dir}/symbolic.su2"], ["is the input", "--in-place"]),
    (["{in}", "{dir}/hard.su2"], ["is the input", "--in-place"]),
    (["{in}", "{dir}/out.su2", "--in-place"], ["--in-place", "leave out"]),
    (["-", "--in-place"], ["only a file can be smoothed in place"]),
    (["{dir}/pair.node", "{dir}/pair.ele"], ["is the input"]),
    (["{dir}/pair.ele", "{dir}/pair.node", "--output-format", "su2"], ["is the input"]),
    (["{in}", "{dir}/nowhere/out.su2"], ["nowhere", "does not exist", "make it first"]),
    (["{in}", "{in}/out.su2"], ["square.su2 is not a folder"]),
    (["{in}", "{dir}"], ["folder", "name of a file"]),
    (["{in}", "{dir}/out"], ["no suffix", "--output-format"]),
    (["{in}", "{dir}/out.xyz"], ["'.xyz'", "--output-format", ".su2"]),
    (["{in}", "{dir}/out.su2", "--output-format", "xyz"], ["unknown format 'xyz'", "su2"]),
    (["{in}", "{dir}/out.su2", "--format", "xyz"], ["unknown format 'xyz'", "su2"]),
    (["{in}", "{dir}/out.su2", "--method", "gmsnett"], ["unknown method 'gmsnett'", "did you mean gmsnet"]),
    (["{in}", "{dir}/out.su2", "--method", "zzz"], ["unknown method 'zzz'", "gmsnet"]),
    (["{in}", "{dir}/out.su2", "--target-quality", "0"], ["target_quality", "(0, 1]"]),
    (["{in}", "{dir}/out.su2", "--target-quality", "nan"], ["target_quality", "(0, 1]"]),
    (["{in}", "{dir}/out.su2", "--target-quality", "much"], ["--target-quality", "nvalid"]),
    (["{in}", "{dir}/out.su2", "--threads", "0"], ["--threads", "1"]),
    (["{in}", "{dir}/out.su2", "--max-sweeps", "-1"], ["--max-sweeps", "0"]),
    (["{in}", "{dir}/out.su2", "--method", "gmsnet", "--weights", "{dir}/none.safetensors"], ["none.safetensors"]),
    (["{in}", "{dir}/out.su2", "--method", "gmsnet", "--weights", "{in}"], ["square.su2"]),
    (["{in}", "{dir}/out.su2", "--weights", "{in}"], ["auto has no weights", "gmsnet"]),
    (["{in}", "{dir}/out.su2", "--plot", "{dir}/picture.bmp"], ["picture.bmp", ".png, .svg or .pdf"]),
    (["{in}", "{dir}/out.su2", "--plot", "{dir}/picture"], ["no suffix", ".png, .svg or .pdf"]),
    (["{in}", "{dir}/out.su2", "--plot", "{dir}/nowhere/p.png"], ["nowhere", "does not exist"]),
    (["{in}", "{dir}/out.png", "--output-format", "su2", "--plot", "{dir}/out.png"], ["overwrite the mesh"]),
    (["{in}", "-", "--json"], ["--json", "standard output"]),
    (["{in}", "/dev/stdout", "--json"], ["--json", "standard output"]),
    (["{in}", "/dev/fd/1", "--json"], ["--json", "standard output"]),
    (["{dir}/pair.node", "-"], ["Triangle takes several files"]),
    (["{in}", "-", "--output-format", "triangle"], ["standard output", "Triangle takes several files"]),
    (["{in}", "{dir}/out.gz"], ["no suffix", "--output-format"]),
    (["{in}", "{dir}/symbolic.png", "--output-format", "su2", "--plot", "{dir}/new.png"], ["overwrite the mesh"]),
    (["{in}", "{dir}/out.su2", "--sweeps", "3"], ["No such option", "--sweeps"]),
    ([], ["Missing argument 'IN'"]),
]


@pytest.fixture
def folder(tmp_path, square):
    for name, made in FILES.items():
        (tmp_path / name).write_bytes(made(square.read_bytes()))
    (tmp_path / "symbolic.su2").symlink_to(square)
    (tmp_path / "symbolic.png").symlink_to(tmp_path / "new.png")
    (tmp_path / "input.png").symlink_to(square)
    os.link(square, tmp_path / "hard.su2")
    (tmp_path / "pair.node").write_text("3 2 0 0\n1 0 0\n2 1 0\n3 0 1\n")
    (tmp_path / "pair.ele").write_text("1 3 0\n1 1 2 3\n")
    return tmp_path


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def check(done, folder, before, words):
    assert done.code == 2
    assert done.out == ""
    assert done.err.startswith("gmsnet: error: ")
    assert done.err.count("\n") == 1, "one line"
    assert "Traceback" not in done.err
    for word in words:
        assert word in done.err
    assert contents(folder) == before


@pytest.mark.parametrize(("name", "words"), BAD_FILES, ids=[name or "folder" for name, _ in BAD_FILES])
def test_bad_files(run, folder, name, words):
    before = contents(folder)
    check(run("smooth", folder / name, folder / "out.su2"), folder, before, words)


def test_cells_that_name_a_node_twice_are_held_and_not_drawn(run, folder):
    before = (folder / "hexes.vtk").read_text()
    done = run("smooth", folder / "hexes.vtk", folder / "out.vtk")
    assert done.code == 0
    assert "written unchanged" in done.out
    assert (folder / "out.vtk").read_text() == before
    done = run("quality", folder / "hexes.vtk", "--plot", folder / "picture.png")
    assert done.code == 2
    assert "has none that is measured" in done.err
    assert not (folder / "picture.png").exists()


@pytest.mark.parametrize("name", [name for name, _ in BAD_FILES])
def test_bad_files_are_not_measured_either(run, folder, name):
    before = contents(folder)
    check(run("quality", folder / name, "--plot", folder / "picture.png"), folder, before, [name])


@pytest.mark.parametrize(("arguments", "words"), BAD_USAGE, ids=[" ".join(a) or "none" for a, _ in BAD_USAGE])
def test_bad_usage(run, folder, arguments, words):
    before = contents(folder)
    given = [each.replace("{in}", str(folder / "square.su2")).replace("{dir}", str(folder)) for each in arguments]
    check(run("smooth", *given), folder, before, words)


def test_an_output_folder_that_nothing_can_be_written_in(run, folder):
    if not sys.platform.startswith("linux"):
        pytest.skip("/proc is a folder of Linux")
    before = contents(folder)
    check(run("smooth", folder / "square.su2", "/proc/out.su2"), folder, before, ["/proc/out.su2", "nothing can be"])


def test_a_write_protected_output(run, folder, monkeypatch):
    out = folder / "out.su2"
    out.write_text("precious")
    monkeypatch.setattr(os, "access", lambda path, mode: os.fspath(path) != str(out))  # tests may run as root
    before = contents(folder)
    check(run("smooth", folder / "square.su2", out), folder, before, ["out.su2", "write-protected"])


def test_a_format_that_cannot_hold_the_cells_is_found_before_the_smoothing(run, folder, quads, monkeypatch):
    def never(*arguments, **options):
        raise AssertionError("the smoothing began")

    monkeypatch.setattr("gmsnet.run.api.smooth_with", never)
    before = contents(folder)
    check(run("smooth", quads, folder / "out.stl"), folder, before, ["out.stl", "STL"])


@pytest.mark.parametrize("command", [["quality", "{in}"], ["smooth", "{in}", "{dir}/out.su2"]])
def test_a_picture_over_the_input(run, folder, command):
    before = contents(folder)
    given = [each.replace("{in}", str(folder / "square.su2")).replace("{dir}", str(folder)) for each in command]
    check(run(*given, "--plot", folder / "input.png"), folder, before, ["input.png", "overwrite the mesh"])


@pytest.mark.parametrize("value", ["2", "-1.5", "nan"])
def test_a_threshold_out_of_range(run, folder, value):
    before = contents(folder)
    check(run("quality", folder / "square.su2", "--threshold", value), folder, before, ["--threshold", "between"])


def test_more_nodes_than_there_is_memory_for(run, tmp_path):
    done = run("generate", tmp_path / "out.su2", "--nodes", 10**14)
    assert done.code == 2
    assert done.err.startswith("gmsnet: error: the memory does not suffice: ")
    assert not list(tmp_path.iterdir())
