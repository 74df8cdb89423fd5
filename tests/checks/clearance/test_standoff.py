"""Distance of tool tips from the part along their paths: to the nearest point, along the axis, stated or not."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import work
from builders.tool_over_part import DOWN, PEN, tool_over_part

from cellplan.checks.clearance.tool_depth import check_standoffs
from cellplan.geometry.shapes import Box, Solid
from cellplan.geometry.transforms import pose
from cellplan.measures.standoff import standoff_on, standoffs
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.report.report import Check, Standoff
from cellplan.model.settings.task import ProcessEntry, ToleranceEntry
from cellplan.model.task.task import Frame, OffPart, Task
from cellplan.report.record.sections.rests_on import unstated_standoffs
from cellplan.scene.kinematics.screw_chain import ScrewChain

PLATE = Box((0.2, 0.2, 0.02))
WELD = ProcessEntry(feed_mm_s=10.0)


def cell_with(part: Solid, **task: object) -> Cell:
    tolerance = ToleranceEntry(position_mm=0.1, orientation_deg=np.degrees(1e-3))
    return tool_over_part(PEN, part, replace(work("gun"), tolerance=tolerance, **task))


def judged(
    points: Sequence[Sequence[float]], part: Solid = PLATE, *, rpy: tuple[float, float, float] = DOWN, **task: object
) -> tuple[Standoff, list[Check]]:
    """What is said of a tip that passes these points."""
    cell = cell_with(part, **task)
    X_PT = np.array([pose((x, y, z), rpy) for x, y, z in points])
    standoff = standoff_on(cell, cell.tasks[0], X_PT, times=np.arange(len(points), dtype=float))
    return standoff, check_standoffs(cell, [standoff])


def test_a_seam_in_the_air_fails_with_its_distances_and_the_keys() -> None:
    judgement, (check,) = judged([(x, 0.0, 0.07) for x in (0.0, 0.01, 0.02)], process=WELD)

    assert judgement.is_off
    assert not check.passed
    assert check.message == (
        "standoff of task 'work_of_gun': the tip is 60.0 mm from the part at 0.000 s, 60.0 mm along its axis; "
        "allowed 0 to 2 mm and its tolerance (no standoff_mm is stated): put the path on the part, state the distance "
        "of the process, or name where the tool may leave the part (off_part: [run_in, run_out, cut])"
    )


@pytest.mark.parametrize(("height", "passes"), [(0.0, True), (0.0019, True), (0.00205, True), (0.0023, False)])
def test_a_process_that_states_nothing_is_at_the_surface_within_two_millimetres_and_its_tolerance(
    height: float, *, passes: bool
) -> None:
    assert judged([(0.0, 0.0, 0.01 + height)], process=WELD)[1][0].passed is passes


def test_a_task_without_process_and_statement_is_only_named() -> None:
    judgement, checks = judged([(0.0, 0.0, 0.07)])

    assert not checks
    lines = unstated_standoffs(cell_with(PLATE), [judgement])
    assert lines == ["standoff_mm of work_of_gun (tip 60.0 mm off the part) not stated"]
    assert not unstated_standoffs(cell_with(PLATE), [judged([(0.0, 0.0, 0.01)])[0]])
    assert not unstated_standoffs(cell_with(PLATE, process=WELD), [judgement])


@pytest.mark.parametrize(
    ("height", "lean", "passes"),
    [(0.2, 0.0, True), (0.1, 0.0, False), (0.31, 0.0, False), (0.2, np.pi / 3, False), (0.13, np.pi / 6, True)],
)
def test_a_gun_keeps_its_distance_along_its_axis(height: float, lean: float, *, passes: bool) -> None:
    plate = Box((2.0, 2.0, 0.02))

    (check,) = judged([(0.0, 0.0, 0.01 + height)], plate, rpy=(np.pi + lean, 0.0, 0.0), standoff=(0.15, 0.3))[1]

    assert check.passed is passes
    assert check.value == pytest.approx(1e3 * height / np.cos(lean), abs=1e-6)


def test_a_stated_distance_of_zero_is_no_excuse_for_two_millimetres() -> None:
    _, (check,) = judged([(0.0, 0.0, 0.0115)], standoff=(0.0, 0.0))

    assert not check.passed
    assert "(standoff_mm = [0, 0])" in check.message
    assert judged([(0.0, 0.0, 0.01)], standoff=(0.0, 0.0))[1][0].passed


CUT = [(x, 0.0, 0.008) for x in (-0.12, -0.11, -0.09, 0.0, 0.09, 0.11, 0.12, 0.13)]


def test_run_in_and_run_out_are_excused_by_name_only() -> None:
    assert not judged(CUT, process=WELD)[1][0].passed
    assert not judged(CUT, process=WELD, off_part=(OffPart.RUN_IN,))[1][0].passed

    judgement, (check,) = judged(CUT, process=WELD, off_part=(OffPart.RUN_IN, OffPart.RUN_OUT))

    assert check.passed
    assert dict(judgement.excused) == pytest.approx({"run_in": 0.03, "run_out": 0.02})
    assert check.message.endswith("; excused: run_in over 30.0 mm, run_out over 20.0 mm")


def test_a_cut_that_leaves_the_part_is_excused_by_name_only() -> None:
    hop = [(0.0, 0.0, 0.01), (0.01, 0.0, 0.05), (0.02, 0.0, 0.05), (0.03, 0.0, 0.01)]

    assert not judged(hop, process=WELD, off_part=(OffPart.RUN_IN, OffPart.RUN_OUT))[1][0].passed
    assert judged(hop, process=WELD, off_part=(OffPart.CUT,))[1][0].passed


def test_no_name_excuses_a_path_that_is_nowhere_at_the_part() -> None:
    points = [(x, 0.0, 0.07) for x in (0.0, 0.01, 0.02)]

    judgement, (check,) = judged(points, process=WELD, off_part=tuple(OffPart))

    assert not check.passed
    assert not judgement.excused


def test_written_rows_count_from_the_start_of_the_path_to_its_end() -> None:
    cell = cell_with(PLATE, process=WELD, start=1.0)
    q = np.array([0.09, 0.01, 0.01, 0.09])[:, None]  # away, on the path, away
    times = np.array([0.0, 1.0, 2.0, 3.0])

    def standoff(task: Task) -> tuple[Standoff, ...]:
        scheduled = TaskSchedule(
            task=task,
            X_PT=np.broadcast_to(np.eye(4), (4, 4, 4)),
            V_PT_P=np.zeros((4, 6)),
            travelled=np.zeros(4),
            length=1.0,
            end=2.0,
        )
        chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
        return standoffs(cell, Schedule(times=times, tasks=(scheduled,)), chains, {"gun": q})

    (at_path,) = standoff(cell.tasks[0])
    (throughout,) = standoff(replace(cell.tasks[0], start=0.0))

    assert at_path.nearest == pytest.approx((0.0, 0.0), abs=1e-5)
    assert not at_path.is_off
    assert throughout.nearest[1] == pytest.approx(0.08, abs=1e-4)
    assert standoff(replace(cell.tasks[0], relative_to=Frame.WORLD)) == ()
