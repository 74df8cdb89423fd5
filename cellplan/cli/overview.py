"""The list of commands in the order of work, examples, and first steps."""

from itertools import groupby
from typing import Any, Final

from typer.core import TyperGroup

from cellplan.cli.options.given_options import refuse_ignored

WIDEST: Final = 110  # [columns] of help; longer lines are hard to read
FIRST_STEPS: Final = """\
Usage: cellplan [OPTIONS] COMMAND [ARGS]...

Offline programming for cooperative robots that work on one moving part.

First steps:
  cellplan init my-cell                        a commented cell to begin with
  cellplan check my-cell/cell.yaml --watch     read it again on each save
  cellplan solve my-cell/cell.yaml --view      plan, check, report and 3-D page

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
