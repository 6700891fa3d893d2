"""The core needs packages of permissive licences alone, and docs/licences.md names them."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "docs" / "licences.py"


@pytest.fixture(scope="module")
def licences():
    spec = importlib.util.spec_from_file_location("licences", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_core_is_permissive(licences):
    found = {name: licences.licence(name) for name in licences.needed()}
    assert {"numpy", "scipy", "numba", "llvmlite", "safetensors", "typer", "rich"} <= found.keys()
    assert [(name, said) for name, said in found.items() if not licences.is_permissive(said)] == []


@pytest.mark.skipif(sys.version_info < (3, 11), reason="the pinned set is that of Python 3.11 and later")
def test_the_page_names_the_core(licences):
    core = licences.TARGET.read_text().partition("## Besides")[0]
    assert re.findall(r"^\| ([a-z][a-z0-9-]+) \|", core, re.MULTILINE) == ["package", *licences.needed()]


@pytest.mark.parametrize(
    ("expression", "permissive"),
    [
        ("MIT", True), ("BSD-3-Clause AND 0BSD AND MIT AND Zlib AND CC0-1.0", True), ("Apache Software", True),
        ("Apache-2.0 WITH LLVM-exception", True), ("GPL-3.0-only OR MIT", True), ("(MIT OR GPL-2.0) AND BSD", True),
        ("MIT AND GPL-3.0-only", False), ("MPL-2.0 AND MIT", False), ("LGPL-2.1", False), ("unknown", False),
        ("MITRE", False), ("Proprietary", False),
    ],
)  # fmt: skip
def test_what_is_permissive(licences, expression, permissive):
    assert licences.is_permissive(expression) is permissive
