"""The command line as a process of its own: streams, pipes, terminals, exit codes, and what it loads."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys

import pytest

from gmsnet.io import read
from gmsnet.run.progress import COMPILING

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


@pytest.mark.parametrize("command", ["smooth", "quality"])
@pytest.mark.parametrize(
    ("setting", "value", "told"),
    [("NUMBA_DISABLE_JIT", "1", b"unset NUMBA_DISABLE_JIT"), ("NUMBA_NUM_THREADS", "0", b"begin with NUMBA_")],
)
def test_a_numba_that_cannot_compile_is_told_in_one_line(square, tmp_path, command, setting, value, told):
    arguments = [command, square, *([tmp_path / "out.su2"] if command == "smooth" else [])]
    done = subprocess.run(
        [*GMSNET, *map(str, arguments)], capture_output=True, env={**PLAIN, setting: value}, timeout=300, check=False
    )
    assert (done.returncode, done.stdout) == (2, b"")
    assert done.stderr.startswith(b"gmsnet: error: Numba ")
    assert told in done.stderr
    assert done.stderr.count(b"\n") == 1
    assert not (tmp_path / "out.su2").exists()


def test_no_arguments_shows_help_and_fails():
    done = gmsnet()
    assert done.returncode == 2
    assert done.stdout.startswith(b"Usage: gmsnet")


def test_json_is_alone_on_standard_output(square, tmp_path):
    done = gmsnet("smooth", square, tmp_path / "out.su2", "--json", "--plot", tmp_path / "p.png")
    assert (done.returncode, done.stderr.replace(f"gmsnet: {COMPILING}\n".encode(), b"")) == (0, b"")
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


@pytest.mark.skipif(not os.path.exists("/dev/fd/1"), reason="this system does not name its streams")
@pytest.mark.parametrize("name", ["/dev/stdout", "/dev/fd/1", "{file}"])
def test_what_is_said_does_not_mix_with_a_mesh_on_standard_output(run, square, tmp_path, name):
    assert run("smooth", square, tmp_path / "out.su2", "--quiet").code == 0
    mixed = tmp_path / "mixed.su2"
    with mixed.open("wb") as stdout:
        command = [*GMSNET, "smooth", square, name.replace("{file}", str(mixed))]
        done = subprocess.run(command, stdout=stdout, stderr=subprocess.PIPE, env=PLAIN, check=False)
    assert done.returncode == 0
    assert b"q-hat" in done.stderr
    assert mixed.read_bytes() == (tmp_path / "out.su2").read_bytes()
    assert {path.name for path in tmp_path.iterdir()} == {"square.su2", "out.su2", "mixed.su2"}


@pytest.mark.skipif(not os.path.exists("/dev/fd/1"), reason="this system does not name its streams")
def test_a_generated_mesh_on_standard_output_is_alone_there():
    done = gmsnet("generate", "/dev/fd/1", "--nodes", "9", "--format", "su2")
    assert done.returncode == 0
    assert done.stdout.startswith(b"NDIME")
    assert b"boundary edges" not in done.stdout
    assert b"boundary edges" in done.stderr


def closed(*numbers):
    """Options of ``subprocess`` that close standard streams in the new process."""

    def close():
        for number in numbers:
            os.close(number)

    return {"preexec_fn": close}


@pytest.mark.skipif(os.name != "posix", reason="only POSIX systems start a process with closed streams")
@pytest.mark.parametrize("numbers", [(1,), (0, 1, 2)])
def test_closed_streams_swallow_what_is_printed(run, square, tmp_path, numbers):
    assert gmsnet("smooth", square, tmp_path / "out.su2", **closed(*numbers)).returncode == 0
    assert run("smooth", square, tmp_path / "expected.su2").code == 0
    assert (tmp_path / "out.su2").read_bytes() == (tmp_path / "expected.su2").read_bytes()
    done = gmsnet("smooth", tmp_path / "missing.su2", tmp_path / "new.su2", **closed(*numbers))
    assert done.returncode == 2
    assert (b"no such file" in done.stderr) is (2 not in numbers)
    assert gmsnet("--help", **closed(*numbers)).returncode == 0


@pytest.mark.skipif(os.name != "posix", reason="only POSIX systems start a process with closed streams")
def test_a_mesh_to_or_from_a_closed_stream_is_an_error(square, tmp_path):
    done = gmsnet("smooth", square, "-", **closed(1))
    assert (done.returncode, done.stderr.count(b"\n")) == (2, 1)
    assert b"standard output: it is closed" in done.stderr
    done = gmsnet("smooth", "-", tmp_path / "out.su2", **closed(0))
    assert (done.returncode, done.stderr.count(b"\n")) == (2, 1)
    assert b"standard input: it is closed" in done.stderr
    assert not (tmp_path / "out.su2").exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("wait_for", [b"reading", b"sweep"])
def test_a_real_signal_writes_all_or_nothing_and_says_which(run, tmp_path, wait_for, number):
    pty = pytest.importorskip("pty")
    mesh, out = tmp_path / "in.vtk", tmp_path / "out.vtk"
    assert run("generate", mesh, "--nodes", "40000", "--jitter", "1").code == 0
    ours, theirs = pty.openpty()
    slow = [
        "--method",
        "optimize",
        "--variant",
        "newton",
        "--objective",
        "cosine",
    ]  # long enough for its bar to be seen
    command = [*GMSNET, "smooth", mesh, out, "--threads", "1", "--json", *slow]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=theirs, env={**PLAIN, "TERM": "xterm"})
    os.close(theirs)
    seen, sent = b"", False
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:  # Linux says so when the other end is closed
            break
        if not piece:
            break
        seen += piece
        if wait_for in seen and not sent:
            process.send_signal(number)
            sent = True
    said = process.stdout.read()
    process.stdout.close()
    os.close(ours)
    assert sent
    ended = (130, -number)  # Python may end itself by the signal that it caught; shells call both 130
    assert process.wait() in (0, *ended)
    if out.exists():
        assert process.returncode == 0 or b"is written to" in seen or json.loads(said)["output"] == str(out)
        assert len(read(out).points) == len(read(mesh).points)
        assert json.loads(run("quality", out, "--json").out)["inverted"] == 0
    else:
        assert process.returncode in ended
        assert said == b""
        # As long as there is nothing to lose SIGTERM ends the process, as it does any other.
        assert b"interrupted; nothing was written" in seen or process.returncode == -signal.SIGTERM
        assert b"Traceback" not in seen
    assert {path.name for path in tmp_path.iterdir()} <= {"in.vtk", "out.vtk"}


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
