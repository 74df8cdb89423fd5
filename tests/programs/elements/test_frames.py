"""The flange of a controller beside that of the model, in programs that state a tool."""

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from builders.export_jobs import cell_of, controlled, job_of, random_program
from builders.rapid_jobs import multimove_job, part_job
from builders.scene_builders import arm_model

from cellplan.errors import InputError, refusals
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Tool
from cellplan.model.report.exported import ExportJob, Station
from cellplan.model.settings.entry import PoseEntry
from cellplan.programs.elements.frames import require_rest
from cellplan.programs.formats.rapid.writer import RAPID
from cellplan.programs.formats.val3.writer import VAL3
from cellplan.programs.rows.part_targets import with_part_poses

TOOL = Tool(X_FT=pose((0.1, 0.02, 0.3), (0.0, np.pi / 2, 0.0)), bodies=(), mass=2.0, centre=np.array([0.05, 0.01, 0.1]))


def turned(job: ExportJob, **stated: list[float]) -> ExportJob:
    """The job with the tool, and flanges of all controllers that are turned against those of the model."""
    tool_frame = PoseEntry.model_validate(stated, strict=False)
    robots = tuple(
        replace(robot, tool=TOOL, control=robot.control.changed(tool_frame=tool_frame) if stated else robot.control)
        for robot in job.frame.cell.robots
    )
    return replace(job, frame=replace(job.frame, cell=replace(job.frame.cell, robots=robots)))


def test_tools_of_rapid_are_given_in_the_flange_of_the_controller() -> None:
    plain, half = turned(multimove_job()), turned(multimove_job(), rpy_deg=[0, 0, 180])

    data = {name: re.search(r"tooldata .*", text)[0] for name, text in RAPID.render(half).items() if "tooldata" in text}

    assert len(data) == 2
    for text in data.values():
        assert "[-100.0000,-20.0000,300.0000]" in text  # half a turn about z
        assert "[2.000,[-50.000,-10.000,100.000]" in text  # the centre of mass turns too
    assert RAPID.read(half.frame, RAPID.render(half))[0].robots.keys() == half.programs[0].robots.keys()
    for written, frame in ((plain, half.frame), (half, plain.frame)):
        with pytest.raises(InputError, match="expected the tool of the cell"):
            RAPID.read(frame, RAPID.render(written))


def test_a_part_on_the_holder_is_given_in_the_flange_of_its_controller() -> None:
    plain, half = turned(part_job(step=0.02)), turned(part_job(step=0.02), rpy_deg=[0, 0, 180])
    half = replace(half, programs=with_part_poses(half.frame, half.programs))

    files = RAPID.render(half)

    assert RAPID.read(half.frame, files)[0].robots.keys() == half.programs[0].robots.keys()
    with pytest.raises(InputError, match="expected the tool of the cell"):
        RAPID.read(plain.frame, files)


def test_tools_of_val3_are_given_in_the_flange_of_the_controller() -> None:
    robot = controlled("alpha", arm_model())
    job = job_of(cell := cell_of(robot, kind="staubli"), random_program(cell))

    text = VAL3.render(turned(job, xyz_mm=[0, 0, 50], rpy_deg=[0, 0, 90]))["alpha/alpha.dtx"]

    tool = re.search(r'x="20.000" y="-100.000" z="250.000" rx="([-\d.]+)" ry="([-\d.]+)" rz="([-\d.]+)"', text)
    assert [float(number) for number in tool.groups()] == [90.0, 0.0, -90.0]  # Rz(-90) Ry(90) = Rx(90) Rz(-90)


@pytest.mark.parametrize(
    ("X", "holder", "carried"), [(None, None, "one that moves"), (np.eye(4), "table", "'table' of the same controller")]
)
def test_lines_in_a_frame_that_moves_are_refused_with_who_carries_it(
    X: Array | None, holder: str | None, carried: str
) -> None:
    with pytest.raises(InputError, match=rf"robots\.arm: .*\(tasks a, b\), got {carried}; write joints"):
        require_rest("arm", Station(tasks=("a", "b"), X=X, holder=holder))


def test_lines_in_a_frame_at_rest_are_taken() -> None:
    at_rest = Station(tasks=("a",), X=np.eye(4), holder=None)

    assert not list(refusals(partial(require_rest, "arm", at_rest)))
