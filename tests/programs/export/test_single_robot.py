"""A cell of one robot: nobody waits for it, so its programs of every maker have no handshakes."""

from dataclasses import replace

import pytest
from builders.export_jobs import zero_of

from cellplan import VerifiedRun, load_cell, open_gate, solve, write_run
from cellplan.errors import NotVerifiedError
from cellplan.model.report.verified_run import ACCESS_TOKEN
from cellplan.model.settings.controllers import ControllerEntry, KindName, RobotControlEntry
from cellplan.programs.export.choice import Choice
from cellplan.programs.export.program import exported

CELL = """\
cellplan: 1
name: alone
robots:
  pen:
    model: kuka_kr6
    base: {xyz_mm: [0, -1100, 0], rpy_deg: [0, 0, 90]}
    tool: {xyz_mm: [0, 0, 150], geometry: {capsule: {radius_mm: 12, length_mm: 150}}}
part:
  geometry: {box: {size_mm: [600, 300, 200]}}
  at: {xyz_mm: [0, 0, 900]}
tasks:
  line:
    robot: pen
    path: {polyline: {points_mm: [[-20, 0], [20, 0]], plane: xz}, project: -y}
    tool_axis: normal
motion: {mode: part_at_rest, duration_s: 1, step_s: 0.02, time_law: quintic}
"""
WAITS = {
    "fanuc_ls": ("DO[", "WAIT"),
    "krl": ("$OUT", "WAIT"),
    "rapid": ("SetDO", "WaitDI"),
    "urscript": ("digital",),
    "val3": ("dio", "wait("),
}


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    folder = tmp_path_factory.mktemp("alone")
    (folder / "alone.yaml").write_text(CELL, encoding="utf-8")
    write_run(solve(load_cell(folder / "alone.yaml")), folder / "run")
    return open_gate(folder / "run", cell=folder / "alone.yaml")


@pytest.mark.parametrize(
    ("form", "kind"),
    [
        ("fanuc_ls", "fanuc"),
        ("krl", "kuka"),
        ("rapid", "abb"),
        ("urscript", "ur"),
        ("val3", "staubli"),
    ],
)
def test_a_single_robot_has_programs_without_waits(alone: VerifiedRun, form: str, kind: KindName) -> None:
    control = RobotControlEntry(id="c", task="T_ROB1" if kind == "abb" else None)
    tasks = {"T_ROB1": "ROB_1"} if kind == "abb" else {}
    robot = alone.cell.robots[0]
    model = replace(robot.model, controller=zero_of(6)) if kind == "fanuc" else robot.model
    cell = replace(
        alone.cell,
        robots=(replace(robot, model=model, control=control),),
        controllers={"c": ControllerEntry(kind=kind, tasks=tasks)},
    )

    files, record = exported(replace(alone, cell=cell, token=ACCESS_TOKEN), form, Choice())

    assert record["promise"] == "sequence only"
    assert record["marks"] == []
    assert not [word for text in files.values() for word in WAITS[form] if word in text.replace("waitEndMove()", "")]


def test_few_decimals_are_named_where_they_spoil_the_path(alone: VerifiedRun) -> None:
    control = RobotControlEntry(id="c", decimals=0)
    cell = replace(
        alone.cell,
        robots=(replace(alone.cell.robots[0], control=control),),
        controllers={"c": ControllerEntry(kind="kuka")},
    )

    with pytest.raises(NotVerifiedError) as refusal:
        exported(replace(alone, cell=cell, token=ACCESS_TOKEN), "krl", Choice())

    first, *_, detail = refusal.value.findings
    assert first.startswith("krl: position error of task 'line': ")
    assert detail == "  robots.pen.controller.decimals: 0 are stated, the usual ones of krl are 5"


@pytest.mark.parametrize(("step", "details"), [(0.02, 1), (0.004, 0)])
def test_long_steps_are_named_where_accelerations_between_them_are_too_large(
    alone: VerifiedRun, step: float, details: int
) -> None:
    robot = alone.cell.robots[0]
    slow = replace(robot, acceleration=replace(robot.acceleration, full_speed_in=(60.0,)))
    cell = replace(alone.cell, robots=(slow,), motion=replace(alone.cell.motion, step=step))

    with pytest.raises(NotVerifiedError) as refusal:
        exported(replace(alone, cell=cell, token=ACCESS_TOKEN), "stream", Choice())

    assert "exceeds its acceleration limit" in refusal.value.findings[0]
    expected = ["  motion.step_s: 0.02 is stated; steps of 0.004, a controller's cycle, resolve accelerations"]
    assert [finding for finding in refusal.value.findings if finding.startswith("  ")] == expected[:details]
