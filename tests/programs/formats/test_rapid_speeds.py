"""Speeds of RAPID lines beside that of the tool, and durations of joint moves between them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from builders.export_jobs import rail_model
from builders.scene_builders import arm_model
from builders.seam_jobs import seam_job

from cellplan.errors import InputError
from cellplan.geometry.transforms import pose
from cellplan.model.robot.robot import RobotModel
from cellplan.programs.elements.joints import Axes
from cellplan.programs.formats.rapid.speeds import axis_speeds, turn_speed
from cellplan.programs.formats.rapid.writer import RAPID
from cellplan.programs.judgement.compare_rows import other_rows

JOB = seam_job("abb", process={"on": "SetDO doA,1", "off": "SetDO doA,0"})


def unit(model: RobotModel) -> SimpleNamespace:
    robot = SimpleNamespace(model=model)
    return SimpleNamespace(robot=robot, axes=Axes.of(robot))  # type: ignore[arg-type]


def test_a_tool_turns_by_its_angle_in_the_time_of_the_line() -> None:
    """60 degrees over 100 mm, and 30 more over 50 mm across, at 250 mm/s: 90 degrees in 0.6 s."""
    X = [pose((0, 0, 0)), pose((0.1, 0, 0), (0, 0, np.pi / 3)), pose((0.1, 0.05, 0), (0, 0, np.pi / 2))]

    assert turn_speed(X, 0.25) == pytest.approx(150.0, abs=1e-9)
    assert turn_speed(X[:1], 0.25) == 0.0
    assert turn_speed([X[0], X[0]], 0.25) == 0.0


def test_usual_speeds_stay_unless_a_line_or_an_external_axis_takes_more() -> None:
    rail = rail_model()
    fast = replace(rail, joints=(replace(rail.joints[0], velocity=1.4), *rail.joints[1:]))

    assert axis_speeds(unit(arm_model()), [20.0, 499.0]) == [500, 100, 20]
    assert axis_speeds(unit(arm_model()), [500.5]) == [501, 100, 20]
    assert axis_speeds(unit(fast), []) == [500, 1400, 20]


def test_a_tool_that_turns_fast_has_a_speed_that_lets_it() -> None:
    """At 30 m/s, 0.04 rad over a line of 100 mm are 688 degrees per second, 0.08 rad over the arc 1277."""
    rows = JOB.programs[0].robots["alpha"]
    assert rows.feeds is not None
    fast = replace(rows, feeds=np.where(rows.feeds == 0.008, 30.0, rows.feeds))
    job = replace(JOB, programs=(replace(JOB.programs[0], robots={"alpha": fast}),))

    files = RAPID.render(job)

    assert "s_30000 := [30000," in files["alpha.mod"]
    turn = int(files["alpha.mod"].partition("s_30000 := [30000,")[2].split(",")[0])
    assert turn == np.ceil(np.rad2deg(0.08) * 30.0 / (2.0 * np.hypot(0.05, 0.02)))
    assert list(other_rows(RAPID, job, RAPID.read(job.frame, files))) == []
    files["alpha.mod"] = files["alpha.mod"].replace(f"[30000,{turn}", "[30000,500")
    with pytest.raises(InputError, match=r"expected at least 688 deg/s of the turn, 100 mm/s and 20 deg/s of external"):
        RAPID.read(job.frame, files)


@pytest.mark.parametrize("other", ["[8,5,100,20]", "[8,500,1,20]", "[8,500,100,2]"])
def test_slower_speeds_beside_the_feed_are_refused(other: str) -> None:
    files = RAPID.render(JOB)
    assert "s_8 := [8,500,100,20]" in files["alpha.mod"]

    with pytest.raises(InputError, match=r"alpha\.mod:\d+: expected at least 500 deg/s of the turn"):
        RAPID.read(JOB.frame, {**files, "alpha.mod": files["alpha.mod"].replace("[8,500,100,20]", other)})


def test_another_duration_of_a_joint_move_is_noticed() -> None:
    files = RAPID.render(JOB)
    text = files["alpha.mod"]
    assert text.count(r"\T:=1.000000") == 2

    for place, row in ((0, 8), (1, 2)):
        parts = text.split(r"\T:=1.000000")
        parts[place] += r"\T:=1.100000" + parts.pop(place + 1)
        changed = {**files, "alpha.mod": r"\T:=1.000000".join(parts)}
        assert list(other_rows(RAPID, JOB, RAPID.read(JOB.frame, changed))) == [
            f"robot 'alpha': row {row}: expected a motion of 1 s, read 1.1 s"
        ]
