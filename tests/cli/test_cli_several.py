"""Several files in one call: which they are, what is said of each, and that one that fails does not stop the others."""

from __future__ import annotations

import gzip
import importlib
import json
import shutil
from pathlib import Path

import pytest

import gmsnet
from gmsnet.cli.file_work import FileWork
from gmsnet.generate import random_mesh, random_volume


@pytest.fixture
def folder(tmp_path):
    """a.su2, b.vtk and c.mesh, of which c has tetrahedra, and what is no mesh."""
    made = tmp_path / "in"
    made.mkdir()
    for name, mesh in {"a.su2": random_mesh(60, seed=1), "b.vtk": random_mesh(60, seed=2)}.items():
        gmsnet.write(mesh, made / name)
    gmsnet.write(random_volume(30, seed=3), made / "c.mesh")
    (made / "notes.txt").write_text("no mesh")
    return made


def names(folder):
    return sorted(path.name for path in folder.iterdir()) if folder.exists() else []


def test_a_folder_is_all_its_meshes(run, folder, tmp_path):
    out = tmp_path / "fixed"
    done = run("smooth", folder, "--out-dir", out)
    assert (done.code, done.err) == (0, "")
    assert names(out) == ["a.su2", "b.vtk", "c.mesh"]
    lines = done.out.splitlines()
    assert [line.partition(" ")[0] for line in lines[:3]] == ["[1/3]", "[2/3]", "[3/3]"]
    assert lines[3:] == ["3 files: 3 done"]
    for name, line in zip(names(out), lines, strict=False):
        mesh = gmsnet.read(folder / name)
        assert gmsnet.read(out / name).points.tolist() == gmsnet.smooth(mesh).mesh.points.tolist()
        least = [gmsnet.quality(gmsnet.read(each / name)).shape.min() for each in (folder, out)]
        assert f"least {least[0]:.4f} → {least[1]:.4f}" in line
        assert line.endswith(str(out / name))


def test_files_and_patterns_and_another_format(run, folder, tmp_path):
    out = tmp_path / "fixed"
    done = run("smooth", folder / "a.su2", f"{folder}/*.[vm]*", "--out-dir", out, "--output-format", "vtu", "-q")
    assert (done.code, done.out, done.err) == (0, "", "")
    assert names(out) == ["a.vtu", "b.vtu", "c.vtu"]


def test_json_is_a_line_for_each_and_a_bad_file_stops_none(run, folder, tmp_path):
    (folder / "a2.su2").write_text("garbage")
    done = run("smooth", folder, folder / "gone.su2", "--out-dir", tmp_path / "fixed", "--json")
    assert done.code == 2
    documents = [json.loads(line) for line in done.out.splitlines()]
    assert [document["input"] for document in documents] == [
        str(folder / name) for name in ("a.su2", "a2.su2", "b.vtk", "c.mesh", "gone.su2")
    ]
    assert ["error" in document for document in documents] == [False, True, False, False, True]
    assert "line 1: a keyword such as NDIME=" in documents[1]["error"]
    assert documents[0]["output"] == str(tmp_path / "fixed" / "a.su2")
    assert names(tmp_path / "fixed") == ["a.su2", "b.vtk", "c.mesh"]
    assert len(done.err.splitlines()) == 2
    assert all(line.startswith("gmsnet: error: ") for line in done.err.splitlines())


def test_the_exit_code_is_that_of_the_worst(run, folder, tmp_path):
    done = run("smooth", folder / "a.su2", folder / "b.vtk", "--out-dir", tmp_path, "--target-quality", 0.99)
    assert done.code == 1
    assert [line.partition(" target")[0] for line in done.err.splitlines() if line.startswith("gmsnet")] == [
        "gmsnet: [1/2]", "gmsnet: [2/2]",
    ]  # fmt: skip
    assert done.out.splitlines()[-1] == "2 files: 2 with cells that miss what was asked for"
    (folder / "b.vtk").write_text("")
    done = run("smooth", folder / "b.vtk", folder / "a.su2", "--out-dir", tmp_path, "--target-quality", 0.99)
    assert done.code == 2
    assert done.out.splitlines()[-1] == "2 files: 1 with cells that miss what was asked for, 1 failed"


def test_a_bug_with_one_file_stops_none_either(run, folder, tmp_path, monkeypatch):
    genuine = FileWork._work

    def broken(self, *arguments):
        if self.input.endswith("a.su2"):
            raise ZeroDivisionError("some bug")
        return genuine(self, *arguments)

    monkeypatch.setattr(FileWork, "_work", broken)
    done = run("smooth", folder, "--out-dir", tmp_path / "fixed")
    assert done.code == 70
    assert "internal error: ZeroDivisionError: some bug" in done.err
    assert names(tmp_path / "fixed") == ["b.vtk", "c.mesh"]


def test_an_interruption_writes_what_there_is_and_begins_no_other(run, folder, tmp_path, monkeypatch):
    genuine = FileWork.after_sweep

    def after_sweep(self, sweep):
        self.interruption.caught = True
        genuine(self, sweep)

    monkeypatch.setattr(FileWork, "after_sweep", after_sweep)
    done = run("smooth", folder, "--out-dir", tmp_path / "fixed")
    assert done.code == 130
    assert names(tmp_path / "fixed") == ["a.su2"]
    assert "interrupted; 2 files of 3 not begun" in done.err


@pytest.mark.parametrize("several", [False, True])
def test_a_dry_run_does_everything_but_write(run, folder, tmp_path, several):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    where = ["--out-dir", tmp_path / "fixed"] if several else []
    done = run("smooth", folder / "a.su2", *where, "--dry-run", "--json")
    document = json.loads(done.out)
    assert (done.code, document["output"], document["improved"]) == (0, None, True)
    assert document["after"] == gmsnet.smooth(gmsnet.read(folder / "a.su2")).after.summary()
    assert run("smooth", folder / "a.su2", *where, "--dry-run").out.count("not written" if several else "left as") == 1
    assert names(tmp_path) == ["in"]
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_a_dry_run_with_an_output_or_in_place_writes_neither(run, folder, tmp_path):
    before = (folder / "a.su2").read_bytes()
    assert run("smooth", folder / "a.su2", tmp_path / "out.vtu", "--dry-run").code == 0
    assert run("smooth", folder / "a.su2", "--in-place", "--dry-run").code == 0
    assert names(tmp_path) == ["in"]
    assert (folder / "a.su2").read_bytes() == before
    done = run("smooth", folder / "c.mesh", tmp_path / "out.off", "--dry-run")
    assert done.code == 2
    assert "out.off" in done.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{dir}/a.su2", "{dir}/b.vtk", "{dir}/c.mesh"], ["several inputs", "--out-dir FOLDER"]),
        (["{dir}", "--out-dir", "{dir}/a.su2"], ["a.su2", "not a folder"]),
        (["{dir}", "--out-dir", "{out}", "--in-place"], ["--in-place is for one file"]),
        (["{dir}", "--out-dir", "{out}", "--plot", "{out}.png"], ["--plot is for one file"]),
        (["{dir}", "--out-dir", "{out}", "--report", "{out}.html"], ["--report is for one file"]),
        (["{dir}", "-", "--out-dir", "{out}"], ["standard input has no name"]),
        (["{out}x*", "--out-dir", "{out}"], ["no file has such a name"]),
        (["{empty}/none/", "--out-dir", "{out}"], ["empty/none/: there is no such folder"]),
        (["{empty}", "--out-dir", "{out}"], ["no mesh files in this folder", ".su2"]),
        (["{dir}/a.su2", "{copy}/a.su2", "--out-dir", "{out}"], ["would both be written to"]),
        (["{dir}/a.su2", "{dir}/a.vtk", "--out-dir", "{out}", "--output-format", "vtu"], ["both be written to"]),
        (["{dir}", "--out-dir", "{out}", "--output-format", "xyz"], ["unknown format 'xyz'"]),
        (["{dir}", "--out-dir", "{out}", "--method", "zzz"], ["unknown method 'zzz'"]),
    ],
)
def test_bad_usage_is_told_before_anything_is_read(run, folder, tmp_path, arguments, words):
    for name in ("empty", "copy"):
        (tmp_path / name).mkdir()
    shutil.copy(folder / "a.su2", tmp_path / "copy")
    places = {"dir": folder, "out": tmp_path / "out", "empty": tmp_path / "empty", "copy": tmp_path / "copy"}
    done = run("smooth", *(argument.format(**places) for argument in arguments))
    assert (done.code, done.out) == (2, "")
    assert all(word in done.err for word in words)
    assert len(done.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_folder_written_onto_itself_is_refused_file_by_file(run, folder):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    done = run("smooth", folder, "--out-dir", folder)
    assert done.code == 2
    assert done.err.count("is the input") == 3
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_packed_files_of_a_folder_are_found(run, folder, tmp_path):
    (tmp_path / "packed").mkdir()
    (tmp_path / "packed" / "a.su2.gz").write_bytes(gzip.compress((folder / "a.su2").read_bytes()))
    done = run("smooth", tmp_path / "packed", "--out-dir", tmp_path / "out")
    assert done.code == 0, done.err
    assert gzip.decompress((tmp_path / "out" / "a.su2.gz").read_bytes()) != (folder / "a.su2").read_bytes()


def test_cases_of_openfoam_are_folders(run, tmp_path, monkeypatch):
    """Each goes into a folder of its name, where its mesh is whole; the case itself stays as it was."""
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "io")
    openfoam = importlib.import_module("test_openfoam")
    for name, way in (("one", openfoam.in_text), ("two", openfoam.FORMS["binary"])):
        folder = tmp_path / name / "constant" / "polyMesh"
        folder.mkdir(parents=True)
        for file, data in way(openfoam.layer(4, 4)).items():
            (folder / file).write_bytes(data)
    out = tmp_path / "fixed"
    assert run("smooth", tmp_path / "one", tmp_path / "two" / "constant" / "polyMesh", "--out-dir", out).code == 0
    for name in ("one", "two"):
        before, after = tmp_path / name / "constant" / "polyMesh", out / name / "constant" / "polyMesh"
        assert names(after) == names(before)
        for file in names(before):
            assert file == "points" or (after / file).read_bytes() == (before / file).read_bytes()
        old, new = gmsnet.read(tmp_path / name), gmsnet.read(out / name)
        assert [b.nodes.tolist() for b in old.cells] == [b.nodes.tolist() for b in new.cells]
    done = run("smooth", tmp_path / "one", tmp_path / "two", "--out-dir", out, "--output-format", "vtu")
    assert done.code == 0
    assert {"one.vtu", "two.vtu"} <= set(names(out))


def test_a_dry_run_makes_no_folder_of_a_case(run, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "io")
    openfoam = importlib.import_module("test_openfoam")
    folder = tmp_path / "one" / "constant" / "polyMesh"
    folder.mkdir(parents=True)
    for file, data in openfoam.in_text(openfoam.layer(2, 2)).items():
        (folder / file).write_bytes(data)
    assert run("smooth", tmp_path / "one", "--out-dir", tmp_path / "fixed", "--dry-run").code == 0
    assert not (tmp_path / "fixed").exists()


def test_a_case_without_a_place_to_go_is_told_where(run, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "io")
    openfoam = importlib.import_module("test_openfoam")
    openfoam.save(openfoam.in_text(openfoam.layer()), tmp_path / "cavity")
    monkeypatch.chdir(tmp_path)
    done = run("smooth", "cavity", "fixed")
    assert done.code == 2
    assert "fixed: an OpenFOAM mesh is written into a case: copy the case there first, or give --in-place" in done.err
