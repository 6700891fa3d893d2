"""The table of methods: every row goes by its name, and nothing else is taken for one."""

from __future__ import annotations

import numpy as np
import pytest

import gmsnet
from gmsnet import CellBlock, Mesh
from gmsnet.errors import InputError
from gmsnet.methods import METHODS, method_named, smoother


def test_every_method_goes_by_its_name():
    assert METHODS
    for name, method in METHODS.items():
        assert method.name == name
        assert method_named(name) is method
        assert method.summary
        assert method.source
        assert len(set(method.variants)) == len(method.variants)


@pytest.mark.parametrize("name", [None, ["gmsnet"], {"gmsnet"}, 3, b"gmsnet", METHODS["gmsnet"]])
def test_what_is_no_name_is_refused(name):
    with pytest.raises(InputError, match="method must be the name of one: "):
        method_named(name)


def test_unknown_names_are_answered_with_the_nearest_ones():
    with pytest.raises(InputError, match=r"unknown method 'gmsnett'; did you mean .*gmsnet"):
        gmsnet.smooth(gmsnet.random_mesh(10), "gmsnett")
    for method in METHODS.values():
        for kind, names in (("variant", method.variants), ("objective", method.objectives)):
            if names:
                with pytest.raises(InputError, match=f"unknown {kind} of {method.name} '{names[-1]}x'.*{names[-1]}"):
                    smoother(method.name, **{kind: names[-1] + "x"})
                with pytest.raises(InputError, match=f"{kind} of {method.name} must be the name of one: {names[0]}"):
                    smoother(method.name, **{kind: 3})
            else:
                with pytest.raises(InputError, match=f"{method.name} has no {kind}s"):
                    smoother(method.name, **{kind: "plain"})


def test_weights_for_a_method_without_any_are_refused():
    for method in METHODS.values():
        if not method.weighted:
            with pytest.raises(InputError, match=f"{method.name} has no weights.*gmsnet"):
                smoother(method.name, weights="some.safetensors")


def test_weights_and_a_variant_exclude_each_other():
    for method in METHODS.values():
        if method.weighted:
            with pytest.raises(InputError, match="either a variant or weights"):
                smoother(method.name, variant=method.variants[-1], weights="some.safetensors")


def test_names_in_other_letters_are_known():
    for name in METHODS:
        with pytest.raises(InputError, match=f"did you mean .*{name}"):
            method_named(name.upper())


QUADS = Mesh(
    np.array([[x, y] for x in range(3) for y in range(3)], dtype=float),
    (CellBlock("quad", np.array([[k, k + 3, k + 4, k + 1] for k in (0, 1, 3, 4)]), np.zeros(4, dtype=int)),),
)
TRIANGLES_ONLY = {"angle", "cvt", "cpt", "nn", "gmsnet", "gmsnet2"}


@pytest.mark.parametrize("name", METHODS)
def test_methods_for_triangles_refuse_quads_and_name_those_that_move_them(name):
    assert METHODS[name].moves("triangle")
    assert METHODS[name].moves("quad") == (name not in TRIANGLES_ONLY)
    if name in TRIANGLES_ONLY:
        with pytest.raises(
            InputError, match=f"^{name} moves triangles alone, and this mesh has 4 quads: choose auto, "
        ):
            gmsnet.smooth(QUADS, name)


@pytest.mark.parametrize("objective", ["cosine", "min-max-angle"])
def test_objectives_of_angles_refuse_quads(objective):
    method = METHODS["optimize"]
    assert [each for each in method.objectives if not method.moves("quad", each)] == ["cosine", "min-max-angle"]
    with pytest.raises(InputError, match=rf"^the objective {objective} of optimize .* 4 quads: .* metric, q, q2, or"):
        gmsnet.smooth(QUADS, "optimize", objective=objective)


def test_a_single_quad_is_named_as_one():
    one = Mesh(QUADS.points[[0, 3, 4, 1]], (CellBlock("quad", np.array([[0, 1, 2, 3]]), np.zeros(1, dtype=int)),))
    with pytest.raises(InputError, match="this mesh has 1 quad: "):
        gmsnet.smooth(one, "cvt")
