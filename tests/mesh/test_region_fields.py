"""Which cell fields tell regions apart."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet.mesh.region_fields import NUMBERED, combined, regions_of


@pytest.mark.parametrize("count", [NUMBERED, 1000])
@pytest.mark.parametrize("kind", [np.int32, np.int64, np.float64])
def test_what_numbers_every_cell_tells_no_regions_apart(count, kind):
    counter = np.random.default_rng(0).permutation(count).astype(kind)
    halves = np.arange(count) % 2 + 3
    assert (regions_of([("label", counter)], count) == 0).all()
    assert (combined([counter, halves], count) == halves).all()
    counter[-1] = counter[0]
    assert (regions_of([("label", counter)], count) == counter).all()


@pytest.mark.parametrize("count", [0, 1, 2, NUMBERED - 1])
def test_few_cells_may_each_be_a_region(count):
    assert regions_of([("part", np.arange(count))], count).tolist() == list(range(count))


@pytest.mark.parametrize("suffix", [".vtk", ".vtu", ".ply"])
@pytest.mark.parametrize(("name", "held"), [("label", True), ("labels", True), ("pressure", False)])
def test_a_label_of_a_file_holds_the_interface(suffix, name, held, tmp_path):
    made = gmsnet.random_mesh(100, seed=1)
    triangles = made.cells[0].nodes
    label = (made.points[triangles].mean(axis=1)[:, 0] > 0.5).astype(np.int32)
    block = gmsnet.CellBlock("triangle", triangles, label)
    path = tmp_path / f"a{suffix}"
    gmsnet.write(gmsnet.Mesh(made.points, (block,)), path)
    data = path.read_bytes()
    assert data.count(b"region") == 1
    path.write_bytes(data.replace(b"region", name.encode()))
    mesh = gmsnet.read(path)
    assert ("interface between regions" in gmsnet.smooth(mesh, max_sweeps=1).held) == held
