"""The command line: one subcommand a file. This one joins them, and turns errors into one line and an exit code.

Nothing heavy is imported before a subcommand runs, so that help and completion answer at once.
"""

from __future__ import annotations

import contextlib
import gc
import io
import os
import signal
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from gmsnet.cli import deform, generate, gmsh, methods, paraview, quality, reproduce, smooth, train, warm_up
from gmsnet.cli.failure import BAD_INPUT, DONE, print_failure
from gmsnet.cli.moves import joined
from gmsnet.cli.ranks import on_all_ranks
from gmsnet.cli.signals import Interrupted
from gmsnet.mesh.display import visible
from gmsnet.parallel.interrupts import interruptible

MANY_OBJECTS = (
    200_000  # before cycles are looked for: what imports make is kept, and rounds over it took a tenth of a run
)
INTERRUPTED, BROKEN_PIPE = 130, 141  # as the shells have them

app: typer.Typer = typer.Typer(
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
app.command("paraview-plugin")(paraview.paraview_plugin)
app.command()(train.train)
app.command()(reproduce.reproduce)
app.command()(warm_up.warm_up)


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
        return on_all_ranks(lambda: _run(arguments))
    finally:
        gc.set_threshold(*before)


def program() -> int:
    """``main`` as a program: once its work is done, Ctrl-C ends it without a traceback."""
    code = main()
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return code


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
    except Interrupted as interruption:
        return _interrupted(str(interruption))
    except (KeyboardInterrupt, typer.Abort):
        return _interrupted("interrupted; nothing was written")
    except Exception as error:
        return print_failure(error)
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


def _close_pipe() -> int:
    """The reader of our output went away: that is no error, and Python shall not complain when it flushes at exit."""
    with contextlib.suppress(io.UnsupportedOperation):  # a stream in memory has nothing to flush to
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return BROKEN_PIPE
