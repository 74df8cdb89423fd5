"""Tasks of a cell: every finding about them, word for word."""

from collections.abc import Callable
from pathlib import Path

import pytest

Refuse = Callable[..., list[str]]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "    robot: worker\n",
            "",
            "c:17: tasks.ring.robot: missing, expected robot that does the task, or any, or a list of robots for "
            "`cellplan assign` to choose from; without program a robot has at most one",
        ),
        (
            "tool_axis: normal",
            "duration_s: -4",
            "c:20: tasks.ring.duration_s: expected a positive number of seconds, got -4",
        ),
        (
            "plane: xy}",
            "plane: xy, direction: cw}",
            "c:19: tasks.ring.path.circle.direction: expected counterclockwise or clockwise, got 'cw'",
        ),
        (
            "plane: xy}",
            "plane: xy, start_at: +z}",
            "c:19: tasks.ring.path.circle.start_at: expected an axis of the plane xy: +x, -x, +y, -y, got +z",
        ),
        (
            "circle: {radius_mm: 100, plane: xy}",
            "rectangle: {sides_mm: [10, 10], plane: xy, start_at: [2, 1]}",
            "c:19: tasks.ring.path.rectangle.start_at: expected a corner: [1, 1], [-1, 1], [-1, -1] or [1, -1], "
            "got [2, 1]",
        ),
        (
            "circle: {radius_mm: 100, plane: xy}",
            "rhombus: {diagonals_mm: [10, 10], plane: xy, start_at: [1, 1]}",
            "c:19: tasks.ring.path.rhombus.start_at: expected a corner: [1, 0], [0, 1], [-1, 0] or [0, -1], got [1, 1]",
        ),
        (
            "tool_axis: normal",
            "tool_depth_mm: 101",
            "c:20: tasks.ring.tool_depth_mm: expected a number of millimetres of at most 100, got 101",
        ),
        (
            "tool_axis: normal",
            "standoff_mm: [300, 150]",
            "c:20: tasks.ring.standoff_mm: expected [low, high], got [300, 150]: the smaller distance comes first",
        ),
        (
            "tool_axis: normal",
            "off_part: [run_in, run_in]",
            "c:20: tasks.ring.off_part[1]: expected each word once, got 'run_in' twice",
        ),
        (
            "tool_axis: normal",
            "off_part: [runin]",
            "c:20: tasks.ring.off_part[0]: expected run_in, run_out or cut, got 'runin', did you mean 'run_in'?",
        ),
        (
            "robot: worker",
            "robot: holder",
            "c:18: tasks.ring.robot: expected a robot that does not hold the part, got the positioner 'holder'",
        ),
        (
            "motion: {",
            "  carry: {robot: holder, relative_to: world, path: {circle: {radius_mm: 50, plane: xy}}, tool_axis: -z}\n"
            "motion: {mode: part_at_rest, ",
            "c:21: tasks.carry.robot: expected a robot that does not hold the part in the mode part_at_rest, got the "
            "positioner 'holder'",
        ),
        (
            "robot: worker",
            "robot: wroker",
            "c:18: tasks.ring.robot: expected a robot of this cell (holder, worker), got 'wroker', did you mean "
            "'worker'?",
        ),
        (
            "motion: {",
            "  second: {robot: worker, path: {circle: {radius_mm: 50, plane: xy}, project: +z}}\nmotion: {",
            "c:21: tasks.second.robot: expected a robot without another task, got 'worker', which does 'ring': add "
            "program: {} for a sequence of tasks",
        ),
        (
            "motion: {",
            "  Ring: {robot: nobody, path: {circle: {radius_mm: 50, plane: xy}, project: +z}}\nmotion: {",
            "c:21: tasks.Ring: expected a name that differs from 'ring' by more than upper and lower case\nc:21: "
            "tasks.Ring.robot: expected a robot of this cell (holder, worker), got 'nobody'",
        ),
        (
            ", project: +z",
            ", project: z",
            "c:19: tasks.ring.path.project: expected +x, -x, +y, -y, +z, -z or a direction [x, y, z], got 'z'",
        ),
        (
            ", project: +z",
            ", project: [0, 0, 0]",
            "c:19: tasks.ring.path.project: expected a direction that is not zero, got a vector of no length",
        ),
        (
            ", project: +z",
            "",
            "c:20: tasks.ring.tool_axis: tool_axis: normal requires a path that is projected onto the part: add "
            "project: +z (or another side), or give tool_axis a direction",
        ),
        (
            ", project: +z",
            ", project: +z, offset_mm: 5",
            "c:19: tasks.ring.path.offset_mm: unexpected key, a projected path lies on the surface",
        ),
        (
            "plane: xy",
            "plane: yx",
            "c:19: tasks.ring.path.circle.plane: expected xy, yz or xz, got 'yx'",
        ),
        (
            "circle: {radius_mm: 100, plane: xy}",
            "polyline: {points_mm: [[0, 0], [1, 1, 1]], plane: xy}",
            "c:19: tasks.ring.path.polyline.points_mm[1]: expected a list of 2 numbers, got 3",
        ),
        (
            "circle: {radius_mm: 100, plane: xy}",
            "polyline: {points_mm: [[0, 0], [1, 1]]}",
            "c:19: tasks.ring.path.polyline.plane: missing, expected the plane of the points: xy, yz or xz",
        ),
        (
            "circle: {radius_mm: 100, plane: xy}",
            "polyline: {points_mm: [[0, 0], [0, 0]], plane: xy}",
            "c:19: tasks.ring.path.polyline.points_mm[1]: expected another point than the point before, got the same",
        ),
        (
            "circle: {radius_mm: 100, plane: xy}",
            "polyline: {points_mm: [[0, 0], [5, 0], [5, 5], [0, 0]], plane: xy, closed: true}",
            "c:19: tasks.ring.path.polyline.points_mm[3]: expected another point than the first, got the same",
        ),
        (
            "circle: {radius_mm: 100, plane: xy}",
            "polyline: {points_mm: [[0, 0]], plane: xy}",
            "c:19: tasks.ring.path.polyline.points_mm: expected at least 2 entries, got 1",
        ),
        (
            "circle: {radius_mm: 100, plane: xy}",
            "csv: none.csv",
            "c:19: tasks.ring.path.csv: expected an existing file, got 'none.csv'",
        ),
        (
            "circle: {radius_mm: 100, plane: xy}",
            "csv: {fiel: none.csv}",
            "c:19: tasks.ring.path.csv.file: missing, expected file with the header x_mm,y_mm,z_mm and "
            "optionally i,j,k or qw,qx,qy,qz, and t_s for a trajectory that brings its own "
            "clock\nc:19: tasks.ring.path.csv.fiel: unknown key, did you mean 'file'?; "
            "allowed: file, smooth, closed, join_mm",
        ),
        (
            "tool_axis: normal",
            "tool_axis: nromal",
            "c:20: tasks.ring.tool_axis: expected normal, +x, -x, +y, -y, +z, -z or a direction [x, y, z], got "
            "'nromal', did you mean 'normal'?",
        ),
        (
            "tool_axis: normal",
            "axes: [x, y, rw]",
            "c:20: tasks.ring.axes[2]: expected x, y, z, rx, ry or rz, got 'rw'",
        ),
        (
            "tool_axis: normal",
            "axes: [x, x]",
            "c:20: tasks.ring.axes[1]: expected each word once, got 'x' twice",
        ),
        (
            "tool_axis: normal",
            "axes: []",
            "c:20: tasks.ring.axes: expected at least 1 entry, got 0",
        ),
        (
            "tool_axis: normal",
            "free: [spinn]",
            "c:20: tasks.ring.free[0]: expected spin or {tilt_deg: 10}, got 'spinn', did you mean 'spin'?",
        ),
        (
            "tool_axis: normal",
            "duration_s: 1\n    feed_mm_s: 10",
            "c:21: tasks.ring.feed_mm_s: expected either duration_s or feed_mm_s, got both",
        ),
        (
            "tool_axis: normal",
            "feed_mm_s: 20000",
            "c:20: tasks.ring.feed_mm_s: expected a number of millimetres per second of at most 10000, got 20000",
        ),
        (
            "tool_axis: normal",
            "start_s: 4",
            "c:20: tasks.ring.start_s: expected a start before the end of the clock (motion.duration_s = 4), got 4",
        ),
        (
            "tool_axis: normal",
            "approach_mm: 50\n    start_s: 0.2",
            "c:21: tasks.ring.start_s: expected at least approach_s = 0.5, got 0.2",
        ),
        (
            "tool_axis: normal",
            "approach_mm: -5",
            "c:20: tasks.ring.approach_mm: expected a number of millimetres of at least 0, got -5",
        ),
        (
            "tool_axis: normal",
            "approach_mm: 50\n    settle_s: 1",
            "c:21: tasks.ring.settle_s: expected no time to settle, as the tool comes to its path by an approach",
        ),
        (
            "tool_axis: normal",
            "retract_mm: 50\n    duration_s: 3.8",
            "c:21: tasks.ring.duration_s: expected an end within the clock (motion.duration_s = 4), got start_s + "
            "duration_s + retract_s = 4.3",
        ),
        (
            "tool_axis: normal",
            "start_s: 2\n    duration_s: 2.5",
            "c:21: tasks.ring.duration_s: expected an end within the clock (motion.duration_s = 4), got start_s "
            "+ duration_s = 4.5",
        ),
        (
            "tool_axis: normal",
            "corners: {blend_mm: 0}",
            "c:20: tasks.ring.corners.blend_mm: expected a positive number of millimetres, got 0",
        ),
        (
            "tool_axis: normal",
            "time_law: {trapezoid: {ramp: 0.6}}",
            "c:20: tasks.ring.time_law.trapezoid.ramp: expected a number of at most 0.5, got 0.6",
        ),
        (
            "tool_axis: normal",
            "tolerance: {position: 0.1}",
            "c:20: tasks.ring.tolerance.position: unknown key, did you mean 'position_mm'?; allowed: "
            "position_mm, orientation_deg, between_rows_mm, between_rows_deg",
        ),
    ],
)
def test_a_mistake_in_a_task_is_named_with_its_line_key_and_cure(
    refuse: Refuse, old: str, new: str, message: str
) -> None:
    assert refuse((old, new)) == message.splitlines()


def test_a_file_without_axes_gives_no_normal(refuse: Refuse, tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x_mm,y_mm,z_mm\n0,0,0\n10,0,0\n", encoding="utf-8")

    reported = refuse(("{circle: {radius_mm: 100, plane: xy}, project: +z}", "{csv: path.csv}"))

    assert reported == [
        "c:20: tasks.ring.tool_axis: tool_axis: normal requires axes or quaternions in the file, or a path that "
        "is projected onto "
        "the part: add columns i,j,k, add project: +z (or another side), or give tool_axis a direction"
    ]
