"""The program ``cellplan``: its commands, examples, and the one place where errors become lines and exit statuses."""

import gc
import os
import signal
import sys
import threading
from collections.abc import Sequence
from itertools import groupby
from typing import Annotated, Any, Final, NoReturn

import typer
from typer.completion import get_completion_inspect_parameters
from typer.core import TyperGroup
from typer.main import get_command

import cellplan
from cellplan.cli.begin.check import check
from cellplan.cli.begin.explain import explain
from cellplan.cli.begin.init import init
from cellplan.cli.begin.robots import robots
from cellplan.cli.begin.schema import schema
from cellplan.cli.begin.seams import seams
from cellplan.cli.command import Work, as_command
from cellplan.cli.edit.edit import edit
from cellplan.cli.improve.assign import assign
from cellplan.cli.improve.base_map import base_map
from cellplan.cli.improve.compare import compare
from cellplan.cli.improve.fastest import fastest
from cellplan.cli.improve.layout import layout
from cellplan.cli.improve.sweep import sweep
from cellplan.cli.options.completion import SHELLS, install, one_of, show
from cellplan.cli.options.given_options import Command, refuse_ignored
from cellplan.cli.options.request import option
from cellplan.cli.real_cell.recover import recover
from cellplan.cli.real_cell.rehearse import rehearse
from cellplan.cli.solve.export import export
from cellplan.cli.solve.floor_plan import floor_plan
from cellplan.cli.solve.solve import solve
from cellplan.cli.solve.verify import verify
from cellplan.cli.solve.view import view
from cellplan.cli.terminal.errors import OutputError, report_failure
from cellplan.cli.terminal.output import say
from cellplan.errors import ExitStatus

WIDEST: Final = 110  # [columns] of help; longer lines are hard to read
FIRST_STEPS: Final = """\
Usage: cellplan [OPTIONS] COMMAND [ARGS]...

Offline programming for cooperative robots that work on one moving part.

First steps:
  cellplan init my-cell                        a commented cell to begin with
  cellplan check my-cell/cell.yaml --watch     read it again on each save
  cellplan solve my-cell/cell.yaml --view      plan, check, report and 3-D page
  cellplan edit my-cell/cell.yaml              drag its bases in a browser

cellplan --help lists all commands, cellplan COMMAND --help what one of them can do."""
EXAMPLES: Final[dict[str, tuple[str, ...]]] = {
    "init": ("cellplan init my-cell", "cellplan init --list", "cellplan init my-rail --template rail"),
    "check": ("cellplan check cell.yaml --watch", "cellplan check cell.yaml --set robots.kuka.base.x_mm=900"),
    "solve": (
        "cellplan solve cell.yaml --view",
        "cellplan solve cell.yaml --mode pairwise -o outputs/pairwise",
        "cellplan solve cell.yaml --watch --view",
    ),
    "view": ("cellplan view outputs/cell", "cellplan view cell.yaml --set robots.kuka.base.x_mm=900"),
    "edit": ("cellplan edit cell.yaml", "cellplan edit cell.yaml --port 8421 --no-browser"),
    "floorplan": ("cellplan floorplan outputs/cell", "cellplan floorplan cell.yaml --format dxf -o cell.dxf"),
    "verify": ("cellplan verify outputs/cell --cell cell.yaml",),
    "export": (
        "cellplan export outputs/cell --format csv --cell cell.yaml",
        "cellplan export outputs/cell --format wide --cell cell.yaml",
    ),
    "layout": ("cellplan layout cell.yaml --repair", "cellplan layout cell.yaml --objective cycle --budget 5min"),
    "map": ("cellplan map cell.yaml --robot kuka --grid 100 --certify 3",),
    "assign": ("cellplan assign cell.yaml -o outputs/assigned",),
    "fastest": ("cellplan fastest cell.yaml -o outputs/fastest", "cellplan fastest cell.yaml --demand 120/h"),
    "sweep": ("cellplan sweep cell.yaml --vary motion.duration_s=3:6:0.5",),
    "compare": ("cellplan compare cell.yaml", "cellplan compare outputs/one outputs/two"),
    "rehearse": ("cellplan rehearse cell.yaml --errors errors.yaml --feedback",),
    "recover": (
        "cellplan recover outputs/cell --at 1.32 --cell cell.yaml",
        "cellplan recover outputs/cell --at 1.32 --frozen kuka@1.30 --without-cell",
    ),
    "seams": ("cellplan seams frame.step --fillets", "cellplan seams frame.step --gap-mm 1 -o frame-seams.html"),
    "robots": ("cellplan robots kuka_kr16_2", "cellplan robots arm.urdf --flange tool0"),
}  # by command; each is understood


class Overview(TyperGroup):
    """All commands, listed in groups."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words before the command; see ``Command.parse_args``."""
        if not ctx.resilient_parsing:
            refuse_ignored(self, ctx, args)
        return super().parse_args(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a list for each group, in the order in which the commands were added."""
        commands = [(name, self.commands[name]) for name in self.list_commands(ctx)]
        longest = max(len(name) for name, _ in commands)
        for title, group in groupby(commands, key=lambda named: getattr(named[1], "rich_help_panel", "Commands")):
            with formatter.section(title):
                formatter.write_dl(
                    [
                        (name.ljust(longest), command.get_short_help_str(formatter.width - longest - 6))
                        for name, command in group
                    ]
                )


def examples(command: str) -> str | None:
    """Examples at the end of the help of a command; None if it has none."""
    lines = EXAMPLES.get(command)
    return None if lines is None else "\n".join(["\b", "Examples:", *(f"  {line}" for line in lines)])


os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # schemas need none, and the search for them takes 20 ms

# a background job ignores the first of them
INTERRUPTIONS: Final = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
GARBAGE_THRESHOLD: Final = 200_000  # objects: by default all are searched for cycles many times while modules load
REPEAT_DELAY_S: Final = 0.02  # [s] delay after which the callback that lost the interruption has ended

app = typer.Typer(
    cls=Overview,
    add_completion=False,  # with options of its own, which name the shell
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": WIDEST},
)
COMMANDS: Final[dict[str, dict[str, Work]]] = {
    "Begin": {"init": init, "robots": robots, "seams": seams, "check": check, "explain": explain, "schema": schema},
    "Solve": {"solve": solve, "view": view, "floorplan": floor_plan, "verify": verify, "export": export},
    "Edit": {"edit": edit},
    "Improve": {
        "assign": assign,
        "layout": layout,
        "map": base_map,
        "fastest": fastest,
        "sweep": sweep,
        "compare": compare,
    },
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
        bool, option("--version", "Print the version and exit.", callback=_show_version, is_eager=True)
    ] = False,
    install_completion: Annotated[
        str | None,
        option(
            "--install-completion SHELL",
            "Let bash, zsh or fish complete commands, options, cells and names; then open a new terminal.",
            callback=install,
            is_eager=True,
            autocompletion=one_of(*SHELLS),
        ),
    ] = None,
    show_completion: Annotated[
        str | None,
        option(
            "--show-completion SHELL",
            "Print the script for that instead.",
            callback=show,
            is_eager=True,
            autocompletion=one_of(*SHELLS),
        ),
    ] = None,
) -> None:
    """Offline programming for cooperative robots that work on one moving part."""
    del version, install_completion, show_completion  # their callbacks have ended the program
    if context.invoked_subcommand is None:
        say(FIRST_STEPS)
        raise typer.Exit(ExitStatus.BAD_INPUT)


for group, commands in COMMANDS.items():
    for name, command in commands.items():
        app.command(name, cls=Command, rich_help_panel=group, epilog=examples(name))(as_command(command))
COMMAND_LINE: Final = get_command(app)
get_completion_inspect_parameters()  # prepares the shells


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command and give its exit status; no exception leaves, no traceback is shown."""
    try:
        outcome = COMMAND_LINE(args=arguments, prog_name="cellplan", standalone_mode=False)
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
