"""The table of methods: every row goes by its name, and nothing else is taken for one."""

from __future__ import annotations

import pytest

from gmsnet.errors import InputError
from gmsnet.methods import METHODS, method_named


def test_every_method_goes_by_its_name():
    assert METHODS
    for name, method in METHODS.items():
        assert method.name == name
        assert method_named(name) is method


@pytest.mark.parametrize("name", [None, ["gmsnet"], {"gmsnet"}, 3, b"gmsnet", METHODS["gmsnet"]])
def test_what_is_no_name_is_refused(name):
    with pytest.raises(InputError, match="method must be the name of one: gmsnet"):
        method_named(name)
