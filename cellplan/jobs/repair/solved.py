"""A motion solved and verified in full, as plain figures, and what it lacks of the demands of a repair."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.report.check_kinds import CHECK_KINDS, PASSED_BY_STEP
from cellplan.model.report.report import Check
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import check_record, number
from cellplan.runs.solution import Solution

MORE_ERROR: Final = 1.1  # [-] times the error that a shorter step is to mend
ROUNDING: Final = 1e-9  # [rad] or [m] by which a margin may be missed
MARGIN: Final = "joint_margin"  # a demanded margin among the checks


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolvedCell:
    """A solution measured against the demands of a repair."""

    solution: Solution
    margin: Array  # demanded distance of every joint from its limits in [rad] or [m], shape (nq,)

    @property
    def checks(self) -> list[Check]:
        """All checks that were made, with the phase of a program, and those of demanded margins."""
        made = [_of_phase(run.report.phase, check) for run in self.solution.runs for check in run.report.checks]
        return made + self._margin_checks()

    @property
    def failed(self) -> list[Check]:
        """Checks that failed; margin checks of joints already beyond a limit are left out."""
        checks = [check for check in self.checks if not check.passed]
        beyond = {check.subject for check in checks if check.name == "joint_position"}
        return [check for check in checks if check.name != MARGIN or check.subject not in beyond]

    @property
    def violations(self) -> Array:
        """What each joint lacks of its demanded margin in [rad] or [m], shape (nq,)."""
        return np.maximum(0.0, self.margin - self._margins)

    @property
    def _margins(self) -> Array:
        """Smallest distance of each joint from its limits in [rad] or [m], shape (nq,)."""
        return np.min([[use.margin for use in run.report.joints] for run in self.solution.runs], axis=0)

    @property
    def figures(self) -> dict[str, Any]:
        """Margins, checks, cycle and clearance for the record."""
        cell = self.solution.cell
        names = [f"{robot.name}/{joint}" for robot in cell.robots for joint in robot.model.joint_names]
        turning = np.array([joint.is_revolute for robot in cell.robots for joint in robot.model.joints])
        scale = np.where(turning, DEG, MM)
        margins, shown = self._margins, scale * self._margins
        smallest = number(float((DEG * margins[turning]).min())) if turning.any() else None
        return {
            "checks": [dict(check_record(check)) for check in self.checks],
            "failed": [dict(check_record(check)) for check in self.failed],
            "margins": {name: number(value) for name, value in zip(names, shown.tolist(), strict=True)},
            "units": {name: "deg" if is_turning else "mm" for name, is_turning in zip(names, turning, strict=True)},
            "cycle_s": number(float(self.solution.motion.times[-1])),
            "smallest_margin_deg": smallest,
            "smallest_clearance_mm": self._clearance,
        }

    @property
    def _clearance(self) -> float | None:
        """Smallest certified distance in [mm]; None without pairs."""
        reports = [run.report for run in self.solution.runs]
        distances = [minimum.minimum for report in reports for minimum in report.clearance.minima.values()]
        return number(MM * min((value for value in distances if value is not None), default=np.inf))

    def _margin_checks(self) -> list[Check]:
        """One check for each joint with a demanded margin, in the phase in which it leaves least."""
        checks = []
        for place, demanded in enumerate(self.margin.tolist()):
            uses = ((run.report.joints[place], run.report.phase) for run in self.solution.runs)
            use, phase = min(uses, key=lambda one: one[0].margin)
            if not demanded > 0.0 or not np.isfinite(use.margin):
                continue
            unit, scale = use.display_unit
            joint, value, limit = f"{use.robot}/{use.joint}", scale * use.margin, scale * demanded
            message = (
                f"joint {joint} stays {value:.4g} {unit} inside its limits, {limit:.4g} {unit} demanded, worst at "
                f"{use.margin_at_s:.3f} s"
            )
            passed = use.margin >= demanded - ROUNDING
            check = Check(MARGIN, joint, passed, message, value=value, limit=limit, unit=unit, at_s=use.margin_at_s)
            checks.append(_of_phase(phase, check))
        return checks


def _of_phase(phase: str | None, check: Check) -> Check:
    """A check that says in which phase it was made; None for the only one."""
    return check if phase is None else replace(check, message=f"{phase}: {check.message}")


def demanded_margin(cell: Cell) -> Array:
    """Demanded distance of every joint from its limits in [rad] or [m], shape (nq,)."""
    joints, settings = [joint for robot in cell.robots for joint in robot.model.joints], cell.layout
    if settings is None:
        return np.zeros(len(joints))
    return np.array([settings.margin if joint.is_revolute else settings.margin_sliding for joint in joints])


def required_time(failed: Iterable[Mapping[str, Any]]) -> float:
    """Factor on the duration that makes the failed checks, as records, pass, as far as a slower motion does that."""
    factors = (CHECK_KINDS[check["name"]].more_time(check["value"], check["limit"]) for check in failed)
    return max(factors, default=1.0)


def required_step(failed: Iterable[Mapping[str, Any]], step: float) -> float:
    """Time between rows in [s], halved until failed checks, as records, pass: the error grows with the step squared."""
    ratio = max((check["value"] / check["limit"] for check in failed if check["name"] in PASSED_BY_STEP), default=1.0)
    return step / 2.0 ** math.ceil(0.5 * math.log2(max(1.0, MORE_ERROR * ratio)))
