"""From the numbers of a cell file that may change to the variables of a search: equal and mirrored ones are one."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.cell.layout import LayoutSettings, VariableKind, VaryRange, mirror_image

USUAL_LENGTH: Final = 0.1  # [m] of a step, and of a change that costs 1
USUAL_ANGLE: Final = math.radians(10.0)  # [rad] likewise
COSTLY_FACTOR: Final = math.log(10.0)  # [-] logarithm of the factor of a weight that costs 1
USUAL_FACTOR: Final = math.log(1.5)  # [-] logarithm of the factor of a weight that is a step
STEPS: Final = 4.0  # [-] steps that a range has at least
FULL_TURN: Final = 2.0 * math.pi
TURN_TOL: Final = 1e-9  # [rad] by which a range of a full turn may be short of it: rounding


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tied:
    """The variables, n of them, and the m numbers that follow from them: ``numbers = factors x + terms``.

    Numbers and variables are in [m] and [rad]; of a weight they are the natural logarithm.
    """

    ranges: tuple[VaryRange, ...]  # the numbers
    factors: Array  # shape (m, n), one entry of 1 or -1 in each row
    terms: Array  # shape (m,)
    names: tuple[str, ...]  # address of the first number that each variable stands for
    lower: Array  # lowest values, shape (n,)
    upper: Array  # highest values, shape (n,)
    given: Array  # values in the file, brought into the bounds, shape (n,)
    scale: Array  # usual steps, shape (n,)
    cost: Array  # costs of a change by one unit, shape (n,)
    remarks: tuple[str, ...]  # what was brought into its bounds

    @classmethod
    def of(cls, settings: LayoutSettings) -> "Tied":
        """Those of a layout."""
        ranges = settings.ranges
        led = _leaders(settings)
        leaders = [variable.address for variable in ranges if led[variable.address][0] == variable.address]
        factors, terms = np.zeros((len(ranges), len(leaders))), np.zeros(len(ranges))
        lower, upper = np.full(len(leaders), -np.inf), np.full(len(leaders), np.inf)
        cost, scale, given = np.zeros(len(leaders)), np.zeros(len(leaders)), np.zeros(len(leaders))
        remarks = list[str]()
        for row, variable in enumerate(ranges):
            leader, factor, term = led[variable.address]
            column = leaders.index(leader)
            factors[row, column], terms[row] = factor, term
            low, high = number_of(variable, variable.lower), number_of(variable, variable.upper)
            if leader == variable.address or not _is_full_turn(variable):
                ends = sorted(((low - term) / factor, (high - term) / factor))
                lower[column], upper[column] = max(lower[column], ends[0]), min(upper[column], ends[1])
            cost[column] += settings.cost.get(variable.address, 1.0) / _costly(variable)
        for column, address in enumerate(leaders):
            variable = next(it for it in ranges if it.address == address)
            scale[column] = min(_usual(variable), (upper[column] - lower[column]) / STEPS)
            given[column], remark = _brought_in(variable, float(lower[column]), float(upper[column]))
            remarks += [remark] if remark else []
        return cls(
            ranges=ranges,
            factors=factors,
            terms=terms,
            names=tuple(leaders),
            lower=lower,
            upper=upper,
            given=given,
            scale=scale,
            cost=cost,
            remarks=tuple(remarks),
        )

    def values(self, numbers: Array) -> Array:
        """Variables with given numbers, brought into their bounds; as in the file where a number is NaN, shape (n,)."""
        values = self.given.copy()
        for row, variable in enumerate(self.ranges):
            if variable.address in self.names and np.isfinite(numbers[row]):
                column = self.names.index(variable.address)
                lower, upper = float(self.lower[column]), float(self.upper[column])
                values[column] = min(max(into_turn(variable, float(numbers[row]), lower, upper), lower), upper)
        return values


def number_of(variable: VaryRange, value: float) -> float:
    """A number of the file as a variable has it: the logarithm of a weight, all others as they are."""
    return math.log(value) if variable.kind is VariableKind.WEIGHT else value


def into_turn(variable: VaryRange, value: float, lower: float, upper: float) -> float:
    """An angle of a pose or a tool, by whole turns between bounds where that is possible; others as they are."""
    if not variable.is_angle or variable.kind is VariableKind.START or lower <= value <= upper:
        return value
    moved = value + FULL_TURN * math.ceil((lower - TURN_TOL - value) / FULL_TURN)
    return moved if moved <= upper + TURN_TOL else value


def _leaders(settings: LayoutSettings) -> dict[str, tuple[str, float, float]]:
    """The number that each one follows, with a factor and a term; itself for those that follow none."""
    led = {variable.address: (variable.address, 1.0, 0.0) for variable in settings.ranges}
    for members in settings.equal:
        led |= dict.fromkeys(members, (members[0], 1.0, 0.0))
    bases = {
        (variable.name, variable.index): variable.address
        for variable in settings.ranges
        if variable.kind is VariableKind.BASE
    }
    for pair in settings.mirrored:
        for index in range(6):
            first, second = (bases.get((robot, index)) for robot in pair.robots)
            if first is None or second is None:
                continue
            factor, term = mirror_image(pair, index)
            leader, slope, shift = led[first]
            led[second] = (leader, factor * slope, factor * shift + term)
    return led


def _is_full_turn(variable: VaryRange) -> bool:
    """Whether a range holds every direction, so that it bounds nothing."""
    is_turning = variable.is_angle and variable.kind is not VariableKind.START
    return is_turning and variable.upper - variable.lower >= FULL_TURN - TURN_TOL


def _usual(variable: VaryRange) -> float:
    if variable.kind is VariableKind.WEIGHT:
        return USUAL_FACTOR
    return USUAL_ANGLE if variable.is_angle else USUAL_LENGTH


def _costly(variable: VaryRange) -> float:
    """A change that costs 1 unless the file says otherwise."""
    return COSTLY_FACTOR if variable.kind is VariableKind.WEIGHT else _usual(variable)


def _brought_in(variable: VaryRange, lower: float, upper: float) -> tuple[float, str | None]:
    """The value in the file between its bounds, and what there is to say about it."""
    if variable.given is None:
        return 0.5 * (lower + upper), None
    value = into_turn(variable, number_of(variable, variable.given), lower, upper)
    inside = min(max(value, lower), upper)
    if abs(inside - value) <= TURN_TOL:
        return inside, None
    if variable.kind is VariableKind.WEIGHT:
        shown = [f"{math.exp(number):g}" for number in (value, lower, upper)]
    else:
        unit, scale = ("deg", math.degrees(1.0)) if variable.is_angle else ("mm", 1000.0)
        shown = [f"{number * scale:.6g} {unit}" for number in (value, lower, upper)]
    end = shown[1] if value < lower else shown[2]
    return (
        inside,
        f"{variable.address}: {shown[0]} is outside its range {shown[1]} to {shown[2]}: the search starts at {end}",
    )
