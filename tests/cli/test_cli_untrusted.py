"""Names and texts out of files that somebody else made: shown, but never obeyed by the terminal."""

from __future__ import annotations

import json
import re

import pytest

import gmsnet
from gmsnet.mesh.display import visible
from gmsnet.mesh.mesh import Mesh

HARM = "\x1b]0;title\x07\x1b[2J\x9b31m\u202etxt.\x7f"
CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


def harmless(done):
    return not CONTROL.search(done.out + done.err)


def test_only_control_characters_are_shown_in_another_way():
    assert visible("größer 网格 🙂 [red]\nnext") == "größer 网格 🙂 [red]\nnext"
    assert visible(HARM) == r"\x1b]0;title\x07\x1b[2J\x9b31m\u202etxt.\x7f"
    assert not CONTROL.search(visible("".join(map(chr, range(0x3000)))))


@pytest.mark.parametrize("suffix", [".su2", ".msh", ".vtk", ".vtu"])
def test_names_in_a_mesh(run, tmp_path, suffix):
    mesh = gmsnet.random_mesh(30, seed=1)
    names = {key: f"{name}{HARM}" for key, name in mesh.region_names.items()}
    path = tmp_path / f"in{suffix}"
    gmsnet.write(Mesh(mesh.points, mesh.cells, names), path)
    if suffix == ".su2":  # its writer leaves out what it cannot hold; here it stands in the file
        path.write_bytes(
            re.sub(rb"(MARKER_TAG=\s*)(\S+)", rb"\1\2" + HARM.replace("\x9b", "").encode(), path.read_bytes())
        )
    for arguments in (["smooth", path, tmp_path / "out.off"], ["quality", path], ["smooth", path, path]):
        assert harmless(run(*arguments))
    wrong = run("smooth", path, tmp_path / "new.su2", "--fix", "nowhere")
    assert wrong.code == 2
    assert "nowhere" in wrong.err
    assert harmless(wrong)


def test_wrong_words_in_a_mesh(run, tmp_path):
    path = tmp_path / "in.su2"
    gmsnet.write(gmsnet.random_mesh(30, seed=1), path)
    for place in (rb"NPOIN=", rb"NELEM=", rb"NDIME=", rb"MARKER_ELEMS=", rb"NMARK="):
        text = path.read_bytes()
        path.write_bytes(re.sub(place + rb"\s*\S+", place + b" " + HARM.replace("\x9b", "").encode(), text, count=1))
        done = run("quality", path)
        assert done.code == 2
        assert harmless(done)
        path.write_bytes(text)


@pytest.mark.parametrize("command", [["smooth", "{}", "{out}"], ["quality", "{}"], ["smooth", "{}", "{}"]])
def test_names_of_files(run, tmp_path, command):
    path = tmp_path / f"in{HARM}.su2"
    for exists in (False, True):
        if exists:
            gmsnet.write(gmsnet.random_mesh(30, seed=1), path)
        given = [word.replace("{out}", f"{path}.out.su2").replace("{}", str(path)) for word in command]
        done = run(*given)
        assert harmless(done)
        assert r"\x1b]0;title\x07" in done.out + done.err
    document = json.loads(run("quality", path, "--json").out)
    assert document["input"] == str(path)


@pytest.mark.parametrize("text", [b"\xff\xfe", b"[" * 100_000, b"1e999", b"3 \x1b[2J"])
def test_files_beside_the_mesh(run, tmp_path, text):
    """Node ids for --fix, rings for generate."""
    gmsnet.write(gmsnet.random_mesh(30, seed=1), tmp_path / "in.su2")
    (tmp_path / "text").write_bytes(text)
    for arguments in (
        ["smooth", tmp_path / "in.su2", tmp_path / "out.su2", "--fix", f"@{tmp_path / 'text'}"],
        ["generate", tmp_path / "out.su2", "--rings", tmp_path / "text"],
    ):
        done = run(*arguments)
        assert done.code == 2
        assert done.err.startswith("gmsnet: error: ")
        assert harmless(done)
    assert not (tmp_path / "out.su2").exists()
