"""The program ``cellplan``: its commands, and the one place where errors become lines and exit statuses."""

import gc
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Annotated, Final, NoReturn

import typer
from typer.completion import get_completion_inspect_parameters

import cellplan
from cellplan.cli.base_map import base_map
from cellplan.cli.check import check
from cellplan.cli.compare import compare
from cellplan.cli.completion import Install, Show
from cellplan.cli.errors import OutputError, report_failure
from cellplan.cli.explain import explain
from cellplan.cli.export import export
from cellplan.cli.fastest import fastest
from cellplan.cli.floor_plan import floor_plan
from cellplan.cli.given_options import Command
from cellplan.cli.init import init
from cellplan.cli.layout import layout
from cellplan.cli.output import say
from cellplan.cli.overview import FIRST_STEPS, WIDEST, Overview, examples
from cellplan.cli.recover import recover
from cellplan.cli.rehearse import rehearse
from cellplan.cli.robots import robots
from cellplan.cli.schema import schema
from cellplan.cli.solve import solve
from cellplan.cli.sweep import sweep
from cellplan.cli.verbosity import with_verbosity
from cellplan.cli.verify import verify
from cellplan.cli.view import view
from cellplan.errors import ExitStatus

os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # schemas need none, and the search for them takes 20 ms

INTERRUPTIONS: Final = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]  # a background job ignores the first of them
GARBAGE_THRESHOLD: Final = 200_000  # objects: by default all are searched for cycles many times while modules load
REPEAT_DELAY_S: Final = 0.02  # [s] delay after which the callback that lost the interruption has ended

app = typer.Typer(
    cls=Overview,
    add_completion=False,  # with options of its own, which name the shell
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": WIDEST},
)
COMMANDS: Final[dict[str, dict[str, Callable[..., None]]]] = {
    "Begin": {"init": init, "robots": robots, "check": check, "explain": explain, "schema": schema},
    "Solve": {"solve": solve, "view": view, "floorplan": floor_plan, "verify": verify, "export": export},
    "Improve": {"layout": layout, "map": base_map, "fastest": fastest, "sweep": sweep, "compare": compare},
    "Real cell": {"rehearse": rehearse, "recover": recover},
}  # by group, in the order of work


def _show_version(desired: bool) -> None:
    if desired:
        say(f"cellplan {cellplan.__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def program(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    install_completion: Install = None,
    show_completion: Show = None,
) -> None:
    """Offline programming for cooperative robots that work on one moving part."""
    del version, install_completion, show_completion  # their callbacks have ended the program
    if context.invoked_subcommand is None:
        say(FIRST_STEPS)
        raise typer.Exit(ExitStatus.BAD_INPUT)


for group, commands in COMMANDS.items():
    for name, command in commands.items():
        app.command(name, cls=Command, rich_help_panel=group, epilog=examples(name))(with_verbosity(command))
get_completion_inspect_parameters()  # prepares the shells


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command and give its exit status; no exception leaves, no traceback is shown."""
    try:
        outcome = app(args=arguments, prog_name="cellplan", standalone_mode=False)
    except SystemExit as end:
        if end.code in (0, None):  # completion was shown or installed
            return ExitStatus.PASSED
        # what remains of a closed pipe below the help texts of typer
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
