"""Variables of a layout search: derivatives by differences, the same motion as the written cell, and back again."""

from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.geometry.transforms import Array, rotation_about
from cellplan.model.cell.cell import Cell
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.search.kernel.job import Job, Layouts
from cellplan.search.kernel.run import run
from cellplan.search.variables.choices import Choices
from cellplan.search.variables.variables import Variables

CELLS = Path(__file__).resolve().parents[3] / "cells"
RODS = {"kuka": (100.0, 0.0, -90.0), "abb": (150.0, 45.0, 180.0), "staubli": (250.0, 30.0, -90.0)}
HOLDER = {"radius_mm": 40, "length_mm": 60}
RANGES = {
    "kuka.base": {"x_mm": [0, 2500], "y_mm": [-2000, 2000], "z_mm": [0, 600], "yaw_deg": [-180, 180]},
    "abb.base": {"x_mm": [0, 2800], "z_mm": [0, 600], "roll_deg": [-20, 20], "pitch_deg": [-20, 20]},
    "kuka.tool": {"length_mm": [100, 250], "tilt_deg": [0, 60], "roll_deg": [-180, 180]},
    "reis.start_deg": True,
    "staubli.weights": True,
    "tasks.circle.spin_deg": [-90, 90],
    "part.held_by[0].at": {"x_mm": [-300, -200], "z_mm": [-50, 50], "roll_deg": [-20, 20], "yaw_deg": [-20, 20]},
}
NODES = 25
STEP = 1e-6


def rod(length: float, tilt: float, roll: float) -> dict[str, object]:
    return {"rod": {"length_mm": length, "tilt_deg": tilt, "roll_deg": roll, "radius_mm": 12, "holder": HOLDER}}


@pytest.fixture(scope="session")
def cell() -> Cell:
    """The reference cell with rods as tools and something of every kind that may vary."""
    tools = {f"robots.{name}.tool": rod(*numbers) for name, numbers in RODS.items()}
    plain = load_cell(CELLS / "four_robots.yaml")
    tilted = {"robots.abb.pedestal": None, "robots.abb.mount": {"tilted": {"cylinder": {"radius_mm": 230}}}}
    return plain.with_values({**tools, **tilted, "layout": {"vary": RANGES}})


def start_of(cell: Cell) -> Array:
    return np.concatenate([robot.start for robot in cell.robots if robot.start is not None])


def some_values(variables: Variables, seed: int = 0, share: float = 0.2) -> Array:
    steps = np.random.default_rng(seed).standard_normal(len(variables.given))
    return np.clip(variables.given + share * variables.scale * steps, variables.lower, variables.upper)


def motion_of(cell: Cell, layouts: Layouts) -> Array:
    schedule = schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    job = Job.of(cell, schedule, moving=[robot.name for robot in cell.robots], nodes=NODES)
    return run(job, layouts).q[0]


def twist(plus: Array, minus: Array, at: Array) -> Array:
    """Velocity of the origin and angular velocity, by central differences of a pose."""
    rate = (plus - minus) / (2.0 * STEP)
    turning = rate[:3, :3] @ at[:3, :3].T
    return np.array([*rate[:3, 3], turning[2, 1], turning[0, 2], turning[1, 0]])


@pytest.mark.parametrize("tied", [{}, {"equal": [["kuka.base.z_mm", "abb.base.z_mm"]]}])
def test_directions_are_those_of_central_differences(cell: Cell, tied: dict[str, object]) -> None:
    variables = Variables.of(cell.with_values({"layout": {"vary": RANGES, **tied}}))
    x, start = some_values(variables), start_of(variables.base)
    result, at = variables.directions(x), variables.layouts(x[None], start[None])
    for column, unit in enumerate(STEP * np.eye(len(x))):
        plus, minus = (variables.layouts((x + sign * unit)[None], start[None]) for sign in (1.0, -1.0))
        for robot in range(len(cell.robots)):
            for poses, exact in (("X_WB", result.base), ("X_FT", result.tool)):
                X = [getattr(entry, poses)[0, robot] for entry in (plus, minus, at)]
                assert np.abs(twist(*X) - exact[robot, :, column]).max() <= 1e-8
        for numbers, exact in (("start", result.start), ("weights", result.weights)):
            rate = (getattr(plus, numbers)[0] - getattr(minus, numbers)[0]) / (2.0 * STEP)
            assert np.abs(rate - exact[:, column]).max() <= 1e-8


def test_the_kernel_moves_as_the_written_cell(cell: Cell) -> None:
    variables = Variables.of(cell)
    x = some_values(variables, share=0.1)
    start = variables.layouts(x[None], start_of(variables.base)[None])
    q = motion_of(variables.base, start)
    written = variables.cell(x, q[0])
    other = motion_of(written, Layouts.of([written], start_of(written)[None]))
    done = np.isfinite(q).all(axis=1)  # up to where a tool loses its path
    assert done.sum() > 10
    assert np.abs(q[done]).max() > 0.1
    np.testing.assert_array_equal(done, np.isfinite(other).all(axis=1))
    assert np.abs(q - other)[done].max() <= 5e-6  # what is written is rounded to 0.001 mm and 1e-6 deg, weights to 1e-6


def test_what_is_written_is_read_again(cell: Cell) -> None:
    variables = Variables.of(cell)
    x = some_values(variables, seed=1)
    written = variables.cell(x, start_of(variables.base))
    for again in (Variables.of(written).given, variables.read_from(written)):
        assert np.abs(again - x).max() <= 1e-5
    placed = variables.placed(x)
    for one, other in zip(placed.robots, written.robots, strict=True):
        assert np.abs(one.X_WB - other.X_WB).max() <= 1e-6
        assert np.abs(one.tool.X_FT - other.tool.X_FT).max() <= 1e-6
        for body, twin in zip(one.tool.bodies, other.tool.bodies, strict=True):
            assert body.name == twin.name
            assert np.abs(body.X_BS - twin.X_BS).max() <= 1e-6
    assert np.abs(placed.part.held_by[0].X_PT - written.part.held_by[0].X_PT).max() <= 1e-6
    assert written.origin.changes == Variables.of(cell).cell(x, start_of(variables.base)).origin.changes


def test_values_outside_are_brought_in_and_angles_by_whole_turns(cell: Cell) -> None:
    ranges = {"abb.base": {"x_mm": [0, 2000], "yaw_deg": [500, 540]}}
    variables = Variables.of(cell.with_values({"layout.vary": ranges}))
    assert variables.given == pytest.approx([2.0, np.radians(525.0)])
    present = 1000.0 * cell.robot("abb").X_WB[0, 3]
    assert [text for text in variables.remarks if "outside" in text] == [
        f"robots.abb.base.x_mm: {present:g} mm is outside its range 0 mm to 2000 mm: the search starts at 2000 mm"
    ]


@pytest.mark.parametrize("plane", ["xz", "yz"])
def test_mirrored_bases_are_mirror_images(cell: Cell, plane: str) -> None:
    sides = {"x_mm": [-3000, 3000], "y_mm": [-3000, 3000], "z_mm": [0, 600], "yaw_deg": [-180, 180]}
    mirror = {"bases": ["kuka.base", "abb.base"], "plane": plane, "at_mm": 100}
    both = {"vary": {"kuka.base": sides, "abb.base": sides}, "mirrored": [mirror]}
    variables = Variables.of(cell.with_values({"layout": both}))
    assert variables.names == tuple(f"robots.kuka.base.{key}" for key in sides)
    placed = variables.placed(some_values(variables, share=3.0))
    axis = 1 if plane == "xz" else 0
    M, mirrored = np.eye(4), np.diag([1.0, -1.0, 1.0, 1.0])
    M[axis, axis], M[axis, 3] = -1.0, 0.2
    yaw_only = placed.robot("kuka").X_WB
    assert np.abs(M @ yaw_only @ mirrored - placed.robot("abb").X_WB).max() <= 1e-12


def test_a_cost_is_that_of_all_that_moves(cell: Cell) -> None:
    settings = {
        "vary": {"kuka.base": {"z_mm": [0, 600], "yaw_deg": [-180, 180]}, "abb.base": {"z_mm": [0, 600]}},
        "equal": [["kuka.base.z_mm", "abb.base.z_mm"]],
        "cost": {"abb.base": 3, "kuka.base.yaw_deg": 2},
    }
    variables = Variables.of(cell.with_values({"layout": settings}))
    assert variables.cost * [0.1, np.radians(10.0)] == pytest.approx([4.0, 2.0])


def test_a_spin_is_a_tool_turned_the_other_way(cell: Cell) -> None:
    spun = cell.with_values({"tasks.circle.spin_deg": 40})
    kuka = cell.index("kuka")
    turned = Layouts.of([cell], start_of(cell)[None])
    turned.X_FT[0, kuka, :3, :3] = turned.X_FT[0, kuka, :3, :3] @ rotation_about(
        np.array([0.0, 0.0, 1.0]), -np.radians(40)
    )
    q = motion_of(cell, turned)
    of_spun = motion_of(spun, Layouts.of([spun], q[:1]))
    is_followed = np.isfinite(q).all(axis=1)  # the arms do not reach the end of the paths
    assert is_followed.sum() >= 10
    assert np.array_equal(np.isfinite(of_spun).all(axis=1), is_followed)
    assert np.abs(of_spun - q)[is_followed].max() <= 1e-9


def test_choices_keep_one_task_a_robot(cell: Cell) -> None:
    ranges = {
        "tasks.circle.robot": ["kuka", "abb", "staubli"],
        "tasks.rhombus.robot": ["abb", "kuka"],
        "motion.mode": ["simultaneous", "pairwise"],
        "abb.branch": True,
    }
    choices = Choices.of(cell.with_values({"layout.vary": ranges}))
    result = list(choices.values())
    assert choices.branches == ("abb",)
    swapped = {"tasks.circle.robot": "abb", "tasks.rhombus.robot": "kuka"}
    autos = {"robots.kuka.start_deg": "auto", "robots.abb.start_deg": "auto"}
    assert result == [
        {},
        {"motion.mode": "pairwise"},
        {**swapped, **autos},
        {**swapped, "motion.mode": "pairwise", **autos},
    ]
    assert [task.robot for task in cell.with_values(result[2]).tasks] == ["abb", "kuka", "staubli"]


def test_a_part_at_rest_elsewhere_is_the_robots_the_other_way() -> None:
    circle = {"radius_mm": 200, "center_mm": [1532.0508, 0], "plane": "xz"}
    plain = load_cell(CELLS / "papers" / "nicolato_circle.yaml").with_values({"tasks.circle.path": {"circle": circle}})
    start = start_of(plain)
    variables = Variables.of(
        plain.with_values({"layout.vary": {"part.at": {"x_mm": [-20000, 20000], "yaw_deg": [-180, 180]}}})
    )
    x = variables.given + np.array([-0.05, 0.1])
    q = motion_of(variables.base, variables.layouts(x[None], start[None]))
    written = variables.cell(x, q[0])
    assert np.abs(motion_of(written, Layouts.of([written], q[:1])) - q).max() <= 5e-6
    result = variables.directions(x)
    for column, unit in enumerate(STEP * np.eye(2)):
        X = [variables.layouts((x + sign * unit)[None], start[None]).X_WB[0, 0] for sign in (1.0, -1.0, 0.0)]
        assert np.abs(twist(*X) - result.base[0, :, column]).max() <= 1e-8


def test_sliding_joints_start_by_their_keys() -> None:
    plain = load_cell(CELLS / "rail.yaml")
    rail = next(robot for robot in plain.robots if any(not joint.is_revolute for joint in robot.model.joints))
    cell = plain.with_values({"layout": {"vary": {f"{rail.name}.start": {"rail_mm": [-1000, 1000]}}, "margin_mm": 30}})
    variables = Variables.of(cell)
    column = cell.columns(rail.name).start
    assert (variables.margin[column], variables.margin[column + 1]) == (0.03, 0.0)
    values = variables.values(np.array([-0.2345678]), np.zeros(cell.joint_count))
    assert values[f"robots.{rail.name}.start"]["rail_mm"] == -234.568  # type: ignore[index]


def test_a_column_never_vanishes(cell: Cell) -> None:
    ranges = {"kuka.base": {"z_mm": [0, 600]}, "abb.base": {"z_mm": [0, 600], "roll_deg": [-20, 20]}}
    variables = Variables.of(cell.with_values({"layout.vary": ranges}))
    assert variables.lower[0] == pytest.approx(0.001)
    lowest = variables.cell(np.array([variables.lower[0], variables.lower[1], np.radians(20.0)]), start_of(cell))
    assert all(robot.pedestal is not None and robot.pedestal.solid(robot.X_WB) is not None for robot in lowest.robots)
