"""Options of the command line that change a cell or its errors before anything is computed."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from difflib import get_close_matches
from typing import TYPE_CHECKING, Final

from cellplan.errors import InputError
from cellplan.files.cell.changes import read_setting
from cellplan.model.cell.cell import Cell
from cellplan.model.task.task import ProgrammedPath

if TYPE_CHECKING:
    from cellplan.model.cell.cell_errors import CellErrors

ADDRESSES: Final[Mapping[str, str]] = {
    "mode": "motion.mode",
    "method": "solver.method",
    "integrator": "solver.integrator",
    "duration": "motion.duration_s",
    "clearance_mm": "checks.clearance_mm",
}  # in the cell file, by the name of the option


def with_overrides(cell: Cell, settings: Iterable[str] = (), **options: str | float | None) -> Cell:
    """The cell with the values of options; see ``Cell.with_values``.

    Args:
        cell: The cell as written.
        settings: Further values as ``KEY=VALUE``, with addresses of the cell file as keys.
        **options: Values by the names in ``ADDRESSES``; None leaves the cell as it is.

    Raises:
        InputError: An address does not exist or is given twice, or the changed cell is not valid.
    """
    values = read_settings(settings, {ADDRESSES[name]: value for name, value in options.items() if value is not None})
    return cell.with_values(values) if values else cell


def feed_settings(cell: Cell, settings: tuple[str, ...], feed: str | None) -> tuple[str, ...]:
    """Settings ``KEY=VALUE``, then those that give all processes with one feed another, such as ``greatest``.

    Args:
        cell: The cell as written.
        settings: Settings, which processes may come from.
        feed: The other feed; None adds nothing.

    Raises:
        InputError: There is no such process, the feed is none, or a setting is not valid.
    """
    if feed is None:
        return settings
    try:
        read_setting(f"feed={feed}")
    except InputError:
        raise InputError(f"--feed: expected a number in mm/s, greatest or a range [40, 90], got '{feed}'") from None
    tasks = with_overrides(cell, settings).tasks
    names = [task.name for task in tasks if task.process is not None and not isinstance(task.path, ProgrammedPath)]
    if not names:
        raise InputError(
            f"{cell.origin.file}: --feed: expected a cell with a task that has a process, got none; write process: "
            "{feed_mm_s}"
        )
    return (*settings, *(f"tasks.{name}.process.feed_mm_s={feed}" for name in names))


def read_settings(settings: Iterable[str], others: Mapping[str, object] | None = None) -> dict[str, object]:
    """Values by address of ``KEY=VALUE``, beside others; raises ``InputError`` where an address is given twice."""
    values = dict(others or {})
    for address, value in map(read_setting, settings):
        if address in values:
            raise InputError(f"--set: expected every key once, got '{address}' again")
        values[address] = value
    return values


def with_draws(errors: "CellErrors", *, trials: int | None = None, seed: int | None = None) -> "CellErrors":
    """The errors with another number of trials or another seed; None leaves that of the file.

    Raises:
        InputError: A number is too small.
    """
    for option, given, least in (("--trials", trials, 1), ("--seed", seed, 0)):
        if given is not None and given < least:
            raise InputError(f"{option}: expected a whole number of at least {least}, got {given}")
    return replace(
        errors, trials=errors.trials if trials is None else trials, seed=errors.seed if seed is None else seed
    )


def require_task(cell: Cell, name: str | None) -> None:
    """Refuse the name of a task that the cell does not have.

    Raises:
        InputError: There is no such task.
    """
    names = [task.name for task in cell.tasks]
    if name is None or name in names:
        return
    near = get_close_matches(name, names, n=1)
    hint = f"; did you mean '{near[0]}'?" if near else ""
    raise InputError(f"--task: expected one of {', '.join(names)}, got '{name}'{hint}")
