"""Variables of a live cell: which of its numbers may be changed, and what they do to a candidate for the kernel."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from numbers import Real
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.findings import shown
from cellplan.geometry.arrays import Array
from cellplan.jobs.repair.neat import written_at
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.cell.layout import LayoutSettings, VariableKind, VaryRange
from cellplan.model.cell.mounting import Hanger, Pedestal
from cellplan.model.robot.robot import start_keys
from cellplan.model.units import DEG, MM
from cellplan.search.variables.pedestals import MOST_LEAN, leaving_columns
from cellplan.search.variables.state import State
from cellplan.search.variables.ties import Tied
from cellplan.search.variables.variables import Variables
from cellplan.search.variables.written import written_number
from cellplan.session.ties import Ties

POSE: Final = ("x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg")
LEANING: Final = (3, 4)  # places of its roll and pitch
ROD: Final = ("length_mm", "tilt_deg", "roll_deg")
FAR: Final = 5.0  # [m] to either side of a position without a range of its cell
TURN: Final = 2.0 * np.pi  # [rad] to either side of an angle likewise
LONGEST_ROD: Final = 2.0  # [m]
SHORTEST_ROD: Final = 0.001  # [m] of a rod between its round ends
MOST_TILT: Final = np.radians(170.0)  # [rad] of a rod
NAMES: Final = {VariableKind.GRASP: "part", VariableKind.PART: "part"}  # in kinds and labels; others by their own name


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """A number at an address of the cell file, in file units."""

    address: str  # as ``--set`` takes it
    label: str  # what a person calls it
    kind: str  # base_x, tool_length, obstacle_yaw, …
    subject: str  # robot, obstacle or part that it belongs to
    unit: str  # mm or deg
    given: float  # value in the file
    lower: float  # least value that is accepted
    upper: float  # greatest one
    is_locked: bool = False  # whether ``layout.fixed`` of the cell names it
    is_varied: bool = False  # whether ``layout.vary`` of the cell states its range

    def accepted(self, value: object) -> float:
        """A value that may stand there; others are refused.

        Raises:
            InputError: The variable is locked, or the value is no finite number or out of its range.
        """
        if self.is_locked:
            raise InputError(f"{self.address}: is locked by layout.fixed of the cell; take it out there")
        is_number = isinstance(value, Real) and not isinstance(value, bool)
        number = float(value) if isinstance(value, Real) and is_number else math.nan
        if not self.lower <= number <= self.upper:
            expected = f"a number from {self.lower:g} to {self.upper:g} {self.unit}"
            raise InputError(f"{self.address}: expected {expected}, got {f'{number:g}' if is_number else shown(value)}")
        return number

    def record(self, *, value: float) -> dict[str, Any]:
        """The variable with its present value, for pages."""
        return {**asdict(self), "value": value}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LiveVariables:
    """All numbers that may be changed: those of the layout, which the kernel knows, and those of obstacles."""

    listed: tuple[Variable, ...]  # in file units, those of the layout first
    layout: Variables  # the same numbers in [m] and [rad], without those of obstacles
    ties: Ties  # which of them follow each other

    @classmethod
    def of(cls, cell: Cell) -> "LiveVariables":
        """Those of a cell that was read from a file."""
        state = State.given(cell)
        ranges = [it for it in _ranges(cell) if np.isfinite(state.numbers(cell, [it])[0])]
        numbers = state.numbers(cell, ranges).tolist()
        ranges = [replace(it, given=number) for it, number in zip(ranges, numbers, strict=True)]
        stated = {} if cell.layout is None or cell.layout.is_default else {it.address: it for it in cell.layout.ranges}
        ties = Ties.of(cell)
        bounded = leaving_columns(cell, [ties.narrowed(_bounded(cell, it, stated)) for it in ranges])
        listed = [_listed(cell, it, is_varied=it.address in stated) for it in bounded]
        return cls(listed=(*listed, *_of_obstacles(cell)), layout=_layout_variables(cell, bounded), ties=ties)

    def at(self, address: str) -> Variable | None:
        """The variable at an address; None where it is not listed."""
        return next((it for it in self.listed if it.address == address), None)

    def variable(self, address: str) -> Variable:
        """The variable at an address.

        Raises:
            InputError: There is none.
        """
        if (variable := self.at(address)) is None:
            raise InputError(f"{address}: expected the address of a number that may be changed, got another one")
        return variable

    def accepted(self, values: Mapping[str, object]) -> dict[str, float]:
        """New values in file units by address, with those of the numbers that follow them; others are refused.

        Raises:
            InputError: An address is not that of a variable, it is locked, or a value is no number of its range.
        """
        accepted = {address: self.variable(address).accepted(value) for address, value in values.items()}
        for address, value in [*accepted.items()]:
            for follower in self.ties.followers(address):
                other, scale = follower.variable, DEG if follower.variable.is_angle else MM
                if other.address not in values and (listed := self.at(other.address)) is not None:
                    accepted[other.address] = listed.accepted(written_number(other, follower.value(value / scale)))
        return accepted

    def written(self, cell: Cell) -> dict[str, float]:
        """Values in file units of a changed cell by address, as far as they are others than here."""
        at = {it: written_at(cell.origin.document, it.address) for it in self.listed}
        return {it.address: float(value) for it, value in at.items() if value not in (None, it.given)}

    def numbers(self, values: Mapping[str, float]) -> Array:
        """The variables of the layout in [m] and [rad], as given where no value in file units is, shape (n,)."""
        x = self.layout.given.copy()
        for place, variable in enumerate(self.layout.tied.ranges):
            if variable.address in values:
                x[place] = values[variable.address] / (DEG if variable.is_angle else MM)
        return x

    def on(self, cell: Cell) -> "LiveVariables":
        """The same in a cell that differs by its obstacles."""
        return replace(self, layout=_layout_variables(cell, self.layout.tied.ranges))

    def is_of_obstacle(self, address: str) -> bool:
        """Whether an address is that of an obstacle."""
        return address not in self.layout.names


def _layout_variables(cell: Cell, ranges: Sequence[VaryRange]) -> Variables:
    """The variables of a search; obstacles below bases stay obstacles, unlike those of a search."""
    settings = LayoutSettings(ranges=tuple(ranges))
    tied = Tied.of(settings)
    return Variables(
        base=cell,
        names=tied.names,
        lower=tied.lower,
        upper=tied.upper,
        given=np.array([it.given for it in ranges]),
        scale=tied.scale,
        cost=tied.cost,
        margin=np.zeros(cell.joint_count),
        remarks=(),
        settings=settings,
        tied=tied,
        given_cell=cell,
        given_state=State.given(cell),
        conversion={},
    )


def _ranges(cell: Cell) -> Iterator[VaryRange]:
    """All numbers of the layout, without bounds and values."""
    for robot in cell.robots:
        yield from _numbers(f"robots.{robot.name}.base", POSE, VariableKind.BASE, robot.name)
        if robot.tool.rod is not None:
            yield from _numbers(f"robots.{robot.name}.tool.rod", ROD, VariableKind.TOOL, robot.name)
    for place, grasp in enumerate(cell.part.held_by):
        yield from _numbers(f"part.held_by[{place}].at", POSE, VariableKind.GRASP, grasp.robot)
    if not cell.part.held_by:
        yield from _numbers("part.at", POSE, VariableKind.PART, "")
    for name in cell.positioners[:1]:
        yield from _of_start(cell, cell.robot(name))


def _numbers(group: str, keys: Sequence[str], kind: VariableKind, name: str) -> Iterator[VaryRange]:
    for index, key in enumerate(keys):
        yield _open(f"{group}.{key}", kind, name, index, is_angle=key.endswith("_deg"))


def _of_start(cell: Cell, robot: Robot) -> Iterator[VaryRange]:
    """The start posture of a holder, where the file states it."""
    source: Any = cell.origin.source
    entry = source.document.root["robots"][robot.name]  # as it was written: a start may have a name
    joints = robot.model.joints
    if robot.path is not None or robot.start is None:
        return
    if isinstance(entry.get("start_deg"), tuple):
        addresses = [f"robots.{robot.name}.start_deg[{index}]" for index in range(len(joints))]
    elif isinstance(entry.get("start"), Mapping):
        addresses = [f"robots.{robot.name}.start.{key}" for key in start_keys(robot.model)]
    else:
        return
    for index, (address, joint) in enumerate(zip(addresses, joints, strict=True)):
        yield _open(address, VariableKind.START, robot.name, index, is_angle=joint.is_revolute)


def _open(address: str, kind: VariableKind, name: str, index: int, *, is_angle: bool) -> VaryRange:
    return VaryRange(
        address=address, kind=kind, name=name, index=index, is_angle=is_angle, lower=-np.inf, upper=np.inf, given=None
    )


def _bounded(cell: Cell, variable: VaryRange, stated: Mapping[str, VaryRange]) -> VaryRange:
    """A number with the bounds that the cell states, else with wide ones; its value is within them."""
    given = variable.given or 0.0
    if (it := stated.get(variable.address)) is not None:
        lower, upper = it.lower, it.upper
    elif variable.kind is VariableKind.START:
        joint = cell.robot(variable.name).model.joints[variable.index]
        lower, upper = max(joint.lower, given - TURN), min(joint.upper, given + TURN)
    elif variable.kind is VariableKind.TOOL and variable.index < 2:
        lower, upper = (0.0, LONGEST_ROD) if variable.index == 0 else (-MOST_TILT, MOST_TILT)
    elif _is_tilt(variable) and isinstance(cell.robot(variable.name).pedestal, Pedestal | Hanger):
        level = np.pi * np.round(given / np.pi)  # upright, or upside down
        lower, upper = level - MOST_LEAN, level + MOST_LEAN
    else:
        wide = TURN if variable.is_angle else FAR
        lower, upper = given - wide, given + wide
    rod = cell.robot(variable.name).tool.rod if variable.kind is VariableKind.TOOL else None
    if rod is not None and variable.index == 0:
        lower = max(lower, rod.shortest + SHORTEST_ROD)
    return replace(variable, lower=min(lower, given), upper=max(upper, given))


def _is_tilt(variable: VaryRange) -> bool:
    """Whether a number leans a base."""
    return variable.kind is VariableKind.BASE and variable.index in LEANING


def _listed(cell: Cell, variable: VaryRange, *, is_varied: bool) -> Variable:
    """A number of the layout in file units."""
    what = NAMES.get(variable.kind, str(variable.kind))
    if variable.kind is VariableKind.START:
        component, kind = cell.robot(variable.name).model.joint_names[variable.index], "start"
    else:
        component = (ROD if variable.kind is VariableKind.TOOL else POSE)[variable.index].rpartition("_")[0]
        kind = f"{what}_{component}"
    subject = variable.name if what != "part" else "part"
    owner = variable.name if what != "part" or len(cell.positioners) > 1 else ""
    return Variable(
        address=variable.address,
        label=f"{owner} {what} {component}".strip(),
        kind=kind,
        subject=subject,
        unit="deg" if variable.is_angle else "mm",
        given=written_number(variable, float(variable.given or 0.0)),
        lower=written_number(variable, variable.lower),
        upper=written_number(variable, variable.upper),
        is_locked=_is_locked(cell, variable.address),
        is_varied=is_varied,
    )


def _of_obstacles(cell: Cell) -> Iterator[Variable]:
    """Position and heading of every obstacle that has a pose."""
    document: Any = cell.origin.document
    for name, entry in document["environment"].items():
        if entry.get("plane") is not None:
            continue
        at = entry.get("at") or {"xyz_mm": (0.0, 0.0, 0.0), "rpy_deg": (0.0, 0.0, 0.0)}
        for key, value in zip(POSE, (*at["xyz_mm"], *at["rpy_deg"]), strict=True):
            component, unit = key.rsplit("_", 1)
            wide = DEG * TURN if unit == "deg" else MM * FAR
            if component not in {"roll", "pitch"}:
                yield Variable(
                    address=f"environment.{name}.at.{key}",
                    label=f"{name} {component}",
                    kind=f"obstacle_{component}",
                    subject=name,
                    unit=unit,
                    given=float(value),
                    lower=float(value) - wide,
                    upper=float(value) + wide,
                    is_locked=False,
                )


def _is_locked(cell: Cell, address: str) -> bool:
    """Whether the layout of the cell fixes a number, by its own address or that of its group."""
    document: Any = cell.origin.document
    fixed = (document.get("layout") or {}).get("fixed", ())
    names = {key if key.startswith(("robots.", "tasks.", "part.")) else f"robots.{key}" for key in fixed}
    names |= {name.replace(".tool", ".tool.rod", 1) for name in names if ".tool.rod" not in name}
    return any(address == name or address.startswith((f"{name}.", f"{name}[")) for name in names)
