"""Stations: where controllers have to know the part, against closed forms, and the same wherever the cell stands."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan import load_cell, open_gate, solve, write_run
from cellplan.errors import InputError
from cellplan.files.run.stored import read_stored_run
from cellplan.geometry.transforms import Array, inverse, pose
from cellplan.model.cell.cell import Cell, Mode
from cellplan.model.report.exported import Moves, Promise
from cellplan.model.report.verified_run import ReadRun, UnsolvedRun
from cellplan.model.settings.controllers import ControllerEntry, KindName, RobotControlEntry
from cellplan.model.task.task import Frame
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.frames import require_frame_numbers
from cellplan.programs.export.choice import Choice
from cellplan.programs.export.exporters import exporter_of
from cellplan.programs.export.refusals import refuse_unfit
from cellplan.programs.promises.run_programs import program_names
from cellplan.programs.promises.stations import stations
from cellplan.runs.gate.open_gate import read_run
from cellplan.runs.gate.stored_cell import load_stored_cell

pytestmark = pytest.mark.usefixtures("stored_solutions")

WORKERS = ("kuka", "abb", "staubli")


@pytest.fixture(scope="module")
def in_turn(cells: Path, tmp_path_factory: pytest.TempPathFactory) -> ReadRun:
    """Three robots on controllers of their own work on a part that a fourth holds at -75, 0 and 75 degrees."""
    folder = tmp_path_factory.mktemp("in-turn") / "run"
    write_run(solve(load_cell(cells / "in_turn.yaml")), folder)
    stored = read_stored_run(folder)
    return read_run(stored, load_stored_cell(stored, cell=cells / "in_turn.yaml", allow_dirs=()).cell)


@pytest.fixture(scope="module")
def moving(sound: Path) -> ReadRun:
    """A part that is held and moves while the other tool works on it."""
    stored = read_stored_run(sound / "run")
    return read_run(stored, load_stored_cell(stored, cell=sound / "cell" / "small.yaml", allow_dirs=()).cell)


def connected(run: ReadRun, **controls: RobotControlEntry) -> ReadRun:
    """The run with other entries of controllers."""
    robots = tuple(replace(robot, control=controls.get(robot.name, robot.control)) for robot in run.cell.robots)
    return replace(run, cell=replace(run.cell, robots=robots))


def control(**stated: object) -> RobotControlEntry:
    return RobotControlEntry.model_validate({"id": "c", **stated}, strict=False)


def shifted(cell: Cell, X: Array) -> Cell:
    """The whole cell at another place on the floor."""
    robots = tuple(replace(robot, X_WB=X @ robot.X_WB) for robot in cell.robots)
    part = cell.part if cell.part.X_WP is None else replace(cell.part, X_WP=X @ cell.part.X_WP)
    return replace(cell, robots=robots, part=part)


def test_each_robot_has_the_part_where_it_works_on_it(in_turn: ReadRun) -> None:
    result = stations(in_turn)

    assert {name: [station.tasks for station in known] for name, known in result.items()} == {
        "kuka": [("circle",)],
        "abb": [("rhombus",)],
        "staubli": [("rectangle",)],
    }
    places = {name: result[name][0].X_W for name in WORKERS}
    for name, degrees in (("kuka", 75.0), ("staubli", -75.0)):  # the holder turns about the z axis of the world
        np.testing.assert_allclose(places[name], pose(rpy=(0.0, 0.0, np.deg2rad(degrees))) @ places["abb"], atol=1e-9)
    for name in WORKERS:
        np.testing.assert_allclose(result[name][0].X, inverse(in_turn.cell.robot(name).X_WB) @ places[name], atol=1e-12)
    np.testing.assert_allclose(result["abb"][0].X[:3, 3] * 1e3, [1093.258, 0.0, 889.008], atol=1e-3)


@pytest.mark.parametrize("X", [pose((3.0, -2.0, 0.5)), pose((0.1, 0.2, 0.3), (0.4, -0.5, 2.0))])
def test_the_place_of_the_cell_on_the_floor_changes_no_frame(in_turn: ReadRun, X: Array) -> None:
    before = stations(in_turn)

    after = stations(replace(in_turn, cell=shifted(in_turn.cell, X)))

    for name in WORKERS:
        np.testing.assert_allclose(after[name][0].X, before[name][0].X, atol=1e-12)
        np.testing.assert_allclose(after[name][0].X_W, X @ before[name][0].X_W, atol=1e-12)


def test_a_controller_counts_from_its_own_base(in_turn: ReadRun) -> None:
    before = stations(in_turn)["kuka"][0].X
    higher = control(id="krc", base={"xyz_mm": [0, 0, 450]})
    turned = control(id="krc", base={"rpy_deg": [0, 0, 180]})

    raised, halved = (stations(connected(in_turn, kuka=entry))["kuka"][0].X for entry in (higher, turned))

    np.testing.assert_allclose(raised[:3, 3] - before[:3, 3], [0.0, 0.0, -0.45], atol=1e-12)
    np.testing.assert_allclose(raised[:3, :3], before[:3, :3], atol=1e-12)
    np.testing.assert_allclose(halved[:3, 3], before[:3, 3] * (-1.0, -1.0, 1.0), atol=1e-12)
    np.testing.assert_allclose(halved[:3, :3], np.diag([-1.0, -1.0, 1.0]) @ before[:3, :3], atol=1e-12)


def test_a_part_in_the_same_hands_goes_with_the_flange(in_turn: ReadRun) -> None:
    same = control()
    everybody = connected(in_turn, reis=same, kuka=same, abb=same, staubli=same)
    turned = connected(everybody, reis=control(tool_frame={"rpy_deg": [0, 0, 180]}))

    result = {name: known[0] for name, known in stations(everybody).items()}

    grasp = pose((0.0, 0.0, 0.15), (0.0, -np.pi / 2, 0.0))  # of the part in a bare flange: at -150 mm, turned by 90 deg
    for name in WORKERS:
        assert (result[name].holder, result[name].X_W) == ("reis", None)
        np.testing.assert_allclose(result[name].X, grasp, atol=1e-12)
    np.testing.assert_allclose(stations(turned)["kuka"][0].X, pose(rpy=(0.0, 0.0, np.pi)) @ grasp, atol=1e-12)


@pytest.mark.parametrize("kind", ["fanuc", "kuka", "staubli", "ur", "yaskawa"])
def test_robots_of_one_controller_have_a_fixed_frame_for_each_pose_in_which_the_part_rests(
    in_turn: ReadRun, moving: ReadRun, kind: KindName
) -> None:
    controllers = {"c": ControllerEntry(kind=kind)}
    same = control()
    together = connected(in_turn, reis=same, kuka=same, abb=same, staubli=same)
    apart, fixed = stations(in_turn), stations(replace(together, cell=replace(together.cell, controllers=controllers)))
    carried = connected(moving, left=same, right=same)
    (moved,) = stations(replace(carried, cell=replace(carried.cell, controllers=controllers)))["right"]

    for name in WORKERS:
        assert fixed[name][0].holder is None
        np.testing.assert_array_equal(fixed[name][0].X, apart[name][0].X)
    assert (moved.holder, moved.X_W) == ("left", None)


def test_poses_are_numbered_in_the_order_of_work_and_each_counts_once(in_turn: ReadRun) -> None:
    numbered = connected(in_turn, abb=control(frames=[4, 7, 2, 9]))
    tasks = tuple(replace(task, robot="abb") for task in in_turn.cell.tasks)
    orders = {"abb": tuple(task.name for task in tasks)}
    robots = tuple(replace(robot, order=orders.get(robot.name, ())) for robot in numbered.cell.robots)
    alone = replace(numbered, cell=replace(numbered.cell, tasks=tasks, robots=robots))
    together = connected(alone, reis=control())

    known = stations(alone)["abb"]

    assert [(station.tasks, station.number) for station in known] == [
        (("circle",), 4),
        (("rhombus",), 7),
        (("rectangle",), 2),
    ]
    assert [(station.tasks, station.number) for station in stations(together)["abb"]] == [
        (("circle", "rhombus", "rectangle"), 4)
    ]

    def said(needed: tuple[int, int] | None = None, **stated: object) -> str:
        short = connected(alone, abb=control(**stated))
        with pytest.raises(InputError) as caught:
            require_frame_numbers(short.cell.robot("abb"), stations(short)["abb"], needed=needed)
        return str(caught.value)

    key, poses = "robots.abb.controller.frames: expected", "in which it works (circle; rhombus; rectangle)"
    assert said(frames=[4, 7]) == f"{key} 3 numbers, one for each pose of the part {poses}, got 2"
    assert said((1, 9)) == f"{key} 3 numbers, one for each pose of the part {poses}, 1 to 9, got none"
    assert said((1, 9), base_number=3).endswith("1 to 9, got none")


def test_a_cell_that_was_not_solved_has_the_same_frames_where_the_part_rests(in_turn: ReadRun, cells: Path) -> None:
    known, unsolved = stations(in_turn), stations(UnsolvedRun(cell=load_cell(cells / "in_turn.yaml")))

    assert list(unsolved) == list(known)
    for name, of_robot in known.items():
        for one, other in zip(of_robot, unsolved[name], strict=True):
            assert (one.tasks, one.holder, one.number) == (other.tasks, other.holder, other.number)
            np.testing.assert_allclose(other.X, one.X, atol=1e-9)  # tables have twelve decimals of a degree


def test_a_cell_that_was_not_solved_has_no_frames_where_the_part_moves(moving: ReadRun) -> None:
    assert stations(UnsolvedRun(cell=moving.cell)) == {}


def test_a_cell_demands_the_programs_that_its_run_has(in_turn: ReadRun, moving: ReadRun) -> None:
    """Step registers belong to one program, which is known before any row is read."""
    for run in (in_turn, moving):
        assert program_names(UnsolvedRun(cell=run.cell)) == program_names(run)
    choice = Choice(steps=True, promise=Promise.SEQUENCE_ONLY)
    dialect = exporter_of("krl", choice)
    assert isinstance(dialect, Dialect)

    refuse_unfit(in_turn, dialect, choice)


def test_moves_in_which_a_part_is_taken_are_no_work(cells: Path) -> None:
    cell = load_cell(cells / "three_tasks_each.yaml")
    at_rest = replace(cell, motion=replace(cell.motion, mode=Mode.SEMI_COORDINATED))

    assert stations(UnsolvedRun(cell=cell)) == {}
    assert {name for known in stations(UnsolvedRun(cell=at_rest)).values() for one in known for name in one.tasks} == {
        task.name for task in cell.tasks
    }


def test_a_short_list_of_frames_is_said_with_all_else_that_is_missing(in_turn: ReadRun) -> None:
    """The tool has no number, no signal is stated, and the arm works on the part in one pose but has no frame."""
    fanuc = connected(in_turn, abb=control())
    controllers = {**in_turn.cell.controllers, "c": ControllerEntry(kind="fanuc")}
    run = UnsolvedRun(cell=replace(fanuc.cell, controllers=controllers))

    with pytest.raises(InputError) as caught:
        refuse_unfit(run, DIALECTS["fanuc_ls"], Choice(moves=Moves.LINEAR))

    keys = {line.split(": ")[0].removeprefix("robots.abb.controller.") for line in str(caught.value).splitlines()}
    assert {"frames", "tool_number", "handshake"} <= keys
    assert "expected 1 number, one for each pose of the part in which it works (rhombus), 1 to 9" in str(caught.value)


def test_the_base_number_is_that_of_the_only_frame(in_turn: ReadRun) -> None:
    assert stations(in_turn)["kuka"][0].number == 1
    assert stations(in_turn)["abb"][0].number is None


def test_a_part_that_moves_under_the_tool_has_a_frame_on_the_same_controller_only(moving: ReadRun) -> None:
    (apart,) = stations(moving)["right"]
    (same,) = stations(connected(moving, left=control(), right=control(frames=[3])))["right"]

    assert (apart.X, apart.X_W, apart.number) == (None, None, None)
    assert (same.holder, same.number) == ("left", 3)
    left = moving.cell.robot("left")
    np.testing.assert_allclose(
        same.X @ pose((-0.12, 0.0, 0.005), (np.pi, 0.0, 0.0)), left.tool.X_FT, atol=1e-12
    )  # the grasp as the cell file states it, seen from the tip of the holder


def test_work_in_the_world_has_the_world_as_its_frame(moving: ReadRun) -> None:
    cell = moving.cell
    tasks = tuple(replace(task, relative_to=Frame.WORLD) for task in cell.tasks)

    (result,) = stations(replace(moving, cell=replace(cell, tasks=tasks)))["right"]

    np.testing.assert_allclose(result.X @ inverse(result.X), np.eye(4), atol=1e-12)
    np.testing.assert_allclose(result.X[:3, 3], [1.9, 0.3, -0.48], atol=1e-12)  # the base is turned by half a turn
    np.testing.assert_array_equal(result.X_W, np.eye(4))


def test_a_verified_run_has_the_frames_of_the_one_that_was_read(sound: Path, moving: ReadRun) -> None:
    verified = open_gate(sound / "run", cell=sound / "cell" / "small.yaml")

    assert stations(verified)["right"][0].tasks == stations(moving)["right"][0].tasks == ("path",)


@pytest.mark.slow
def test_a_welded_frame_has_a_frame_for_each_pose_of_its_table(shared_robots: Path, tmp_path: Path) -> None:
    """The table turns about the vertical axis, counted against the world; the part stands 680 mm above the floor."""
    path = shared_robots.parent / "cases" / "welding_frame" / "cell.yaml"
    cell = load_cell(path, allow_dirs=(shared_robots.parent,))
    write_run(solve(cell), tmp_path / "run")
    stored = read_stored_run(tmp_path / "run")
    read = read_run(stored, load_stored_cell(stored, cell=path, allow_dirs=(shared_robots.parent,)).cell)

    known = stations(read)

    turns = {"f_long": -90.0, "f_short": -180.0, "f_corner1": -135.0, "f_corner2": -45.0}
    assert [station.tasks for station in known["fanuc"]] == [(name,) for name in turns]
    for station, turn in zip(known["fanuc"], turns.values(), strict=True):
        expected = pose((1.25, 0.0, 0.38), (0.0, 0.0, np.deg2rad(-turn - 180.0)))  # the base stands half a turn round
        np.testing.assert_allclose(station.X, expected, atol=1e-9)
    (abb,) = known["abb"]
    assert (abb.holder, abb.tasks) == ("table", ("a_long", "a_short", "a_corner1", "a_corner2"))
    np.testing.assert_allclose(abb.X, pose((0.0, 0.0, 0.15)), atol=1e-12)
