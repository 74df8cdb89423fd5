"""Choice: what of a run is exported and how, beside the format, and which robots a format plays."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from cellplan.errors import InputError, raise_findings
from cellplan.files.input.findings import did_you_mean, listed
from cellplan.model.cell.cell import Cell
from cellplan.model.report.exported import Moves, Promise
from cellplan.programs.elements.dialect import Dialect

THIN_MM: Final = 0.05  # [mm] a tool or sliding joint, where rows may be left out and nothing is chosen
THIN_DEG: Final = 0.05  # [deg] a turning joint, likewise
LEAST_SPLIT: Final = 2  # rows of a part: one alone is no motion


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What the caller chose.

    Attributes:
        robots: Names of the robots; empty for all that the format plays.
        moves: How tools move where they work.
        split: Most rows of a file or routine; None for the limit of the format.
        thin_mm: How far a tool on the part, or a sliding joint, may be off in [mm] where rows are left out; None for
            what is usual.
        thin_deg: How far a turning joint may be off in [deg], likewise.
        promise: What is to be promised; None for the best that holds.
        steps: Whether programs set their step register at marks, at which they wait for others.
    """

    robots: tuple[str, ...] = ()
    moves: Moves = Moves.JOINTS
    split: int | None = None
    thin_mm: float | None = None
    thin_deg: float | None = None
    promise: Promise | None = None
    steps: bool = False

    @property
    def is_thinned(self) -> bool:
        """Whether it is chosen how far rows may be off where some are left out."""
        return self.thin_mm is not None or self.thin_deg is not None

    def refuse_for(self, dialect: Dialect) -> None:
        """Refuse what a format cannot do.

        Raises:
            InputError: It cannot.
        """
        if self.moves is Moves.LINEAR and self.moves not in dialect.moves:
            raise InputError(f"--moves: expected {listed(dialect.moves)} with {dialect.name}, got {self.moves}")
        if self.promise is Promise.PACED and self.moves is Moves.JOINTS:
            raise InputError("--promise: expected --moves linear or auto with paced, got joints, which state no speed")
        if self.moves is Moves.LINEAR and self.promise in {Promise.TIMED, Promise.SEQUENCE_ONLY}:
            raise InputError(f"--promise: expected paced or synchronised with --moves linear, got {self.promise}")
        if self.promise is not None and self.promise not in dialect.promises:
            raise InputError(f"--promise: expected {listed(dialect.promises)} with {dialect.name}, got {self.promise}")
        if self.steps and self.promise not in {Promise.PACED, Promise.SEQUENCE_ONLY}:
            raise InputError(f"--escape: expected --promise paced, sequence or none, got {self.promise}")
        if self.split is not None and dialect.split is None:
            raise InputError(f"--split: expected no --split with {dialect.name}, whose files have no limit")
        if self.split is not None and not LEAST_SPLIT <= self.split <= (dialect.split or 0):
            raise InputError(
                f"--split: expected {LEAST_SPLIT} to {dialect.split} rows with {dialect.name}, got {self.split}"
            )
        for name, value in (("--thin-mm", self.thin_mm), ("--thin-deg", self.thin_deg)):
            if value is not None and not dialect.is_thinned:
                raise InputError(f"{name}: expected no thinning with {dialect.name}, whose rows all stay")
            if value is not None and not 0.0 < value < math.inf:
                raise InputError(f"{name}: expected a positive number, got {value:g}")

    def thinning(self, dialect: Dialect) -> tuple[float, float] | None:
        """How far a tool in [mm] and a turning joint in [deg] may be off; None where no row is left out."""
        if not dialect.is_thinned:
            return None
        return (
            THIN_MM if self.thin_mm is None else self.thin_mm,
            THIN_DEG if self.thin_deg is None else self.thin_deg,
        )


def exported_robots(cell: Cell, dialect: Dialect, chosen: Sequence[str]) -> tuple[str, ...]:
    """Names of the robots that a format writes, in the order of the cell.

    Without a choice these are all whose controller plays it; ``InputError`` where there is none, or no such robot.
    """
    refuse_unknown_robots(cell, chosen)
    requested = [robot.name for robot in cell.robots if not chosen or robot.name in chosen]
    if not dialect.kinds:
        return tuple(requested)
    playing = tuple(name for name in requested if _plays(cell, dialect, name))
    missing = [name for name in requested if name not in playing]
    if missing and (chosen or not playing):
        raise_findings([InputError(_not_played(cell, dialect, name)) for name in missing])
    return playing


def refuse_unknown_robots(cell: Cell, chosen: Sequence[str]) -> None:
    """Refuse robots that the cell does not have, which no format could write."""
    names = [robot.name for robot in cell.robots]
    for name in chosen:
        if name not in names:
            raise InputError(f"--robot: expected one of {listed(names)}, got '{name}'{did_you_mean(name, names)}")


def _plays(cell: Cell, dialect: Dialect, robot: str) -> bool:
    """Whether the controller of a robot plays a format."""
    control = cell.robot(robot).control
    return control is not None and cell.controllers[control.id].kind in dialect.kinds


def _not_played(cell: Cell, dialect: Dialect, robot: str) -> str:
    """Why a format does not play a robot."""
    control = cell.robot(robot).control
    if control is None:
        return f"robots.{robot}.controller: expected the controller that plays {dialect.name}, got none"
    kinds = " or ".join(sorted(dialect.kinds))
    return (
        f"robots.{robot}.controller: expected a controller of kind {kinds}, which plays {dialect.name}, got "
        f"'{control.id}' of kind {cell.controllers[control.id].kind}"
    )
