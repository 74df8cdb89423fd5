"""Limits of a joint: those of its model, which a cell may tighten or supply, never widen; one rule for all models."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from cellplan.files.input.findings import shown
from cellplan.model.robot.robot import Joint
from cellplan.model.units import joint_unit

LIMIT_TOL: Final = 1e-9  # [rad], [m] and their rates: a number of degrees need not read back to the last bit
SHOWN_DECIMALS: Final = 6  # of degrees or millimetres in a message
# limits by name, with the ending of the unit; that of a torque is one of its own
RATES: Final = {"lower": "", "upper": "", "velocity": "_s", "acceleration": "_s2", "jerk": "_s3", "torque": ""}


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedLimits:
    """Limits of one joint as far as a file states them, in [rad] or [m] and their rates; None where it does not."""

    lower: float | None = None  # lowest position
    upper: float | None = None  # highest position
    velocity: float | None = None  # largest velocity
    acceleration: float | None = None  # largest acceleration
    jerk: float | None = None  # largest jerk
    torque: float | None = None  # largest torque in [N m] or force in [N]
    wraps: bool = False  # whether a continuous joint may turn without end


def limits_of(joint: Joint) -> StatedLimits:
    """The limits of a joint of a model."""
    return StatedLimits(**rates_of(joint))


def rates_of(limited: object) -> dict[str, Any]:
    """Limits of something that has them, by name, as they stand in a joint."""
    return {name: getattr(limited, name) for name in RATES}


def tightest(limits: StatedLimits, cell: StatedLimits) -> StatedLimits:
    """The tighter of both limits of each kind, or the only one that is stated."""
    tighter: dict[str, Any] = {}
    for name in RATES:
        stated = [value for value in (getattr(limits, name), getattr(cell, name)) if value is not None]
        tighter[name] = (max if name == "lower" else min)(stated, default=None)
    return StatedLimits(**tighter)


def limit_findings(limits: StatedLimits, cell: StatedLimits, *, is_revolute: bool) -> Iterator[tuple[str, str]]:
    """Limits of a cell that are wider than those of the model or leave no range, by key of the cell file."""
    unit = joint_unit(is_revolute=is_revolute)

    def text(value: float, scale: float = unit.scale) -> str:
        """A value in the unit of the cell file."""
        return shown(round(value * scale, SHOWN_DECIMALS))

    for name, rate in RATES.items():
        scale = 1.0 if name == "torque" else unit.scale
        limit, value = getattr(limits, name), getattr(cell, name)
        sign, bound = (-1.0, "least") if name == "lower" else (1.0, "most")
        if limit is not None and value is not None and sign * (value - limit) > LIMIT_TOL:
            yield (
                _torque_key(is_revolute=is_revolute) if name == "torque" else f"{name}_{unit.name}{rate}",
                f"expected at {bound} {text(limit, scale)}, the limit of the model, got {text(value, scale)}",
            )
    lower = limits.lower if cell.lower is None else cell.lower
    upper = limits.upper if cell.upper is None else cell.upper
    if lower is not None and upper is not None and not lower < upper:
        key = "lower" if cell.upper is None else "upper"
        yield f"{key}_{unit.name}", f"expected a lower limit below the upper one, got {text(lower)} and {text(upper)}"


def _torque_key(*, is_revolute: bool) -> str:
    return "torque_nm" if is_revolute else "force_n"
