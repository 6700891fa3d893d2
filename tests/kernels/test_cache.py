"""The cache of compiled functions after an upgrade that moved the class of an argument to another module."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import gmsnet

CALL = "import user, {module}; print(user.double({module}.Pair(3, 4)))"


def test_a_cache_that_names_what_is_gone_is_made_anew(tmp_path):
    (tmp_path / "before.py").write_text(
        "from typing import NamedTuple\nclass Pair(NamedTuple):\n    one: int\n    two: int\n"
    )
    (tmp_path / "user.py").write_text(
        "from gmsnet.kernels.compile import kernel\n@kernel\ndef double(pair):\n    return 2 * (pair.one + pair.two)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "GMSNET_CACHE": "", "NUMBA_CACHE_DIR": ""}

    def call(module):
        code = CALL.format(module=module)
        return subprocess.run(
            [sys.executable, "-B", "-c", code], env=environment, text=True, capture_output=True, check=False
        )

    assert call("before").stdout == "14\n"
    assert list(Path(tmp_path / "__pycache__").glob("user.double*.nbi"))
    (tmp_path / "before.py").rename(tmp_path / "after.py")
    done = call("after")
    assert done.stdout == "14\n", done.stderr


def test_a_cache_is_stale_once_what_a_function_calls_has_changed(tmp_path):
    """guard.permitted calls a function of predicates.py; its own file stays as it is."""
    package = Path(gmsnet.__file__).parent
    shutil.copytree(package, tmp_path / "gmsnet", ignore=shutil.ignore_patterns("__pycache__"))
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "GMSNET_CACHE": "", "NUMBA_CACHE_DIR": ""}
    code = (
        "import numpy as np; from gmsnet.kernels.guard import permitted;"
        "triangle = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 1.0]); print(permitted(triangle, triangle, 0.0, -np.inf))"
    )

    def call():
        done = subprocess.run(
            [sys.executable, "-c", code], env=environment, text=True, capture_output=True, check=False
        )
        return done.stdout, done.stderr

    assert call() == ("True\n", "")
    predicates = tmp_path / "gmsnet" / "kernels" / "predicates.py"
    turned = predicates.read_text().replace("return left - right, bound", "return right - left, bound")
    assert turned != predicates.read_text()
    predicates.write_text(turned)
    assert call() == ("False\n", "")
