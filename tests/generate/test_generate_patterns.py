"""`gmsnet generate` with patterns: the same meshes as the functions make, contradictions refused."""

from __future__ import annotations

import numpy as np
import pytest
import typer
from support import quads as twin
from typer.testing import CliRunner

import gmsnet
from gmsnet.cli import main
from gmsnet.cli.generate import generate
from gmsnet.errors import InputError
from gmsnet.generate import (
    adapted_mesh,
    block_volume,
    c_grid_mesh,
    disturb,
    hybrid_mesh,
    kershaw_mesh,
    lattice_volume,
    layered_mesh,
    layered_volume,
    o_grid_section,
    part_volume,
    random_mesh,
    random_quad_mesh,
    random_volume,
    settle,
    swept_volume,
)
from gmsnet.generate import structured_mesh as grid

app = typer.Typer()
app.command()(generate)


def inner_nodes(mesh):
    return np.setdiff1d(np.arange(len(mesh.points)), mesh.cells[-1].nodes)


def cells_of(mesh):
    return sorted(nodes for block in mesh.cells if block.dimension >= 2 for nodes in np.sort(block.nodes).tolist())


def run(*arguments):
    return CliRunner().invoke(app, list(map(str, arguments)))


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ("--nodes 50 --settle 2", lambda: settle(random_mesh(50), 2)),
        ("--cells triangle --nodes 50 --seed 3", lambda: random_mesh(50, seed=3)),
        ("--cells quad --nodes 90 --seed 3 --shape plate", lambda: random_quad_mesh(90, "plate", seed=3)),
        ("--cells mixed --nodes 90 --settle 2 --boundary random --size 3",
         lambda: random_quad_mesh(90, cells="mixed", settled=2, boundary="random", size=3.0)),
        ("--pattern structured --nodes 82", lambda: grid(10)),
        ("--cells tetra --nodes 30 --seed 2 --size 3", lambda: random_volume(30, size=3.0, seed=2)),
        ("--pattern structured --cells tetra --nodes 35", lambda: lattice_volume(3)),
        ("--pattern structured --cells tetra --columns 2", lambda: lattice_volume(2)),
        ("--pattern part --columns 9", lambda: part_volume(9)),
        ("--pattern part", lambda: part_volume(9)),
        ("--pattern layered --columns 4 --layers 3 --aspect 10", lambda: layered_volume(4, 3, first=0.1)),
        ("--pattern structured --cells tetra --columns 3 --jitter 2 --tangled",
         lambda: disturb(m := lattice_volume(3), inner_nodes(m), 2.0, keep_valid=False)),
        ("--pattern structured --cells hexahedron --columns 3", lambda: block_volume(3)),
        ("--pattern structured --cells mixed-volume --nodes 30 --size 2", lambda: block_volume(4, "mixed", size=2.0)),
        ("--pattern swept --columns 4 --layers 3 --bend 45 --twist 10",
         lambda: swept_volume(o_grid_section(4, 2, radius=0.5), 3, 2.0, bend=45.0, twist=10.0)),
        ("--pattern layered --cells wedge --columns 4 --layers 3 --aspect 10",
         lambda: layered_volume(4, 3, kind="wedge", first=0.1)),
        ("--pattern structured --columns 3 --rows 5 --size 2", lambda: grid(3, 5, size=2.0)),
        ("--pattern structured --rows 4", lambda: grid(4)),
        ("--pattern structured --cells quad --columns 9 --jitter 0.4 --jitter-edge shortest --seed 4",
         lambda: disturb(m := grid(9), sorted(twin.free(m)), 0.4, seed=4, edge="shortest")),
        ("--pattern structured --columns 9 --jitter 3 --tangled",
         lambda: disturb(m := grid(9), sorted(twin.free(m)), 3.0, keep_valid=False)),
        ("--pattern structured --cells mixed --nodes 200 --share 0.3 --seed 2",
         lambda: hybrid_mesh(200, share=0.3, seed=2)),
        ("--pattern structured --cells mixed --nodes 200 --interface", lambda: hybrid_mesh(200, interface=True)),
        ("--pattern kershaw --columns 6 --rows 4 --flatness 0.1", lambda: kershaw_mesh(6, 4, flatness=0.1)),
        ("--pattern kershaw", lambda: kershaw_mesh(33)),
        ("--pattern adapted --nodes 200 --aspect 3", lambda: adapted_mesh(200, 3.0)),
        ("--pattern c-grid --layers 4 --aspect 50 --around 40", lambda: c_grid_mesh(4, 50.0, 40)),
        ("--pattern c-grid --layers 4 --around 40 --cells triangle --aspect 9",
         lambda: c_grid_mesh(4, 9.0, 40, cells="triangle")),
        ("--pattern o-grid --layers 4 --aspect 50 --around 40", lambda: layered_mesh(4, 50.0, 40, cells="mixed")),
        ("--pattern o-grid --layers 2 --around 30 --cells quad --body circle --aspect 9",
         lambda: layered_mesh(2, 9.0, 30, cells="quad", body="circle")),
        ("--pattern o-grid --layers 2 --around 30 --cells triangle --aspect 9", lambda: layered_mesh(2, 9.0, 30)),
    ],
)  # fmt: skip
def test_command_makes_what_the_functions_make(tmp_path, options, expected):
    path, wanted = tmp_path / "mesh.msh", expected()
    result = run(path, *options.split())
    assert result.exit_code == 0, result.output
    mesh = gmsnet.read(path)
    assert np.array_equal(mesh.points[:, : wanted.points.shape[1]], wanted.points)
    assert cells_of(mesh) == cells_of(wanted)
    assert set(mesh.markers) == set(wanted.markers)
    inside = max(block.dimension for block in wanted.cells)
    for block in [block for block in wanted.cells if block.dimension == inside]:
        assert f"{len(block.nodes):,} {block.kind}s" in result.stdout


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            "--pattern zigzag",
            "unknown pattern 'zigzag'; there are random, structured, o-grid, c-grid, adapted, kershaw, layered, part, "
            "swept, sphere, torus, cylinder, cone, organic, bracket",
        ),
        ("--cells hex", "--pattern random makes --cells triangle or quad or mixed or tetra, not 'hex'"),
        ("--pattern kershaw --cells mixed", "--pattern kershaw makes --cells quad, not 'mixed'"),
        (
            "--pattern structured --cells triangle",
            "--pattern structured makes --cells quad or mixed or tetra",
        ),
        (
            "--columns 3",
            "--columns is an option for structured quad, structured tetra, structured hexahedron, structured wedge,",
        ),
        ("--pattern kershaw --share 0.5", "--share is an option for structured mixed, not for kershaw quad"),
        ("--pattern structured --interface", "--interface is an option for structured mixed"),
        ("--pattern structured --cells mixed --rows 3", "--rows is an option for structured quad, kershaw quad"),
        ("--pattern o-grid --nodes 50", "--nodes is an option for random triangle, random quad"),
        ("--pattern structured --shape square", "--shape is an option for random triangle"),
        ("--pattern structured --rings x.json", "--rings is an option for random triangle"),
        ("--layers 3", "--layers is an option for o-grid mixed, o-grid quad, o-grid triangle"),
        ("--shape square --rings x.json", "--rings stands instead of --shape"),
        ("--pattern structured --nodes 5 --columns 3", "--columns and --rows stand instead of --nodes"),
        ("--pattern structured --nodes 0", "a mesh needs at least 1 node inside, got --nodes 0"),
        ("--pattern structured --columns 0", "number of columns must be a whole number of at least 1"),
        ("--pattern o-grid --aspect 0.5", "the aspect must be a number of at least 1"),
        ("--pattern o-grid --size 0", "the size must be a positive number"),
        ("--jitter-edge shortest", "--jitter-edge needs --jitter"),
        ("--jitter 1 --jitter-edge longest", "edge must be 'mean' or 'shortest', got 'longest'"),
        ("--settle -1", "the number of sweeps must be a whole number of at least 0"),
    ],
)
def test_command_refuses_contradictions_and_writes_nothing(tmp_path, options, message):
    result = run(tmp_path / "out.msh", *options.split())
    assert isinstance(result.exception, InputError)
    assert message in str(result.exception)
    assert list(tmp_path.iterdir()) == []


def test_refusals_end_with_exit_code_2(tmp_path, capsys):
    assert main(["generate", str(tmp_path / "o.su2"), "--pattern", "kershaw", "--cells", "mixed"]) == 2
    assert capsys.readouterr().err == "gmsnet: error: --pattern kershaw makes --cells quad, not 'mixed'\n"
