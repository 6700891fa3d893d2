"""Results of planar triangle meshes and of volumes, held against the bits that were recorded."""

from __future__ import annotations

import pytest

from golden import FILES, digest, generated, of_files, recorded, results, results_of_solid, solid


def recorded_rows(name, mesh):
    rows = dict(recorded()[name])
    if rows.pop("input") != digest(mesh.points):
        pytest.skip(f"the generated mesh {name!r} is another one here: recorded with the versions of constraints.txt")
    return rows


def check(name, mesh, *, every):
    rows = recorded_rows(name, mesh)
    now = results(mesh, every=every)
    assert {row: now[row] for row in rows if now[row] != rows[row]} == {}


@pytest.mark.parametrize("name", ["small", "large", "regions", "tangled", "layers"])
def test_generated_meshes_come_out_as_recorded(name):
    check(name, generated()[name], every=name != "large")


def test_volumes_come_out_as_recorded():
    mesh = solid()
    assert results_of_solid(mesh) == recorded_rows("solid", mesh)


@pytest.mark.parametrize("name", FILES)
def test_real_meshes_come_out_as_recorded(name, real_meshes):
    check(name, of_files(str(real_meshes))[name], every=False)
