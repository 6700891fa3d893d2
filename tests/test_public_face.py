"""What the world relies on: public names, JSON, types, and the files around the project."""

from __future__ import annotations

import importlib
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support.optional import library

import gmsnet
from gmsnet.cli import main
from gmsnet.generate import lattice_volume, random_mesh, random_volume, second_order_volume

if sys.version_info >= (3, 11):
    import tomllib
else:
    tomllib = None

ROOT = Path(__file__).parents[1]
SCHEMA = ROOT / "docs" / "json-output.schema.json"


def test_the_public_names_are_those_of_the_page(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    api = importlib.import_module("api")
    assert api.TARGET.read_text(encoding="utf-8") == api.page(), "run python docs/api.py: is the change meant?"


@pytest.fixture
def files(tmp_path):
    for name, mesh in {"a.su2": random_mesh(60, seed=1), "b.vtk": random_volume(40, seed=3),
                       "c.vtk": second_order_volume(lattice_volume(2), bend=0.05)}.items():  # fmt: skip
        gmsnet.write(mesh, tmp_path / name)
    (tmp_path / "broken.su2").write_text("NDIME= 2\nNPOIN= 1\n0 x\n")
    return tmp_path


@pytest.mark.parametrize(
    ("call", "shape"),
    [
        ("smooth {dir}/a.su2 {dir}/o.su2 --json", "run"),
        ("smooth {dir}/a.su2 {dir}/o.vtu --json --target-quality 0.9 --preserve none", "run"),
        ("smooth {dir}/b.vtk {dir}/o.vtk --json --max-sweeps 3", "run"),
        ("smooth {dir}/c.vtk {dir}/o.vtk --json --max-sweeps 3", "run"),
        ("smooth {dir}/a.su2 --dry-run --json --method laplacian", "run"),
        ("smooth {dir}/a.su2 {dir}/broken.su2 --out-dir {dir}/out --json", "run failed"),
        ("deform {dir}/a.su2 {dir}/o.su2 --json --move top 0.1 0.1", "run"),
        ("quality {dir}/a.su2 --json", "measured"),
        ("quality {dir}/b.vtk --json --threshold 0.3", "measured"),
        ("quality {dir}/a.su2 {dir}/a.su2 --json", "comparison"),
    ],
)
def test_what_is_printed_obeys_the_schema(call, shape, files, capsys):
    jsonschema = library("jsonschema")
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    main(call.format(dir=files).split())
    out = capsys.readouterr().out
    documents = [json.loads(line) for line in out.splitlines()] if "--out-dir" in call else [json.loads(out)]
    assert len(documents) == len(shape.split())
    for document, kind in zip(documents, shape.split(), strict=True):
        one = {**schema["$defs"][kind], "$defs": schema["$defs"]}
        jsonschema.Draft202012Validator(one).validate(document)
        jsonschema.Draft202012Validator(schema).validate(document)
        if kind == "run":
            with pytest.raises(jsonschema.ValidationError):
                jsonschema.Draft202012Validator(one).validate({**document, "surprise": 1})
            with pytest.raises(jsonschema.ValidationError):
                jsonschema.Draft202012Validator(one).validate({k: v for k, v in document.items() if k != "moved"})


def test_types_are_shipped_and_seen(tmp_path):
    """A checker that sees the package's types, as ``py.typed`` says, finds a wrong call."""
    library("mypy")
    assert (Path(gmsnet.__file__).parent / "py.typed").exists()
    user = tmp_path / "user.py"
    lines = ["import gmsnet", 'mesh = gmsnet.read("a.su2")', "reveal_type(mesh)", 'gmsnet.smooth(mesh, max_sweeps="x")']
    user.write_text("\n".join(lines))
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--follow-imports=silent", "--no-incremental", "--config-file=", str(user)],
        capture_output=True, text=True, check=False, cwd=tmp_path, env={**os.environ, "MYPYPATH": str(ROOT / "src")},
    )  # fmt: skip
    assert 'Revealed type is "gmsnet.mesh.mesh.Mesh"' in done.stdout
    assert "user.py:4: error" in done.stdout


def test_the_front_page_is_short_and_leads_somewhere():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 120
    for page in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]:
        for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


@pytest.mark.skipif(tomllib is None, reason="needs Python 3.11")
def test_what_is_packaged_elsewhere_is_what_is_packaged_here():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    recipe = (ROOT / "packaging" / "recipe.yaml").read_text(encoding="utf-8")
    run = recipe.partition("  run:\n")[2].partition("tests:")[0]
    listed = {line.strip("- ").replace(" ", "") for line in run.splitlines() if line.strip()}
    assert listed == {f"python{project['requires-python']}", *project["dependencies"]}
    assert f'version: "{project["version"]}"' in recipe
    assert f"version: {project['version']}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    extras = re.findall(r"/src\[(\w+)\]", (ROOT / "packaging" / "Dockerfile").read_text(encoding="utf-8"))
    assert extras
    assert set(extras) <= set(project["optional-dependencies"])
    assert ".ci/run" in (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")


@pytest.mark.parametrize("path", sorted((ROOT / ".github" / "workflows").glob("*.yml")), ids=lambda path: path.stem)
def test_workflows_have_few_rights_and_steps_that_parse(path):
    """They cannot run here: their form alone is looked at."""
    workflow = library("yaml").safe_load(path.read_text(encoding="utf-8"))
    assert set(workflow["permissions"]) <= {"contents"}
    for job in workflow["jobs"].values():
        for step in job["steps"]:
            assert ("run" in step) != ("uses" in step)
            if "run" in step and shutil.which("bash"):
                subprocess.run(["bash", "-n"], input=re.sub(r"\$\{\{.*?\}\}", "x", step["run"]), text=True, check=True)
