"""The program ``cellplan``: its commands, and the one place where errors become lines and exit statuses."""

import gc
import signal
import sys
import threading
from collections.abc import Sequence
from typing import Annotated, Final, NoReturn

import typer

import cellplan
from cellplan.cli.base_map import base_map
from cellplan.cli.check import check
from cellplan.cli.compare import compare
from cellplan.cli.errors import OutputError, report_failure
from cellplan.cli.explain import explain
from cellplan.cli.export import export
from cellplan.cli.fastest import fastest
from cellplan.cli.floor_plan import floor_plan
from cellplan.cli.layout import layout
from cellplan.cli.output import say
from cellplan.cli.rehearse import rehearse
from cellplan.cli.robots import robots
from cellplan.cli.schema import schema
from cellplan.cli.solve import solve
from cellplan.cli.sweep import sweep
from cellplan.cli.verify import verify
from cellplan.cli.view import view
from cellplan.errors import ExitStatus

INTERRUPTIONS: Final = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]  # a background job ignores the first of them
GARBAGE_THRESHOLD: Final = 200_000  # objects: by default all are searched for cycles many times while modules load
REPEAT_DELAY_S: Final = 0.02  # [s] delay after which the callback that lost the interruption has ended

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(desired: bool) -> None:
    if desired:
        say(f"cellplan {cellplan.__version__}")
        raise typer.Exit


@app.callback()
def program(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Offline programming for cooperative robots that work on one moving part."""


app.command()(check)
app.command()(explain)
app.command()(solve)
app.command()(verify)
app.command()(view)
app.command("floorplan")(floor_plan)
app.command()(export)
app.command()(sweep)
app.command()(compare)
app.command()(fastest)
app.command("map")(base_map)
app.command()(layout)
app.command()(rehearse)
app.command()(robots)
app.command()(schema)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command and give its exit status; no exception leaves, no traceback is shown."""
    try:
        outcome = app(args=arguments, prog_name="cellplan", standalone_mode=False)
    except SystemExit:  # what remains of a closed pipe below the help texts of typer
        return report_failure(OutputError("standard output: the result was not shown: broken pipe"))
    except typer.Abort:
        return report_failure(KeyboardInterrupt())
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001
        return _usage_status(error) or report_failure(error)
    if outcome == ExitStatus.INTERRUPTED:  # typer has caught the signal
        return report_failure(KeyboardInterrupt())
    return outcome if isinstance(outcome, int) else ExitStatus.PASSED


def _usage_status(error: BaseException) -> int | None:
    """Show a wrong use of the command line; None when the error is of another kind."""
    show, status = getattr(error, "show", None), getattr(error, "exit_code", None)
    if show is None or status is None:
        return None
    show()
    return ExitStatus.BAD_INPUT


def main() -> NoReturn:
    """Entry point of the console; termination signals and a closed terminal interrupt the program, as Ctrl-C does."""
    gc.set_threshold(GARBAGE_THRESHOLD)
    for number in INTERRUPTIONS:
        if signal.getsignal(number) == signal.SIG_DFL:  # nohup keeps its way
            signal.signal(number, signal.default_int_handler)
    sys.unraisablehook = _repeat_interruption
    status = run()
    gc.freeze()  # the end of the process frees everything, without a search for cycles
    sys.exit(status)


def _repeat_interruption(lost: "sys.UnraisableHookArgs") -> None:
    """Raise a KeyboardInterrupt again shortly after it was lost in a callback."""
    if lost.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(lost)
        return
    heard = [number for number in INTERRUPTIONS if signal.getsignal(number) == signal.default_int_handler]
    if not heard:
        return
    again = threading.Timer(REPEAT_DELAY_S, signal.raise_signal, heard[:1])
    if hasattr(signal, "pthread_kill"):  # wakes the program where it waits
        again = threading.Timer(REPEAT_DELAY_S, signal.pthread_kill, [threading.main_thread().ident, heard[0]])
    again.daemon = True
    again.start()
