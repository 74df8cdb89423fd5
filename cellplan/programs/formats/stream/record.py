"""What stands beside a stream: its controller, axes and cycle, and what the written numbers demand of the robot."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame
from cellplan.model.robot.robot import Joint
from cellplan.model.settings.controllers import ControllerEntry
from cellplan.programs.elements.joints import Axes, require_counted
from cellplan.programs.elements.json_tree import Raw, Written
from cellplan.programs.elements.text import fixed
from cellplan.programs.elements.timed_rows import cycle_of

SCHEMA: Final = "cellplan.stream/1"
DECIMALS: Final = 6  # of a degree or millimetre
MICRO: Final = 1_000_000  # [us/s] times and cycles are whole microseconds
LAGGING: Final = frozenset({"abb", "ur"})  # EGM and servoj follow a stream with a filter
FREE: Final = ("notes",)
FIGURES: Final = 6  # decimals of the figures


class StreamAxis(NamedTuple):
    """One column of positions."""

    name: str  # name of the axis on the controller: ``A1`` to ``A6`` of an arm, ``E1`` and so on of all others
    place: int  # place of its joint in the model
    joint: Joint

    @property
    def column(self) -> str:
        """Name of the column."""
        return f"{self.name}_{self.joint.display_unit.name}"


def stream_axes(robot: Robot) -> tuple[StreamAxis, ...]:
    """Axes of a robot in the order of the columns: those of the arm, then the external ones."""
    axes, joints = Axes.of(robot), robot.model.joints
    arm = (StreamAxis(f"A{number}", place, joints[place]) for number, place in enumerate(axes.arm, start=1))
    external = (StreamAxis(f"E{number}", place, joints[place]) for number, place in enumerate(axes.external, start=1))
    return (*arm, *external)


def whole_cycle(robot: Robot) -> int:
    """Cycle of a robot's controller, which is a whole number of microseconds."""
    cycle = cycle_of(robot) * MICRO
    if cycle < 0.5 or abs(cycle - round(cycle)) > 1e-6 * cycle:
        raise InputError(
            f"robots.{robot.name}.controller.cycle_ms: expected whole microseconds, so that every row is at k times "
            f"the cycle, got {cycle / 1000.0:.9g}"
        )
    return round(cycle)


def stream_record(
    frame: ExportFrame,
    program: str | None,
    robot: str,
    *,
    quanta: NDArray[np.int64],
    digest: str,
    notes: Sequence[str] = (),
) -> dict[str, Written]:
    """The record beside a stream with this SHA-256.

    Quanta are written positions as whole numbers of the last decimal, in the order of the columns, shape (N, n).
    ``InputError`` where latency or counting is needed and not stated.
    """
    placed = frame.robot(robot)
    cycle, zero = whole_cycle(placed), placed.model.controller
    controller = stated_controller(frame, placed)
    return {
        "schema": SCHEMA,
        "cell": frame.cell.name,
        "program": program,
        "robot": robot,
        "model": placed.model.name,
        "controller": None if placed.control is None else placed.control.id,
        "kind": None if controller is None else controller.kind,
        "latency_ms": None
        if controller is None or controller.latency_ms is None
        else Raw(fixed(controller.latency_ms, 3)),
        "promise": str(frame.promise),
        "notes": list(notes),
        "file": f"{robot}.csv",
        "sha256": digest,
        "cycle_ms": Raw(fixed(cycle / 1000.0, 3)),
        "rows": Raw(len(quanta)),
        "end_s": Raw(fixed((len(quanta) - 1) * cycle / MICRO, 6)),
        "zero": "that of the model; the controller's is not stated" if zero is None else "that of the controller",
        "source_of_zero": None if zero is None else zero.source,
        "axes": [
            _axis_record(axis, quanta[:, column], decimals=DECIMALS, cycle=cycle)
            for column, axis in enumerate(stream_axes(placed))
        ],
    }


def stated_controller(frame: ExportFrame, robot: Robot) -> ControllerEntry | None:
    """The controller of a robot; None when none is stated; ``InputError`` where it needs what is not stated."""
    if robot.control is None:
        return None
    controller = frame.cell.controllers[robot.control.id]
    if controller.kind in LAGGING and controller.latency_ms is None:
        raise InputError(
            f"controllers.{robot.control.id}.latency_ms: expected the time by which its robots follow a stream, as "
            f"controllers of kind {controller.kind} filter it, got none"
        )
    require_counted(robot, controller.kind)
    return controller


def _axis_record(axis: StreamAxis, quanta: NDArray[np.int64], *, decimals: int, cycle: int) -> dict[str, Written]:
    """Start, range and peaks of one column, all of them of the written numbers."""
    tick, seconds, start = 10.0**-decimals, cycle / MICRO, int(quanta[0])
    largest = [int(np.abs(np.diff(quanta, n=order)).max(initial=0)) for order in (1, 2, 3)]
    peaks = [change * tick / seconds**order for order, change in enumerate(largest, start=1)]
    return {
        "axis": axis.name,
        "joint": axis.joint.name,
        "unit": axis.joint.display_unit.name,
        "start": Raw(fixed(start * tick, decimals)),
        "lowest_from_start": Raw(fixed((int(quanta.min()) - start) * tick, decimals)),
        "highest_from_start": Raw(fixed((int(quanta.max()) - start) * tick, decimals)),
        "peak_per_s": Raw(fixed(peaks[0], FIGURES)),
        "peak_per_s2": Raw(fixed(peaks[1], FIGURES)),
        "peak_per_s3": Raw(fixed(peaks[2], FIGURES)),
    }
