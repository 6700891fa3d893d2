"""Options that cannot be used are refused by name before anything starts."""

from __future__ import annotations

import inspect
import re
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import numpy as np
import pytest

import gmsnet
from gmsnet import random_mesh
from gmsnet.cli import smooth as command_line
from gmsnet.errors import InputError
from gmsnet.generate import lattice_volume, second_order
from gmsnet.run.options import SmoothOptions

NO_WHOLE_NUMBERS = [-1, 1.0, 2.5, "3", True, np.True_, np.array([1, 2]), np.array(3), 1j, float("nan")]


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"max_sweeps": 0},
        {"max_sweeps": np.uint8(3)},
        {"threads": 1},
        {"threads": np.int64(2)},
        {"target_quality": 1},
        {"target_quality": 1.0},
        {"target_quality": 5e-324},
        {"target_quality": np.float32(0.5)},
        {"seed": 2**70},
        {"callback": print},
        {"method": "gmsnet", "weights": "a.safetensors"},
        {"method": "gmsnet", "weights": Path("a.safetensors")},
        {"best_by": "aspect"},
        {"guard": "star"},
        {"target_angle": 60},
        {"target_dihedral": 70.5},
        {"preserve": "size"},
        {"preserve": "none", "fix_layers": True, "untangle": False},
    ],
)
def test_usable_options_pass(given):
    SmoothOptions(**given)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("max_sweeps", [*NO_WHOLE_NUMBERS, None]),
        ("threads", [*NO_WHOLE_NUMBERS, 0]),
        ("seed", [*NO_WHOLE_NUMBERS, None]),
        ("target_quality", [
            "0.5", b"1", True, np.True_, np.array([0.5, 0.6]), np.array(0.5), [0.5], 0, 0.0, -0.1, 1.0000000000000002,
            2, float("nan"), np.float64("nan"), float("inf"), 0.5j,
        ]),
        ("callback", ["x", 3, [print], np.array([0, 1])]),
        ("weights", [3, b"a.safetensors", ["a.safetensors"], {"linear.bias": np.zeros(3)}, True]),
        ("target_dihedral", ["20", True, 0, -1.0, 70.6, float("nan"), [20]]),
        ("target_angle", ["20", True, 0, -1.0, 89.5, float("nan"), [20]]),
        ("preserve", ["areas", "", None, True, ["size"]]),
        ("fix_layers", [None, 1, "yes"]),
        ("untangle", [None, 0, "no"]),
        ("guard", ["none", "", None, 1, ["worst"]]),
        ("best_by", ["qhat", "", None, 1, ["shape"]]),
    ],
)  # fmt: skip
def test_each_option_is_refused_by_its_name(name, values):
    for value in values:
        with pytest.raises(InputError, match=f"^{name} "):
            SmoothOptions(**{name: value})


def test_of_several_options_the_first_is_named():
    wrong = {"max_sweeps": -1, "threads": 0, "target_quality": 2, "seed": -1, "callback": 1, "preserve": "x"}
    for name in list(wrong):
        with pytest.raises(InputError, match=f"^{name} "):
            SmoothOptions(**wrong, method="none")
        del wrong[name]
    with pytest.raises(InputError, match=r"^unknown method 'none'"):
        SmoothOptions(method="none")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"method": "none"}, "unknown method 'none'"),
        ({"variant": "none"}, "auto has no variants"),
        ({"method": "laplacian", "variant": "none"}, "unknown variant of laplacian 'none'"),
        ({"method": "laplacian", "objective": "q"}, "laplacian has no objectives"),
        ({"method": "laplacian", "weights": "a.safetensors"}, "laplacian has no weights"),
        ({"method": "laplacian", "preserve": "size"}, "laplacian does not keep the sizes of cells"),
        ({"preserve": "size", "target_quality": 0.3}, "contradict each other"),
    ],
)
def test_what_a_method_does_not_have_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        SmoothOptions(**given)


def test_options_cannot_be_changed():
    with pytest.raises(FrozenInstanceError):
        SmoothOptions().max_sweeps = -1


def test_the_options_are_those_of_smooth_and_of_the_command_line():
    """With the same defaults, in the same order, and each with a word on what it does."""
    options = {each.name: each.default for each in fields(SmoothOptions)}
    public = dict(inspect.signature(gmsnet.smooth).parameters)
    del public["mesh"], public["fixed"]
    assert {name: each.default for name, each in public.items()} == options
    assert list(public) == list(options)
    told = set(re.findall(r"(\w+)(?=[^.]*?:\s)", gmsnet.smooth.__doc__))
    assert {"mesh", "fixed", *options} <= told
    command = inspect.signature(command_line.smooth).parameters
    for name in set(options) - {"callback", "geometry"}:  # those two are objects of Python
        assert command[name].default == options[name]


@pytest.mark.parametrize("mesh", [lambda: random_mesh(60, seed=1), lambda: lattice_volume(3)])
def test_a_feature_angle_without_sliding_is_told_to_have_no_effect(mesh):
    told = [note for note in gmsnet.smooth(mesh(), feature_angle=20.0).notes if note.startswith("feature angle")]
    assert told == ["feature angle: it has no effect, as no node is to slide: ask for that by slide"]
    for asked in ({}, {"feature_angle": 20.0, "slide": True}):
        assert not any(note.startswith("feature angle") for note in gmsnet.smooth(mesh(), **asked).notes)


def test_why_nodes_of_second_order_cells_do_not_slide():
    mesh = second_order(random_mesh(60, seed=1))
    assert "slide: boundary nodes of second-order cells stay where they are" in gmsnet.smooth(mesh, slide=True).notes
    assert not any(note.startswith("slide") for note in gmsnet.smooth(mesh).notes)


def test_a_target_of_angles_that_is_met_says_that_a_quad_has_a_large_one():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.51, 0.5], [0.0, 1.0]])
    for moved, told in ((points, True), (points + 0.4 * (np.arange(4) == 2)[:, None], False)):
        result = gmsnet.smooth((moved, {"quad": [[0, 1, 2, 3]]}), target_angle=40.0)
        said = [note for note in result.notes if note.startswith("target")]
        assert bool(said) == told
        assert not told or said == [
            "target: it is of small angles alone, and the greatest one is 178.85°: a target of 1/q is of both"
        ]


def test_a_surface_tolerance_without_effect_is_told():
    plane, volume = random_mesh(30, seed=1), lattice_volume(3)
    told = [gmsnet.smooth(mesh, surface_tolerance=0.1, max_sweeps=1).notes for mesh in (plane, volume)]
    assert "surface tolerance: it has no effect, as this mesh is planar: leave it out" in told[0]
    assert "surface tolerance: it has no effect, as no node is to slide: ask for that by slide" in told[1]
    assert not any("surface tolerance" in note for note in gmsnet.smooth(plane, max_sweeps=1).notes)
