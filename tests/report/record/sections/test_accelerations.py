"""Accelerations in the record and in the header of a table: units, the worst of several runs."""

import math
from dataclasses import replace
from typing import Any

import pytest

from cellplan.model.cell.acceleration import (
    JointAcceleration,
    LimitSource,
    MotionAccelerations,
    PartAcceleration,
    PointAcceleration,
    ProcessSpeed,
)
from cellplan.model.report.report import JointUse
from cellplan.report.record.sections.accelerations import accelerations_record, table_line
from cellplan.report.record.sections.joints import joints_record
from cellplan.report.record.sections.tasks import tasks_record
from cellplan.report.record.summary import worst_of

TURNING = JointAcceleration(
    robot="kuka",
    joint="A1",
    is_revolute=True,
    peak=math.radians(300.0),
    peak_at_s=1.5,
    limit=math.radians(600.0),
    source=LimitSource.ASSUMED,
    peak_jerk=math.radians(4000.0),
    peak_jerk_at_s=0.25,
    jerk_limit=None,
    window=0.004,
)
SLIDING = replace(
    TURNING, joint="rail", is_revolute=False, peak=0.6, limit=1.0, source=LimitSource.STATED, peak_jerk=2.0
)
POINT = PointAcceleration(peak=3.5, peak_at_s=0.1, peak_jerk=80.0, peak_jerk_at_s=0.2, window=0.004)
SPEED = ProcessSpeed(mean=0.05, peak=0.1, peak_at_s=0.5, steady_share=0.2, slower=((0.0, 0.4), (0.6, 1.0)))
MEASURED = MotionAccelerations(
    joints=(TURNING, SLIDING),
    tools={"kuka": POINT},
    part=PartAcceleration(centre=POINT, corner=replace(POINT, peak=5.0)),
    process={"ring": SPEED},
)


def use_of(joint: JointAcceleration) -> JointUse:
    return JointUse(
        robot=joint.robot,
        joint=joint.joint,
        is_revolute=joint.is_revolute,
        min=0.0,
        max=1.0,
        lower=-1.0,
        upper=2.0,
        margin=1.0,
        margin_at_s=0.0,
        peak_velocity=0.5,
        velocity_limit=1.0,
        peak_velocity_at_s=0.5,
        travel=1.0,
    )


def test_joints_are_recorded_in_degrees_and_millimetres() -> None:
    record = joints_record([use_of(TURNING), use_of(SLIDING)], MEASURED.joints)

    turning, sliding = record["kuka"]["A1"], record["kuka"]["rail"]
    assert (turning["min"], turning["unit"], sliding["unit"], sliding["max"]) == (0.0, "deg", "mm", 1000.0)
    assert (turning["peak_acceleration"], turning["acceleration_limit"]) == (300.0, 600.0)
    assert (turning["acceleration_limit_source"], turning["peak_jerk"], turning["jerk_window_ms"]) == (
        "assumed",
        4000.0,
        4.0,
    )
    assert (sliding["peak_acceleration"], sliding["acceleration_limit_source"]) == (600.0, "stated")
    part = accelerations_record(MEASURED)["part"]
    assert part is not None
    assert part["corner"]["peak_acceleration_m_s2"] == 5.0


def test_the_process_speed_of_a_task_is_recorded_in_millimetres_per_second(passed_run: Any) -> None:
    result = replace(MEASURED, process={"circle": SPEED})
    tasks = tasks_record(replace(passed_run.report, accelerations=result), passed_run.cell)

    assert tasks["rhombus"]["process_speed"] is None
    assert tasks["circle"]["process_speed"] == {
        "mean_mm_s": 50.0,
        "peak_mm_s": 100.0,
        "peak_at_s": 0.5,
        "steady_share": 0.2,
        "slower_count": 2,
        "slower_at_s": [[0.0, 0.4], [0.6, 1.0]],
    }


def test_the_worst_of_several_runs_counts() -> None:
    gentle = replace(MEASURED, joints=(replace(TURNING, peak=0.1, peak_jerk=99.0), SLIDING), part=None)

    joints = worst_of([joints_record([use_of(TURNING)], entry.joints) for entry in (MEASURED, gentle)])["kuka"]["A1"]
    merged = worst_of([accelerations_record(entry) for entry in (MEASURED, gentle)])

    assert joints["peak_acceleration"] == pytest.approx(math.degrees(TURNING.peak))
    assert joints["peak_jerk"] == pytest.approx(math.degrees(99.0))
    assert merged["part"] == accelerations_record(MEASURED)["part"]


@pytest.mark.parametrize(
    ("joints", "line"),
    [
        (
            (TURNING, SLIDING),
            "at most 600 mm/s2 at 1.500 s (rail, 60 % of its stated limit), jerk 4000 deg/s3 over 4 ms at 0.250 s (A1)",
        ),
        (
            (replace(TURNING, limit=None, source=LimitSource.UNLIMITED),),
            "at most 300 deg/s2 at 1.500 s (A1, not judged), jerk 4000 deg/s3 over 4 ms at 0.250 s (A1)",
        ),
    ],
)
def test_the_header_of_a_table_states_the_largest_acceleration_and_jerk(
    joints: tuple[JointAcceleration, ...], line: str
) -> None:
    assert table_line(replace(MEASURED, joints=joints), "kuka") == line
