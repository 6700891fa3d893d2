"""The command line as a process of its own: streams, pipes, terminals, exit codes, and what it loads."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

HEAVY = ("numpy", "scipy", "numba", "meshlane", "torch", "matplotlib", "pyvista", "safetensors")
GMSNET = [sys.executable, "-m", "gmsnet"]
PLAIN = {k: v for k, v in os.environ.items() if k not in ("FORCE_COLOR", "NO_COLOR", "GMSNET_DEBUG", "TTY_COMPATIBLE")}


def gmsnet(*arguments, **options):
    return subprocess.run(
        [*GMSNET, *map(str, arguments)], capture_output=True, env=PLAIN, timeout=300, check=False, **options
    )


@pytest.mark.parametrize(
    "arguments",
    [["--help"], ["--version"], *([name, "-h"] for name in ("smooth", "quality", "methods", "generate", "train"))],
)
def test_help_loads_nothing_heavy(arguments):
    code = (
        f"import sys; from gmsnet.cli import main; code = main({arguments!r});"
        f"print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr); sys.exit(code)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=PLAIN, check=True)
    assert done.stderr.strip() == "[]"
    assert done.stdout.startswith("Usage: gmsnet" if arguments != ["--version"] else "gmsnet 0.")


def test_no_arguments_shows_help_and_fails():
    done = gmsnet()
    assert done.returncode == 2
    assert done.stdout.startswith(b"Usage: gmsnet")


def test_json_is_alone_on_standard_output(square, tmp_path):
    done = gmsnet("smooth", square, tmp_path / "out.su2", "--json", "--plot", tmp_path / "p.png")
    assert (done.returncode, done.stderr) == (0, b"")
    assert json.loads(done.stdout)["input"] == str(square)


def test_pipes(square, tmp_path):
    file = tmp_path / "out.su2"
    assert gmsnet("smooth", square, file, "--quiet").returncode == 0
    done = gmsnet("smooth", "-", "-", input=square.read_bytes())
    assert done.returncode == 0
    assert done.stdout == file.read_bytes()
    assert b"q-hat" in done.stderr
    assert b"\x1b" not in done.stderr
    quality = gmsnet("quality", "-", "--json", input=done.stdout)
    assert json.loads(quality.stdout)["inverted"] == 0


def test_errors_have_no_traceback(tmp_path):
    done = gmsnet("smooth", tmp_path / "missing.su2", tmp_path / "out.su2")
    assert (done.returncode, done.stdout) == (2, b"")
    assert done.stderr.startswith(b"gmsnet: error: ")
    assert done.stderr.count(b"\n") == 1


@pytest.mark.parametrize("arguments", [["quality", "{in}"], ["smooth", "{in}", "-"], ["--help"]])
def test_a_reader_that_went_away_is_no_error(square, arguments):
    read, write = os.pipe()
    os.close(read)
    command = [*GMSNET, *(each.replace("{in}", str(square)) for each in arguments)]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, env=PLAIN, check=False)
    os.close(write)
    assert done.returncode == 141
    assert b"rror" not in done.stderr


def test_a_plain_encoding_is_enough(square, tmp_path):
    out = tmp_path / "größer [2].su2"
    env = {**PLAIN, "PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    done = subprocess.run([*GMSNET, "smooth", square, out], capture_output=True, env=env, check=False)
    assert done.returncode == 0
    assert out.exists()
    assert rb"gr\xf6\xdfer [2].su2" in done.stdout


@pytest.mark.parametrize("no_color", [False, True])
def test_a_terminal_gets_a_progress_bar_and_no_color_is_respected(square, tmp_path, no_color):
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    env = {**PLAIN, "TERM": "xterm-256color", **({"NO_COLOR": "1"} if no_color else {})}
    command = [*GMSNET, "smooth", square, tmp_path / "out.su2"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=theirs, env=env)
    os.close(theirs)
    seen = b""
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:  # Linux says so when the other end is closed
            break
        if not piece:
            break
        seen += piece
    out = process.stdout.read()
    assert process.wait() == 0
    assert b"reading" in seen
    assert b"\x1b" not in out
    colours = [b"\x1b[%dm" % code for code in (*range(30, 38), *range(90, 98))]
    assert any(colour in seen for colour in colours) is not no_color
    process.stdout.close()
    os.close(ours)


def test_shell_completion():
    env = {**PLAIN, "_GMSNET_COMPLETE": "complete_bash", "COMP_WORDS": "gmsnet sm", "COMP_CWORD": "1"}
    done = subprocess.run([*GMSNET, "sm"], capture_output=True, env=env, check=False)
    assert done.stdout.split() == [b"smooth"]
