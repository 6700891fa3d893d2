"""Files that are none, that others change meanwhile, or that are too large: exit 2, one line, nothing overwritten."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
from support.fluent import saved_faces

import gmsnet
from gmsnet.cli import fix
from gmsnet.io import atomic
from gmsnet.run.progress import Progress

CHANGED = (
    "others have changed this file since it was read, so nothing is written over it: "
    "to keep the result, name another output; or read the file again"
)


def meanwhile(monkeypatch, change):
    """Others do something to the input while it is smoothed."""
    pending = [change]

    def sweep(self, sweep):
        if pending:
            pending.pop()()

    monkeypatch.setattr(Progress, "sweep", sweep)


def replaced(path):
    other = path.with_name("theirs")
    other.write_bytes(b"theirs")
    os.replace(other, path)


def copied_over(path):
    """Other contents of the same length."""
    path.write_bytes(b"%" * path.stat().st_size)


def rewritten(path):
    path.write_bytes(b"theirs")


def appended(path):
    with path.open("ab") as stream:
        stream.write(b"% theirs\n")


@pytest.mark.parametrize("change", [replaced, copied_over, rewritten, appended])
def test_in_place_does_not_overwrite_what_others_wrote(run, square, tmp_path, monkeypatch, change):
    theirs = tmp_path / "expected"
    shutil.copy(square, theirs)
    change(theirs)
    meanwhile(monkeypatch, lambda: change(square))
    done = run("smooth", square, "--in-place")
    assert (done.code, done.out, done.err) == (2, "", f"gmsnet: error: {square}: {CHANGED}\n")
    assert square.read_bytes() == theirs.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["expected", "square.su2"]


def test_a_change_while_the_result_is_written_is_seen(run, square, monkeypatch):
    """Of the moments in which it can be seen this is the last: all is on the disk but for the name."""
    sync = os.fsync

    def synced(descriptor):
        sync(descriptor)
        replaced(square)

    monkeypatch.setattr(atomic.os, "fsync", synced)
    done = run("smooth", square, "--in-place")
    assert (done.code, CHANGED in done.err) == (2, True)
    assert square.read_bytes() == b"theirs"


def test_a_link_that_leads_elsewhere_meanwhile(run, square, tmp_path, monkeypatch):
    link, other = tmp_path / "link.su2", tmp_path / "other.su2"
    link.symlink_to(square)
    other.write_bytes(b"theirs")
    before = square.read_bytes()

    def change():
        link.unlink()
        link.symlink_to(other)

    meanwhile(monkeypatch, change)
    done = run("smooth", link, "--in-place")
    assert (done.code, done.err) == (2, f"gmsnet: error: {link}: {CHANGED}\n")
    assert (square.read_bytes(), other.read_bytes()) == (before, b"theirs")


def test_either_file_of_a_pair_counts(run, tmp_path, monkeypatch):
    path = tmp_path / "pair.node"
    gmsnet.write(gmsnet.random_mesh(100, seed=1), path)
    before = path.read_bytes()
    meanwhile(monkeypatch, lambda: rewritten(tmp_path / "pair.ele"))
    done = run("smooth", path, "--in-place")
    assert (done.code, done.err) == (2, f"gmsnet: error: {tmp_path / 'pair.ele'}: {CHANGED}\n")
    assert path.read_bytes() == before


def test_another_output_keeps_both(run, square, tmp_path, monkeypatch):
    expected = tmp_path / "expected.su2"
    assert run("smooth", square, expected).code == 0
    meanwhile(monkeypatch, lambda: rewritten(square))
    assert run("smooth", square, tmp_path / "out.su2").code == 0
    assert (tmp_path / "out.su2").read_bytes() == expected.read_bytes()
    assert square.read_bytes() == b"theirs"


def test_a_file_that_is_gone_or_only_touched_in_its_rights_is_written(run, square, tmp_path, monkeypatch):
    expected = tmp_path / "expected.su2"
    copy = tmp_path / "copy.su2"
    shutil.copy(square, copy)
    assert run("smooth", square, expected).code == 0
    for path, change in ((square, lambda: square.unlink()), (copy, lambda: copy.chmod(0o640))):
        meanwhile(monkeypatch, change)
        assert run("smooth", path, "--in-place").code == 0
        assert path.read_bytes() == expected.read_bytes()


SPECIAL = [
    ["smooth", "/dev/zero", "{out}"],
    ["smooth", "/dev/zero", "{out}", "--format", "su2"],
    ["smooth", "/dev/zero", "--in-place"],
    ["quality", "/dev/urandom"],
    ["quality", "{pipe}"],
    ["smooth", "{in}", "{out}", "--fix", "@/dev/zero"],
    ["smooth", "{in}", "{out}", "--fix", "@/dev/urandom"],
    ["smooth", "{in}", "{out}", "--fix", "@{pipe}"],
    ["smooth", "{in}", "{out}", "--method", "gmsnet", "--weights", "/dev/zero"],
    ["smooth", "{in}", "{out}", "--method", "gmsnet", "--weights", "{pipe}"],
    ["generate", "{out}", "--rings", "/dev/zero"],
    ["generate", "{out}", "--rings", "{pipe}"],
]


@pytest.mark.skipif(not os.path.exists("/dev/urandom"), reason="this system has no such devices")
@pytest.mark.parametrize("arguments", SPECIAL, ids=" ".join)
def test_what_is_no_file_is_refused(run, square, tmp_path, arguments):
    os.mkfifo(tmp_path / "pipe")
    names = {"in": square, "out": tmp_path / "out.su2", "pipe": tmp_path / "pipe"}
    done = run(*(word.format(**names) for word in arguments))
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert any(words in done.err for words in ("no regular file", "is no file", "only a file")), done.err
    assert not (tmp_path / "out.su2").exists()


def test_the_standard_input_stays_one(square, tmp_path):
    command = [sys.executable, "-m", "gmsnet", "smooth"]
    with square.open("rb") as stream:
        for name in ("-", "/dev/stdin"):
            stream.seek(0)
            done = subprocess.run([*command, name, "-", "--quiet"], stdin=stream, capture_output=True, check=True)
            assert done.stdout.startswith(b"NDIME= 2")
    ids = subprocess.run(
        [*command, square, tmp_path / "out.su2", "--fix", "@/dev/stdin"], input=b"5 6", capture_output=True, check=True
    )
    assert b"smoothed" in ids.stdout or ids.stdout


@pytest.mark.skipif(not os.path.exists("/dev/fd"), reason="this system does not name its descriptors")
def test_process_substitution_works(square, tmp_path):
    if shutil.which("bash") is None:
        pytest.skip("there is no bash")
    script = f"{sys.executable} -m gmsnet smooth <(cat '{square}') '{tmp_path}/out.su2' --fix @<(echo 100) --json"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out.su2").exists()


def test_a_list_of_nodes_is_no_larger_than_lists_are(run, square, tmp_path, monkeypatch):
    count = len(gmsnet.read(square).points)
    most = fix.LIST_BYTES + fix.LIST_BYTES_PER_NODE * count
    path = tmp_path / "ids.txt"
    path.write_text("7\n".ljust(most, "#"))
    assert run("smooth", square, tmp_path / "out.su2", "--fix", f"@{path}").code == 0
    path.write_text("7\n".ljust(most + 1, "#"))
    done = run("smooth", square, tmp_path / "other.su2", "--fix", f"@{path}")
    told = f"{path}: too large for a list of {count} nodes, which takes at most {most} bytes"
    assert (done.code, done.err) == (2, f"gmsnet: error: {told}\n")
    assert not (tmp_path / "other.su2").exists()


QUAD = saved_faces(
    np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]), {3: (3, [([k, (k + 1) % 4], -1, 0) for k in range(4)])}, {}, {}
)
MFEM = b"MFEM mesh v1.0\n\ndimension\n2\n\nelements\n1\n1 3 0 1 2 3\nboundary\n0\nvertices\n4\n2\n0 0\n1 0\n1 1\n0 1\n"


@pytest.mark.parametrize(("name", "data"), [("a.msh", QUAD), ("a.mesh", MFEM)], ids=["fluent", "mfem"])
@pytest.mark.parametrize("way", ["out", "folder"])
def test_of_two_formats_with_one_suffix_the_output_has_that_of_the_input(run, name, data, way, tmp_path):
    """Fluent's .msh is no Gmsh, and MFEM's .mesh no Medit. All nodes of these are held."""
    (tmp_path / name).write_bytes(data)
    out = tmp_path / "out" / name
    out.parent.mkdir()
    done = run("smooth", tmp_path / name, *([out] if way == "out" else ["--out-dir", out.parent]))
    assert (done.code, "lost" in done.out) == (0, False)
    assert out.read_bytes() == data
    assert run("smooth", tmp_path / name, out.with_suffix(".vtk")).code == 0
