"""``gmsnet deform``: markers that move and turn, files of displacements, what is written and what is said."""

from __future__ import annotations

import json

import numpy as np
import pytest

import gmsnet
from gmsnet.cli.moves import joined
from gmsnet.generate import moved_hole_mesh
from gmsnet.io import write


@pytest.fixture(scope="module")
def plate_mesh():
    return moved_hole_mesh(0.06, shift=0.0)


@pytest.fixture
def plate(tmp_path, plate_mesh):
    path = tmp_path / "plate.su2"
    write(plate_mesh, path)
    return path


def test_the_values_of_an_option_are_one_argument():
    given = ["deform", "a", "--move", "hole", "-1", "2", "b", "--rotate", "hole", "3", "--", "--move", "x"]
    assert joined(given) == [
        "deform", "a", "--move", "hole\0-1\0002", "b", "--rotate", "hole\0003\0--\0--move", "x",
    ]  # fmt: skip


def test_volumes_take_as_many_numbers_as_follow():
    given = ["deform", "a", "--move", "hole", "-1", "2", "3", "b", "--rotate", "hole", "3", *"0001", "0", "0", "b"]
    assert joined(given) == [
        "deform", "a", "--move", "hole\0-1\0002\0003", "b", "--rotate", "hole\0003\0000\0000\0000\0001\0000\0000", "b",
    ]  # fmt: skip


@pytest.fixture
def cube(tmp_path):
    path = tmp_path / "cube.su2"
    write(gmsnet.generate.random_volume(200, seed=1), path)
    return path


def test_a_side_of_a_volume_turns_and_moves(run, cube, tmp_path):
    out = tmp_path / "out.su2"
    done = run(
        "deform", cube, out, "--rotate", "top", "5", "0.5", "0.5", "1", "0", "0", "2", "--move", "top", "0", "0", "0.05"
    )
    assert (done.code, done.err) == (0, "")
    assert "the boundary is in place" in done.out
    before, after = gmsnet.read(cube), gmsnet.read(out)
    ids, angle = before.markers["top"], np.radians(5.0)
    x, y, z = before.points[ids].T - 0.5
    wanted = (
        np.column_stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, z + 0.05]) + 0.5
    )
    assert after.points[ids] == pytest.approx(wanted, abs=1e-15)
    assert gmsnet.quality(after).inverted == 0


def test_a_file_of_displacements_of_a_volume(run, cube, tmp_path):
    mesh, out, moves = gmsnet.read(cube), tmp_path / "out.su2", tmp_path / "moves.txt"
    ids = mesh.markers["top"]
    moves.write_text("".join(f"{node} 0 0 0.0625\n" for node in ids))
    assert run("deform", cube, out, "--displacement", moves).code == 0
    assert (gmsnet.read(out).points[ids] == mesh.points[ids] + [0.0, 0.0, 0.0625]).all()
    moves.write_text("".join(f"{x!r} {y!r} {z + 0.0625 * (z == 1.0)!r}\n" for x, y, z in mesh.points.tolist()))
    again = tmp_path / "again.su2"
    assert run("deform", cube, again, "--displacement", moves).code == 0
    assert again.read_bytes() == out.read_bytes()
    moves.write_text("3 0.1\n")
    done = run("deform", cube, out, "--displacement", moves)
    assert (done.code, done.err) == (
        2,
        f"gmsnet: error: {moves}, line 1: 2 values: give lines 'node dx dy dz', or a table with one line 'x y z' for "
        "each node of the mesh, its new place\n",
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--move", "top", "1", "0"), "--move takes MARKER DX DY DZ for a volume, got 2 numbers after 'top'"),
        (("--rotate", "top", "1", "0", "0"), "--rotate takes MARKER DEGREES CX CY CZ AX AY AZ for a volume"),
        (("--rotate", "top", "1", "0", "0", "0", "0", "0", "0"), "the axis of a rotation must have a length"),
        (("--rotate", "top", "1", "0", "0", "0"), "--rotate takes MARKER DEGREES CX CY or MARKER DEGREES CX CY CZ AX"),
    ],
)
def test_numbers_that_a_volume_does_not_take(run, cube, tmp_path, arguments, message):
    done = run("deform", cube, tmp_path / "out.su2", *arguments)
    assert done.code == 2
    assert message in done.err


def test_numbers_that_a_mesh_in_a_plane_does_not_take(run, plate, tmp_path):
    done = run("deform", plate, tmp_path / "out.su2", "--move", "hole", "0", "0", "1")
    assert done.code == 2
    assert "--move takes MARKER DX DY for a mesh in a plane, got 3 numbers after 'hole'" in done.err


def test_a_marker_is_moved_and_only_coordinates_change(run, plate, tmp_path):
    out = tmp_path / "out.su2"
    done = run("deform", plate, out, "--move", "hole", "-0.1", "0.05")
    assert (done.code, done.err) == (0, "")
    assert "the boundary is in place (in 1 step)" in done.out
    before, after = gmsnet.read(plate), gmsnet.read(out)
    ids = before.markers["hole"]
    assert (after.points[ids, :2] == before.points[ids, :2] + [-0.1, 0.05]).all()
    assert gmsnet.quality(after).inverted == 0
    old, new = plate.read_text().splitlines(), out.read_text().splitlines()
    assert len(old) == len(new)
    changed = [k for k, (one, other) in enumerate(zip(old, new, strict=True)) if one != other]
    first = next(k for k, line in enumerate(old) if line.startswith("NPOIN"))
    assert min(changed) > first
    assert max(changed) <= first + len(before.points)


def test_several_moves_and_rotations_add_up(run, plate, tmp_path):
    out = tmp_path / "out.su2"
    done = run(
        "deform", plate, out, "--rotate", "hole", "90", "0.5", "0.5", "--move", "hole", "0.1", "0", "--move", "hole",
        "0", "1e-1", "--json",
    )  # fmt: skip
    document = json.loads(done.out)
    assert (done.code, document["fraction"], document["steps"], document["reason"]) == (0, 1.0, 1, "")
    assert document["after"]["inverted"] == 0
    ids = gmsnet.read(plate).markers["hole"]
    x, y = (gmsnet.read(plate).points[ids, :2] - 0.5).T
    assert gmsnet.read(out).points[ids, :2] == pytest.approx(np.column_stack([0.6 - y, 0.6 + x]))


def test_what_cannot_be_reached_is_told_with_exit_code_1(run, plate, tmp_path):
    out = tmp_path / "out.su2"
    done = run("deform", plate, out, "--move", "hole", "0.5", "0", "--quiet")
    assert done.code == 1
    assert done.err.startswith("gmsnet: not in place: the boundary has come 6")
    assert "boundaries would cross each other at 1 0." in done.err
    assert gmsnet.quality(gmsnet.read(out)).inverted == 0


def test_a_file_of_displacements(run, plate, tmp_path):
    mesh, out, moves = gmsnet.read(plate), tmp_path / "out.su2", tmp_path / "moves.txt"
    ids = mesh.markers["hole"]
    moves.write_text("# node dx dy\n" + "".join(f"{node}, 0.05 -0.025  # moved\n\n" for node in ids))
    assert run("deform", plate, out, "--displacement", moves).code == 0
    assert (gmsnet.read(out).points[ids, :2] == mesh.points[ids, :2] + [0.05, -0.025]).all()


def test_a_table_of_places_is_reached_bit_for_bit(run, plate, tmp_path):
    mesh, out, table = gmsnet.read(plate), tmp_path / "out.su2", tmp_path / "places.csv"
    ids, places = mesh.markers["hole"], mesh.points[:, :2].copy()
    places[ids] = 0.5 + 1.1 * (places[ids] - 0.5)
    table.write_text("".join(f"{x!r} {y!r}\n" for x, y in places.tolist()))
    assert run("deform", plate, out, "--displacement", table).code == 0
    assert (gmsnet.read(out).points[ids, :2] == places[ids]).all()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file has no displacements"),
        ("3 0.1\n", "2 places"),
        ("3 0.1 0.2 0.3\n", "line 1: 4 values"),
        ("3 0.1 0.2\n4 0.1\n", "line 2: 2 values"),
        ("3 0.1 x\n", "line 1: 'x' is not a finite number"),
        ("3 0.1 nan\n", "line 1: 'nan' is not a finite number"),
        ("-3 0.1 0.1\n", "line 1: '-3' is not a node"),
        ("3 0 1\n\n3 1 0\n", "line 3: node 3 is named for a second time"),
        ("999999 0.1 0.2\n", "line 1: there is no node 999999"),
        (b"\xff\xfe\x00", "this is not a file of displacements"),
    ],
)
def test_files_that_are_no_displacements(run, plate, tmp_path, text, message):
    moves, out = tmp_path / "moves.txt", tmp_path / "out.su2"
    moves.write_bytes(text if isinstance(text, bytes) else text.encode())
    done = run("deform", plate, out, "--displacement", moves)
    assert done.code == 2
    assert done.err.startswith(f"gmsnet: error: {moves}")
    if text != "3 0.1\n":
        assert message in done.err
    else:
        assert "1 places for a mesh of" in done.err
    assert not out.exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "nothing to move"),
        (("--move", "hole", "1"), "--move takes MARKER DX DY"),
        (("--move", "hole", "1", "b"), "'b' is not a finite number"),
        (("--move", "hall", "1", "2"), "no marker 'hall'; it has"),
        (("--rotate", "hole", "1", "2"), "--rotate takes MARKER DEGREES CX CY"),
        (("--displacement", "missing.txt"), "missing.txt: the displacements cannot be read"),
        (("--move", "hole", "0.1", "0", "--fix", "hole"), "which is to be moved"),
    ],
)
def test_bad_usage(run, plate, tmp_path, arguments, message):
    out = tmp_path / "out.su2"
    done = run("deform", plate, out, *arguments)
    assert done.code == 2
    assert message in done.err
    assert not out.exists()


def test_in_place(run, plate):
    before = gmsnet.read(plate)
    assert run("deform", plate, "--in-place", "--move", "hole", "0.01", "0", "-q").code == 0
    ids = before.markers["hole"]
    assert (gmsnet.read(plate).points[ids, 0] == before.points[ids, 0] + 0.01).all()
