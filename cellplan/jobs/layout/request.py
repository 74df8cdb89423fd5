"""Request: what a layout search is asked for, as plain data."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cellplan.files.cell.load import load_cell
from cellplan.runs.overrides import with_overrides
from cellplan.search.programs.objective import CycleTiming, Objective
from cellplan.study.bundle import Bundle


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutRequest:
    """What is searched for, in plain data that a worker process can be sent.

    Attributes:
        cell: The cell file.
        allow_dirs: Further folders that the files it names may lie in.
        objective: What is improved once all demands are kept.
        timing: How the motion is made as fast as the limits allow.
        duration: Duration in [s] at which the limits must hold; None for that of the cell, where the objective is not
            the cycle itself.
        clearance: Demanded distance in [mm]; None for that of the cell.
        margin: Demanded distance of turning joints from their limits in [deg]; None for that of the cell.
        misplacement: By how much every base may be off in [mm] and [deg]; None for what the cell says.
        settings: Values set in the cell, each as ``KEY=VALUE``.
        vary: Keys that may change beside those of the cell, each as ``KEY`` or ``KEY=RANGES``.
        fixed: Keys that may not change.
        attempts: Cell files whose layouts are tried first.
        free: Words for what alone may change, whatever the cell says, while bases and tools stay; see ``freed``.
        seed: Seed of starts and perturbations.
    """

    cell: Path
    allow_dirs: tuple[Path, ...] = ()
    objective: Objective = Objective.CYCLE
    timing: CycleTiming = CycleTiming.LAWS
    duration: float | None = None
    clearance: float | None = None
    margin: float | None = None
    misplacement: tuple[float, float] | None = None
    settings: tuple[str, ...] = ()
    vary: tuple[str, ...] = ()
    fixed: tuple[str, ...] = ()
    attempts: tuple[Path, ...] = ()
    free: tuple[str, ...] = ()
    seed: int = 0

    @property
    def anywhere(self) -> "LayoutRequest":
        """The same request for processes that run in other folders."""
        attempts, folders = (tuple(path.absolute() for path in paths) for paths in (self.attempts, self.allow_dirs))
        return replace(self, cell=self.cell.absolute(), attempts=attempts, allow_dirs=folders)

    @property
    def record(self) -> dict[str, Any]:
        """The request as it stands in a study; files by their names only, as their content is among the inputs."""
        return {
            "objective": str(self.objective),
            "timing": str(self.timing),
            "duration_s": self.duration,
            "clearance_mm": self.clearance,
            "margin_deg": self.margin,
            "misplacement": None if self.misplacement is None else list(self.misplacement),
            "settings": list(self.settings),
            "vary": list(self.vary),
            "fix": list(self.fixed),
            "free": list(self.free),
            "try": [path.name for path in self.attempts],
            "seed": self.seed,
        }


def files_of(request: LayoutRequest) -> Bundle:
    """The files that a search reads."""
    given, *others = (load_cell(path, allow_dirs=request.allow_dirs) for path in (request.cell, *request.attempts))
    cells = [with_overrides(given, request.settings), *others]
    return Bundle.of(zip((request.cell, *request.attempts), cells, strict=True), allow_dirs=request.allow_dirs)
