"""Request: what a layout search is asked for, as plain data, and the cell that it searches."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from cellplan.errors import InputError
from cellplan.io.cell.changes import read_setting
from cellplan.io.cell.load import load_cell
from cellplan.io.input.findings import did_you_mean, listed, shown
from cellplan.model.cell import Cell
from cellplan.pipeline.overrides import with_overrides
from cellplan.pipeline.synchronous import refuse_other_jobs
from cellplan.search.programs.objective import Objective, Timing

COMPONENTS: Final = ("x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg", "length_mm", "tilt_deg")
PREFIX: Final = "robots."


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
        seed: Seed of starts and perturbations.
    """

    cell: Path
    allow_dirs: tuple[Path, ...] = ()
    objective: Objective = Objective.CYCLE
    timing: Timing = Timing.LAWS
    duration: float | None = None
    clearance: float | None = None
    margin: float | None = None
    misplacement: tuple[float, float] | None = None
    settings: tuple[str, ...] = ()
    vary: tuple[str, ...] = ()
    fixed: tuple[str, ...] = ()
    attempts: tuple[Path, ...] = ()
    seed: int = 0

    @property
    def anywhere(self) -> "LayoutRequest":
        """The same request for processes that run in other folders."""
        attempts, folders = (tuple(path.absolute() for path in each) for each in (self.attempts, self.allow_dirs))
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
            "try": [path.name for path in self.attempts],
            "seed": self.seed,
        }


def searched_cell(request: LayoutRequest) -> Cell:
    """The cell with all that the request sets in it.

    Raises:
        InputError: The cell cannot be read, an address does not exist, or its job is not one that can be searched.
    """
    if request.duration is not None and request.objective is Objective.CYCLE:
        raise InputError(
            "--duration: expected no duration where the shortest cycle is sought; add --objective conforming, "
            "clearance or change"
        )
    cell = load_cell(request.cell, allow_dirs=request.allow_dirs)
    cell = with_overrides(cell, request.settings, duration=request.duration, clearance_mm=request.clearance)
    values: dict[str, object] = {}
    if request.margin is not None:
        values["layout.margin_deg"] = request.margin
    if request.misplacement is not None:
        position, orientation = request.misplacement
        values["layout.misplacement"] = {"position_mm": position, "orientation_deg": orientation}
    if request.vary or request.fixed:
        values["layout.vary"] = _varied(cell, request)
    changed = cell.with_values(values) if values else cell
    refuse_other_jobs(changed, "a layout search")
    if request.timing is Timing.RETIMED and changed.layout is not None and changed.layout.misplacement is not None:
        raise InputError(
            "--timing: expected 'laws' where bases may be off their places, got 'retimed': leave out --misplacement or "
            "--timing"
        )
    return changed


def _varied(cell: Cell, request: LayoutRequest) -> dict[str, Any]:
    """What may change: as the cell says, or as it is by default, with the options of the request."""
    vary = {_short(key): _plain(value) for key, value in written_vary(cell).items()}
    for text in request.vary:
        key, sign, ranges = text.partition("=")
        vary[_short(key.strip())] = read_setting(f"{key.strip()}={ranges}")[1] if sign else True
    for key in map(_short, request.fixed):
        entry, _, component = key.rpartition(".")
        if key in vary:
            del vary[key]
        elif component in COMPONENTS and isinstance(vary.get(entry), dict) and component in vary[entry]:
            del vary[entry][component]
            if not vary[entry]:
                del vary[entry]
        else:
            known = sorted(_keys(vary))
            raise InputError(
                f"--fix: expected a key that may change ({listed(known)}), got {shown(key)}{did_you_mean(key, known)}"
            )
    if not vary:
        raise InputError("--fix: expected at least one key that may still change, got none")
    return vary


def written_vary(cell: Cell) -> Mapping[str, Any]:
    """What the cell file says may change; empty where it says nothing."""
    written = cell.origin.source.written if cell.origin.source is not None else {}
    return dict((written.get("layout") or {}).get("vary") or {})


def _keys(vary: Mapping[str, Any]) -> Iterable[str]:
    """Keys that can be fixed: entries, and the components of those with ranges."""
    for key, value in vary.items():
        yield key
        if isinstance(value, dict):
            yield from (f"{key}.{component}" for component in value)


def _short(key: str) -> str:
    """A key without ``robots.``, which may be left out."""
    return key.removeprefix(PREFIX)


def _plain(value: Any) -> Any:
    """A value that can be changed."""
    return dict(value) if isinstance(value, Mapping) else value
