from __future__ import annotations

import subprocess
import sys

import pytest

BLOCK = """
import sys
from importlib.abc import MetaPathFinder

class Missing(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Missing())
from gmsnet.errors import MissingExtraError
try:
    import gmsnet.learn.train
except MissingExtraError as error:
    print("missing:", error)
except ImportError as error:
    print("other:", error)
"""


def run(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


@pytest.mark.parametrize("name", ["torch", "torch_geometric"])
def test_a_missing_package_names_the_command_that_installs_it(name):
    expected = (
        f'missing: training needs {name}, which is not installed: install the extra "train", '
        'in the folder of the sources by pip install ".[train]"'
    )
    assert run(BLOCK.format(name=name)) == expected


def test_a_package_that_misses_something_itself_says_so():
    assert run(BLOCK.format(name="torch.nn")) == "other: No module named 'torch.nn'"


def test_weights_are_loaded_without_torch():
    code = "import sys, gmsnet.weights as w; w.load(); print('torch' in sys.modules, 'torch_geometric' in sys.modules)"
    assert run(code) == "False False"
