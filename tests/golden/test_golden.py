"""Results of planar triangle meshes, held against the bits that were recorded."""

from __future__ import annotations

import pytest

from golden import FILES, digest, generated, of_files, recorded, results


def check(name, mesh, *, every):
    rows = dict(recorded()[name])
    if rows.pop("input") != digest(mesh.points):
        pytest.skip(f"the generated mesh {name!r} is another one here: recorded with the versions of constraints.txt")
    now = results(mesh, every=every)
    assert {row: now[row] for row in rows if now[row] != rows[row]} == {}


@pytest.mark.parametrize("name", ["small", "large", "regions", "tangled", "layers"])
def test_generated_meshes_come_out_as_recorded(name):
    check(name, generated()[name], every=name != "large")


@pytest.mark.parametrize("name", FILES)
def test_real_meshes_come_out_as_recorded(name, real_meshes):
    check(name, of_files(str(real_meshes))[name], every=False)
