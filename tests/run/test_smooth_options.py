"""Options that cannot be used are refused by name before anything starts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gmsnet.errors import InputError
from gmsnet.run.options import check_arguments

USABLE = {
    "max_sweeps": 100, "threads": None, "target_quality": None, "seed": 0, "callback": None, "weights": None,
    "best_by": "shape", "guard": "worst",
    "target_angle": None, "preserve": "shape", "fix_layers": False, "untangle": True,
}  # fmt: skip
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
        {"weights": "a.safetensors"},
        {"weights": Path("a.safetensors")},
        {"best_by": "aspect"},
        {"guard": "star"},
        {"target_angle": 60},
        {"preserve": "size"},
        {"preserve": "none", "fix_layers": True, "untangle": False},
    ],
)
def test_usable_options_pass(given):
    check_arguments(**{**USABLE, **given})


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
        ("target_angle", ["20", True, 0, -1.0, 60.5, float("nan"), [20]]),
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
            check_arguments(**{**USABLE, name: value})
