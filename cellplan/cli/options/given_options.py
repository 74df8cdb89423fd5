"""Options as they were given: none is dropped in silence because another one was given too, or itself once more."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from typer.core import TyperCommand

from cellplan.errors import InputError

Options = tuple[str, ...]
ONLY_WITH: Final[Mapping[tuple[str, str], Options]] = {
    ("fastest", "--free"): (*("--timing", "--clearance", "--margin", "--budget", "--trials", "--seed", "--resume"),),
    ("rehearse", "--feedback"): ("--rounds",),
}  # options that say nothing without the one that is named, by command and that one
NOT_WITH: Final[Mapping[tuple[str, str], Options]] = {
    ("fastest", "--free"): ("--demand", "--task", "--points"),
    ("layout", "--repair"): (
        *("--objective", "--misplacement", "--try", "--budget", "--trials", "--scheduler", "--resume"),
    ),
    ("layout", "--status"): ("--repair", "--resume", "--json"),
    ("map", "--status"): ("--resume", "--json"),
}  # options that say nothing beside the one that is named, likewise


class Command(TyperCommand):
    """A command that refuses options of which it would take no notice."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words of the command line.

        Raises:
            InputError: An option that is given twice counts once, or one has no meaning with or without another.
        """
        if not ctx.resilient_parsing:
            refuse_ignored(self, ctx, args)
        return super().parse_args(ctx, args)


def refuse_ignored(command: Any, ctx: Any, args: list[str]) -> None:
    """Refuse options of a command line that would be ignored.

    A flag that is given twice means what it means once.

    Args:
        command: The command, or the program itself with its own options.

    Raises:
        InputError: An option with one value is given twice, or one has no meaning with or without another.
    """
    _, _, order = command.make_parser(ctx).parse_args(args=list(args))
    options = [option for option in order if option.param_type_name == "option"]
    given = {_name(option) for option in options}
    if "--help" in given:
        return
    for option, count in Counter(options).items():
        if count > 1 and not option.multiple and not option.is_flag:
            raise InputError(f"{_name(option)}: expected once, got it {count} times; leave all but one of them out")
    for (name, needed), others in ONLY_WITH.items():
        for other in others:
            if name == ctx.info_name and other in given and needed not in given:
                raise InputError(f"{other}: expected only with {needed}, without which it says nothing; leave it out")
    for (name, first), others in NOT_WITH.items():
        for other in others:
            if name == ctx.info_name and {first, other} <= given:
                raise InputError(
                    f"{other}: expected not together with {first}, which takes no notice of it; leave it out"
                )


def _name(option: Any) -> str:
    return max(option.opts, key=len)


def require_choice(cell: Path | None, *, without_cell: bool) -> None:
    """Require exactly one of the cell file that was solved and ``--without-cell``.

    Raises:
        InputError: Neither or both were given.
    """
    if cell is None and not without_cell:
        raise InputError(
            "--cell: expected the cell file that was solved, so that it and its files are compared with the run, got "
            "none; use --without-cell for the run's own copy of it"
        )
    if cell is not None and without_cell:
        raise InputError("--without-cell: expected no --cell beside it")
