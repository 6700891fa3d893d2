"""What the package never does: unpickle, evaluate text, start processes, open connections, load native code by name.

A look at the syntax of all sources, with the few exceptions by name; docs/security.md says why they are none.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import gmsnet

PACKAGE = Path(gmsnet.__file__).parent
SOURCES = sorted(PACKAGE.rglob("*.py"))
MODULES = {  # that nothing imports
    "pickle", "cPickle", "_pickle", "cloudpickle", "dill", "joblib", "marshal", "shelve", "subprocess", "pty", "socket",
    "socketserver", "ssl", "http", "ftplib", "smtplib", "telnetlib", "xmlrpc", "requests", "urllib3", "aiohttp",
    "httpx", "asyncio", "multiprocessing", "webbrowser", "ctypes", "cffi", "code", "codeop", "runpy", "pip",
    "ensurepip", "yaml",
}  # fmt: skip
EXCEPTIONS = {
    ("kernels/jit/cache.py", "pickle"),  # to know how an index of Numba's begins: it makes bytes, and reads none
    ("cuda/library.py", "import_module"),  # of numba.cuda alone
    ("io/formats.py", "import_module"),  # of the formats in its own table alone
    ("io/linked.py", "import_module"),  # the same
    ("paper/units.py", "multiprocessing"),  # ``gmsnet reproduce`` shares its work among processes of its own
    ("paper/units.py", "multiprocessing.synchronize"),
    ("paper/units.py", "multiprocessing.synchronize.Event"),
    ("gmsh/coordinates.py", "ctypes"),  # a function of the Gmsh that the user has loaded, called for each node
    *(("gmsh/coordinates.py", f"ctypes.{name}") for name in ("addressof", "c_int", "cast", "CFUNCTYPE")),
}
CALLS = {
    "eval", "exec", "compile", "__import__", "breakpoint", "input", "os.system", "os.popen", "os.fork", "os.startfile",
    "importlib.import_module", "import_module", "torch.load", "torch.hub.load", "np.load", "numpy.load", "np.fromfile",
    "pd.read_pickle", "urlopen", "urlretrieve", "CDLL",
}  # fmt: skip
BEGINNINGS = ("os.exec", "os.spawn", "os.posix_spawn", "ctypes.", "urllib.request.")


def imported(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def findings(name, text):
    tree = ast.parse(text)
    found = [module for module in imported(tree) if module.split(".")[0] in MODULES or module == "urllib.request"]
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            call = ast.unparse(node.func)
            options = {keyword.arg: ast.unparse(keyword.value) for keyword in node.keywords}
            unsafe = options.get("allow_pickle") == "True" or options.get("shell") == "True"
            if call in CALLS or call.startswith(BEGINNINGS) or unsafe:
                found.append(call)
    return {(name, each) for each in found}


def test_the_look_finds_what_it_is_for():
    """One line of each kind."""
    for text, what in [
        ("import pickle", "pickle"), ("from subprocess import run", "subprocess"), ("os.system('x')", "os.system"),
        ("eval('1')", "eval"), ("exec('1')", "exec"), ("import urllib.request", "urllib.request"),
        ("import numpy as np; np.load('x')", "np.load"), ("torch.load('x')", "torch.load"),
        ("f(x, allow_pickle=True)", "f"), ("import http.client", "http.client"), ("__import__('os')", "__import__"),
    ]:  # fmt: skip
        assert ("a.py", what) in findings("a.py", text)
    assert findings("a.py", "import numpy, os, json, re\nre.compile('x'); json.load(f); os.open('x', 0)") == set()


def test_nothing_of_the_package_does_it():
    assert len(SOURCES) > 150
    found = set()
    for path in SOURCES:
        found |= findings(path.relative_to(PACKAGE).as_posix(), path.read_text())
    assert found == EXCEPTIONS


def test_the_one_exception_only_makes_bytes():
    text = (PACKAGE / "kernels" / "jit" / "cache.py").read_text()
    assert set(re.findall(r"pickle\.(\w+)", text)) == {"dumps"}


OPENED = """
import socket, subprocess, sys, os
events = []
def watch(event, arguments):
    if event.split(".")[0] in ("socket", "subprocess", "urllib", "ftplib", "smtplib", "webbrowser") or event in (
        "os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.fork", "os.forkpty", "pty.spawn"
    ):
        events.append((event, str(arguments)[:200]))
import gmsnet, gmsnet.io, gmsnet.cli, gmsnet.methods
mesh = gmsnet.random_mesh(60, seed=1)
sys.addaudithook(watch)
folder = sys.argv[1]
for name in gmsnet.methods.METHODS:
    gmsnet.smooth(mesh, name, max_sweeps=2)
for entry in [entry for entry in gmsnet.io.FORMATS.values() if not entry.own]:
    path = folder + "/mesh" + entry.suffixes[0]
    gmsnet.write(mesh, path)
    gmsnet.write(gmsnet.smooth(gmsnet.read(path), max_sweeps=2).mesh, path)
assert gmsnet.cli.main(["smooth", folder + "/mesh.su2", folder + "/out.vtu", "--quiet"]) == 0
print(events)
"""


def test_python_sees_no_process_and_no_connection(tmp_path):
    """Python's own audit events while every method and every format runs: those of the libraries included."""
    done = subprocess.run([sys.executable, "-c", OPENED, tmp_path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "[]\n"


@pytest.mark.parametrize(
    "text", ["__import__('os').system('echo harm')", "$(touch harm)", "`touch harm`", "@/etc/passwd"]
)
def test_text_of_files_and_arguments_is_only_text(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mesh = gmsnet.random_mesh(20, seed=1)
    named = gmsnet.Mesh(mesh.points, mesh.cells, {(1, 1): text})
    gmsnet.write(named, tmp_path / "in.su2")
    back = gmsnet.read(tmp_path / "in.su2")
    gmsnet.smooth(back, fixed=list(back.region_names.values())[:1], max_sweeps=1)
    gmsnet.write(back, tmp_path / "out.vtu")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.su2", "out.vtu"]
