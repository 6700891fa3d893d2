"""What cannot be done with volumes of the second order is refused in a sentence."""

from __future__ import annotations

import pytest

import gmsnet
from gmsnet.generate import block_volume
from gmsnet.generate.curved_volumes import second_order_volume


@pytest.fixture(scope="module", params=["hexahedron", "wedge"])
def curved(request):
    return second_order_volume(block_volume(3, request.param), bend=0.02)


@pytest.mark.parametrize("method", ["angle", "cvt", "cpt", "nn", "gmsnet", "gmsnet2", "sized"])
def test_methods_for_other_cells(curved, method):
    with pytest.raises(gmsnet.InputError, match=r"choose .*laplacian"):
        gmsnet.smooth(curved, method)


def test_targets_of_other_cells_than_straight_tetrahedra(curved):
    with pytest.raises(gmsnet.InputError, match=r"first order|tetrahedra alone"):
        gmsnet.smooth(curved, target_dihedral=20)
