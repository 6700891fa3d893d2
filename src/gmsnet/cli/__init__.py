"""The command line: one subcommand a file. This one joins them, and turns errors into one line and an exit code.

Nothing heavy is imported before a subcommand runs, so that help and completion answer at once.
"""

from __future__ import annotations

import contextlib
import gc
import io
import os
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from gmsnet.cli import deform, generate, gmsh, methods, quality, reproduce, smooth, train
from gmsnet.cli.moves import joined
from gmsnet.cli.signals import Interrupted
from gmsnet.errors import GmsnetError
from gmsnet.kernels.jit.usable import UnusableNumbaError
from gmsnet.mesh.display import visible
from gmsnet.parallel.interrupts import interruptible

DONE, BAD_INPUT = 0, 2
MANY_OBJECTS = (
    200_000  # before cycles are looked for: what imports make is kept, and rounds over it took a tenth of a run
)
BUG, INTERRUPTED, BROKEN_PIPE = 70, 130, 141  # as the shells and sysexits.h have them

# Whichever Click the installed Typer uses, its own or the package: this is the base of all its usage errors.
UsageError: type[Exception] = next(base for base in typer.BadParameter.__mro__ if base.__name__ == "ClickException")

app = typer.Typer(
    name="gmsnet",
    help="Better elements for any mesh file: moves nodes, changes nothing else and never inverts a cell.",
    epilog="Exit codes: 0 done, 1 a target is missed, cells stay inverted or a boundary is not in place, "
    "2 bad usage or input.",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command()(smooth.smooth)
app.command()(deform.deform)
app.command()(quality.quality)
app.command()(methods.methods)
app.command()(generate.generate)
app.command()(gmsh.gmsh)
app.command()(train.train)
app.command()(reproduce.reproduce)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"gmsnet {version('gmsnet')}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _gmsnet(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(BAD_INPUT)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code: 0, 1, 2; 130 interrupted, 141 broken pipe, 70 a bug of ours."""
    before = gc.get_threshold()
    gc.set_threshold(MANY_OBJECTS)
    try:
        return _run(arguments)
    finally:
        gc.set_threshold(*before)


def _run(arguments: Sequence[str] | None) -> int:
    _open_what_is_closed()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a name that the terminal cannot show must not end the run
            stream.reconfigure(errors="backslashreplace")
    try:
        with interruptible():
            given = list(sys.argv[1:] if arguments is None else arguments)
            parsed = joined(given) if given[:1] == ["deform"] else given
            code = app(parsed, prog_name="gmsnet", standalone_mode=False, obj=given)
            sys.stdout.flush()
    except SystemExit as error:
        if isinstance(error.__context__, BrokenPipeError):  # Typer makes an exit of it
            return _close_pipe()
        if isinstance(error.code, int):
            return error.code
        raise
    except BrokenPipeError:
        return _close_pipe()
    except (GmsnetError, UsageError, OSError, UnusableNumbaError) as error:
        return _fail(error.format_message() if isinstance(error, UsageError) else _describe(error))  # type: ignore[attr-defined]
    except Interrupted as interruption:
        return _interrupted(str(interruption))
    except (KeyboardInterrupt, typer.Abort):
        return _interrupted("interrupted; nothing was written")
    except MemoryError as error:
        return _fail(f"the memory does not suffice: {str(error) or 'what is asked for is too large'}")
    except Exception as error:
        if os.environ.get("GMSNET_DEBUG"):
            raise
        what = visible(" ".join(f"{type(error).__name__}: {error}".split()))
        print(
            f"gmsnet: internal error: {what}; please report it; GMSNET_DEBUG=1 shows the traceback",
            file=sys.stderr,
        )
        return BUG
    if code == INTERRUPTED:  # Typer swallows KeyboardInterrupt
        return _interrupted("interrupted; nothing was written")
    return code if isinstance(code, int) else DONE


def _open_what_is_closed() -> None:
    """Where the caller closed a standard stream, what is printed goes nowhere, and no file gets the stream's number."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number
    if sys.stdout is None:
        sys.stdout = io.StringIO()
    if sys.stderr is None:
        sys.stderr = io.StringIO()


def _interrupted(message: str) -> int:
    print(f"gmsnet: {visible(message)}", file=sys.stderr)
    return INTERRUPTED


def _describe(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{os.fsdecode(error.filename)}: {error.strerror}"
    return str(error)


def _fail(message: str) -> int:
    print(f"gmsnet: error: {visible(' '.join(message.split()))}", file=sys.stderr)
    return BAD_INPUT


def _close_pipe() -> int:
    """The reader of our output went away: that is no error, and Python shall not complain when it flushes at exit."""
    with contextlib.suppress(io.UnsupportedOperation):  # a stream in memory has nothing to flush to
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return BROKEN_PIPE
