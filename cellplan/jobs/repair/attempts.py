"""Attempts: what is allowed to change at once to make a failing cell pass."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import combinations, islice
from typing import Any, Final

from cellplan.model.cell.cell import Cell
from cellplan.model.cell.layout import LayoutSettings, VariableKind, VaryRange
from cellplan.model.cell.rod import Rod
from cellplan.model.units import DEG, MM

PART: Final = "part"  # in place of a robot: a part at rest
MOST_SUBSETS: Final = 24  # [-] of one size that are tried
SHORTER: Final = 0.5  # [-] times its length that a rod may have
LONGER: Final = 2.0  # [-] likewise
LEAST_MORE: Final = 1.01  # [-] times the length that leaves a rod between its round ends
MOST_TILT: Final = 60.0  # [deg] of a rod


class RemedyKind(StrEnum):
    """What changes, in the order in which remedies of equal size are listed."""

    LAYOUT = "layout"  # what the cell file lets a layout search change of some robots
    BRANCH = "branch"  # another inverse-kinematics branch at the start of one robot
    SPIN = "spin"  # another angle of one tool about its own axis
    FREE_SPIN = "free_spin"  # that angle left open
    WEIGHTS = "weights"  # joint weights of one robot
    METHOD = "method"  # a method that knows the limits
    STEP = "step"  # rows in shorter steps
    PATH = "path"  # the joint path of the positioner
    TOOL = "tool"  # length, tilt and roll of one rod
    DURATION = "duration"  # a longer cycle


WORDS: Final = {
    RemedyKind.TOOL: "length, tilt and roll of the rod of",
    RemedyKind.SPIN: "spin of the tool of",
    RemedyKind.FREE_SPIN: "free spin of the tool of",
    RemedyKind.WEIGHTS: "joint weights of",
    RemedyKind.BRANCH: "start branch of",
    RemedyKind.PATH: "joint path of",
    RemedyKind.DURATION: "longer cycle",
}
CONTINUOUS: Final = frozenset(
    {RemedyKind.LAYOUT, RemedyKind.SPIN, RemedyKind.WEIGHTS, RemedyKind.PATH, RemedyKind.TOOL}
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """What may change at once, as plain data."""

    kind: RemedyKind  # what changes
    robots: tuple[str, ...]  # of which robots
    addresses: tuple[str, ...] = ()  # numbers that may change, of those that the cell lets a layout search change
    vary: Mapping[str, Any] = field(default_factory=dict)  # in place of them: entries as of ``layout.vary``
    values: Mapping[str, Any] = field(default_factory=dict)  # in place of both: values by address

    @property
    def text(self) -> str:
        """What may change, in words."""
        names = listed_names(self.robots)
        if self.kind is RemedyKind.LAYOUT:
            what = listed_names(list(dict.fromkeys(map(_what, self.addresses))))
            return "place of the part at rest" if self.robots == (PART,) else f"{what} of {names}"
        if self.kind is RemedyKind.STEP:
            return f"rows every {self.values['motion.step_s']:g} s"
        if self.kind is RemedyKind.METHOD:
            return f"method {self.values['solver.method']}"
        return f"{WORDS[self.kind]} {names}".rstrip()


def listed_names(names: Sequence[str]) -> str:
    """Names in a sentence."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def owners(cell: Cell, settings: LayoutSettings) -> dict[str, tuple[str, ...]]:
    """Addresses of what may change, by the robot that it belongs to, in the order of the cell."""
    owners: dict[str, list[str]] = {}
    for variable in settings.ranges:
        owners.setdefault(_owner(cell, variable), []).append(variable.address)
    names = [*(robot.name for robot in cell.robots), PART]
    return {name: tuple(owners[name]) for name in names if name in owners}


def of_layout(cell: Cell, settings: LayoutSettings, size: int) -> Iterator[Attempt]:
    """Attempts with all that may change of so many robots; what is tied to others changes with all of them only."""
    owned, groups = owners(cell, settings), tied(settings)
    for names in islice(combinations(owned, size), MOST_SUBSETS):
        together = {address for name in names for address in owned[name]}
        while broken := {address for group in groups if not together.issuperset(group) for address in group} & together:
            together -= broken
        addresses = tuple(address for name in names for address in owned[name] if address in together)
        if addresses:
            yield Attempt(kind=RemedyKind.LAYOUT, robots=names, addresses=addresses)


def of_tools(cell: Cell, settings: LayoutSettings) -> Iterator[Attempt]:
    """Attempts with the rod or the spin of one tool at work that no layout search may change."""
    known = {(variable.kind, variable.name) for variable in settings.ranges}
    for task in cell.tasks:
        rod, robots = cell.robot(task.robot).tool.rod, (task.robot,)
        is_alone = sum(other.robot == task.robot for other in cell.tasks) == 1
        if rod is not None and is_alone and (VariableKind.TOOL, task.robot) not in known:
            yield Attempt(kind=RemedyKind.TOOL, robots=robots, vary={f"{task.robot}.tool": _rod_ranges(rod)})
        if task.is_spin_free:
            continue
        if is_alone and (VariableKind.SPIN, task.name) not in known:
            yield Attempt(kind=RemedyKind.SPIN, robots=robots, vary={f"tasks.{task.name}.spin_deg": True})
        yield Attempt(kind=RemedyKind.FREE_SPIN, robots=robots, values={f"tasks.{task.name}.free": ["spin"]})


def of_branches(cell: Cell) -> Iterator[Attempt]:
    """Attempts with the start posture of one operator sought anew."""
    document: Any = cell.origin.document["robots"]
    for robot in cell.robots:
        if robot.start is not None and any(task.robot == robot.name for task in cell.tasks):
            key = "start" if "start" in document[robot.name] else "start_deg"
            yield Attempt(kind=RemedyKind.BRANCH, robots=(robot.name,), values={f"robots.{robot.name}.{key}": "auto"})


def of_far_starts(robots: Iterable[str]) -> list[Attempt]:
    """The attempt with the starts sought anew of robots that begin too far off their tasks; none without any."""
    names = tuple(dict.fromkeys(robots))
    return [Attempt(kind=RemedyKind.BRANCH, robots=names)] if names else []


def of_weights(cell: Cell, settings: LayoutSettings) -> Iterator[Attempt]:
    """Attempts with the joint weights of one robot at work that no layout search may change."""
    known = {variable.name for variable in settings.ranges if variable.kind is VariableKind.WEIGHT}
    working = {*cell.positioners, *(task.robot for task in cell.tasks)}
    for robot in cell.robots:
        if robot.name in working - known:
            yield Attempt(kind=RemedyKind.WEIGHTS, robots=(robot.name,), vary={f"{robot.name}.weights": True})


def of_paths(cell: Cell) -> Iterator[Attempt]:
    """Attempts with the joint path of the positioner, where it may change."""
    for path in () if cell.layout is None else cell.layout.paths:
        vary = {f"{path.robot}.path": {"coefficients": path.coefficients, "degree": path.degree}}
        yield Attempt(kind=RemedyKind.PATH, robots=(path.robot,), vary=vary)


def tied(settings: LayoutSettings) -> list[tuple[str, ...]]:
    """Groups of addresses that change together."""
    bases = [variable for variable in settings.ranges if variable.kind is VariableKind.BASE]
    mirrored = [
        tuple(base.address for base in bases if base.name in pair.robots and base.index == index)
        for pair in settings.mirrored
        for index in range(6)
    ]
    return [*settings.equal, *(group for group in mirrored if len(group) > 1)]


def _owner(cell: Cell, variable: VaryRange) -> str:
    """The robot that a number belongs to."""
    match variable.kind:
        case VariableKind.SPIN:
            return cell.task(variable.name).robot
        case VariableKind.PART:
            return PART
        case _:
            return variable.name


def _rod_ranges(rod: Rod) -> dict[str, list[float]]:
    length = MM * rod.length
    shortest = max(SHORTER * length, LEAST_MORE * MM * rod.shortest)
    tilt = max(MOST_TILT, DEG * abs(rod.tilt))
    return {
        "length_mm": [round(min(shortest, length), 3), round(LONGER * length, 3)],
        "tilt_deg": [round(min(0.0, DEG * rod.tilt), 6), round(tilt, 6)],
        "roll_deg": [round(DEG * rod.roll - 180.0, 6), round(DEG * rod.roll + 180.0, 6)],
    }


def _what(address: str) -> str:
    """What an address is about, in words."""
    words = {"base": "base", "tool": "rod", "weights": "joint weights", "spin_deg": "spin", "at": "grasp"}
    parts = address.replace("[", ".").split(".")
    return next((words[part] for part in parts if part in words), "start posture")
