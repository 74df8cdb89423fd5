"""Cell files: what is read from a sound one, and every finding about an unsound one, word for word."""

import math
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from builders.collada_texts import collada

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.geometry.shapes import Box, Capsule, Cylinder, HalfSpace, Mesh, Sphere
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell, Mode
from cellplan.model.task.task import CirclePath, Frame, PlaneName, PolygonPath, RunDirection, SampledPath, TimeLawKind
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.runs.overrides import with_overrides

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]

TETRAHEDRON = """\
v 0 0 0
v 100 0 0
v 0 100 0
v 0 0 100
f 1 3 2
f 1 2 4
f 2 3 4
f 1 4 3
"""


def test_the_base_cell_is_read_in_metres_and_radians(load: Load) -> None:
    cell = load()

    worker = cell.robot("worker")
    assert [robot.name for robot in cell.robots] == ["holder", "worker"]
    np.testing.assert_allclose(worker.X_WB, pose((2.0, 0.0, 0.0), (0.0, 0.0, math.pi)), atol=1e-15)
    np.testing.assert_allclose(worker.tool.X_FT, pose((0.0, 0.0, 0.1)))
    np.testing.assert_allclose(cell.robots[0].start, np.deg2rad([0, -93, 108, 0, -15, 0]))
    assert worker.start is None
    assert cell.positioners == ("holder",)
    assert cell.part.shape == Cylinder(0.25, 0.5)
    np.testing.assert_array_equal(cell.part.X_PS[:3, 2], [1.0, 0.0, 0.0])
    assert cell.part.X_WP is None
    assert isinstance(cell.obstacles[0].shape, HalfSpace)
    task = cell.task("ring")
    assert task.path == CirclePath(plane=PlaneName.XY, center=(0.0, 0.0), radius=0.1)
    assert task.tool_axis is None
    assert (task.start, task.duration, task.feed, task.blend) == (0.0, None, None, None)
    assert task.axes == (0, 1, 2, 3, 4, 5)
    assert task.tolerance.position_mm.si == pytest.approx(1e-4)
    assert cell.motion.mode is Mode.SIMULTANEOUS
    assert (cell.motion.duration, cell.motion.step) == (4.0, 0.001)
    assert (cell.solver.gain, cell.solver.damping, cell.solver.seed) == (500.0, "auto", 0)
    assert (cell.checks.clearance_mm.si, cell.checks.contact_zone_mm.si) == (0.005, 0.02)


def test_the_cell_remembers_its_lines_and_the_digests_of_its_files(load: Load) -> None:
    cell = load()

    assert cell.origin.at("robots.worker.weights") == "c:11: robots.worker.weights"
    assert cell.origin.at("motion.step_s") == "c:21: motion.step_s"
    ring = cell.task("ring")
    assert ring.where("path") == cell.origin.at("tasks.ring.path")
    assert ring.where() == cell.origin.at("tasks.ring")
    assert ring.where().startswith("c:")
    assert "origin" not in repr(ring)
    assert list(cell.inputs) == ["bundled:abb_irb1600", "bundled:kuka_kr6", "c"]
    assert all(len(digest) == 64 for digest in cell.inputs.values())


@pytest.mark.parametrize("file", ["four_robots.yaml", "four_robots_initial.yaml"])
def test_the_shipped_cells_load(cells: Path, file: str) -> None:
    cell = load_cell(cells / file)

    assert [task.name for task in cell.tasks] == ["circle", "rhombus", "rectangle"]
    assert cell.joint_count == 24


def test_tool_shapes_end_at_the_tip(load: Load) -> None:
    for words, shape, back in (
        ("cylinder: {radius_mm: 15, length_mm: 80}", Cylinder(0.015, 0.08), 0.04),
        ("capsule: {radius_mm: 10, length_mm: 80}", Capsule(0.01, 0.06), 0.04),
        ("capsule: {radius_mm: 10, length_mm: 20}", Sphere(0.01), 0.01),
        ("box: {size_mm: [10, 20, 80]}", Box((0.01, 0.02, 0.08)), 0.04),
        ("sphere: {radius_mm: 10}", Sphere(0.01), 0.01),
    ):
        tool = load(("{xyz_mm: [0, 0, 100]}", f"{{xyz_mm: [0, 0, 100], geometry: {{{words}}}}}")).robot("worker").tool
        assert tool.bodies[0].name == "tool"
        assert tool.bodies[0].shape == shape
        np.testing.assert_allclose(tool.bodies[0].X_BS, pose((0.0, 0.0, 0.1 - back)), atol=1e-15)


def test_tool_bodies_are_numbered_and_placed_in_the_flange_frame(load: Load) -> None:
    words = (
        "{geometry: {sphere: {radius_mm: 10}}, bodies: [{cylinder: {radius_mm: 5, length_mm: 9, axis: y}, "
        "at: {xyz_mm: [0, 0, 30]}}]}"
    )

    tool = load(("{xyz_mm: [0, 0, 100]}", words)).robot("worker").tool

    assert [body.name for body in tool.bodies] == ["tool", "tool_2"]
    np.testing.assert_array_equal(tool.bodies[1].X_BS[:3, 2], [0.0, 1.0, 0.0])
    np.testing.assert_array_equal(tool.bodies[1].X_BS[:3, 3], [0.0, 0.0, 0.03])


def test_planar_paths_start_where_the_interface_says(load: Load) -> None:
    circle = "circle: {radius_mm: 100, plane: xy}"

    rectangle = load((circle, "rectangle: {sides_mm: [40, 20], plane: xy, center_mm: [5, 0], angle_deg: 90}"))
    rhombus = load((circle, "rhombus: {diagonals_mm: [40, 20], plane: xz}"))

    path = rectangle.tasks[0].path
    assert isinstance(path, PolygonPath)
    assert path.is_closed
    corners = [(-0.005, 0.02), (-0.005, -0.02), (0.015, -0.02), (0.015, 0.02)]  # (+, +) turned by a quarter
    np.testing.assert_allclose(path.corners, corners, atol=1e-15)
    path = rhombus.tasks[0].path
    assert isinstance(path, PolygonPath)
    assert path.plane is PlaneName.XZ
    np.testing.assert_allclose(path.corners, [(0.02, 0), (0, 0.01), (-0.02, 0), (0, -0.01)], atol=1e-15)


def test_closed_shapes_start_where_they_are_reported_and_run_as_they_are_reported(load: Load) -> None:
    circle = "circle: {radius_mm: 100, plane: xy}"

    started = load((circle, "circle: {radius_mm: 100, plane: yz, direction: clockwise, start_at: -z}")).tasks[0].path
    rectangle = load((circle, "rectangle: {sides_mm: [4, 2], plane: xy, start_at: [-1, 1]}")).tasks[0].path
    rhombus = load((circle, "rhombus: {diagonals_mm: [4, 2], plane: xz, start_at: -z, angle_deg: 90}")).tasks[0].path

    assert isinstance(started, CirclePath)
    assert (started.start, started.direction) == ((0.0, -1.0), RunDirection.CLOCKWISE)
    assert isinstance(rectangle, PolygonPath)
    assert rectangle.corners == ((-0.002, 0.001), (-0.002, -0.001), (0.002, -0.001), (0.002, 0.001))
    assert isinstance(rhombus, PolygonPath)
    np.testing.assert_allclose(rhombus.corners[0], (0.001, 0.0), atol=1e-15)  # the lower corner, turned by a quarter


def test_task_settings_override_those_of_the_motion(load: Load) -> None:
    task = load(
        (
            "tool_axis: normal",
            "feed_mm_s: 50\n    time_law: {trapezoid: {ramp: 0.3}}\n    corners: {blend_mm: 2}\n"
            "    start_s: 1\n    tool_turn_deg: 90\n    free: [spin]\n    axes: [rz, x]\n    tool_x: [0, 2, 0]",
        ),
        ("duration_s: 4", "duration_s: 4, time_law: constant, corners: stop"),
    ).tasks[0]

    assert (task.feed, task.duration, task.start, task.blend) == (0.05, None, 1.0, 0.002)
    assert (task.time_law.kind, task.time_law.ramp) == (TimeLawKind.TRAPEZOID, 0.3)
    assert task.turn == pytest.approx(math.pi / 2)
    assert task.is_spin_free
    assert task.axes == (0, 5)
    np.testing.assert_array_equal(task.tool_x, [0.0, 1.0, 0.0])


def test_a_task_without_a_duration_fills_the_clock_after_its_start(load: Load) -> None:
    (task,) = load(("tool_axis: normal", "start_s: 1.5")).tasks

    assert (task.duration, task.time_for_path(4.0)) == (None, 2.5)


def test_a_clock_without_a_length_follows_tasks_with_times_of_their_own(load: Load) -> None:
    cell = load(("{duration_s: 4}", "{step_s: 0.01}"), ("tool_axis: normal", "feed_mm_s: 50"))

    assert (cell.motion.duration, cell.tasks[0].feed) == (None, 0.05)


def test_a_cell_without_any_time_can_be_read_as_the_command_line_may_give_one(load: Load) -> None:
    cell = load(("{duration_s: 4}", "{step_s: 0.01}"))
    with pytest.raises(InputError, match=r"c:\d+: tasks\.ring: missing duration_s: expected duration_s or feed_mm_s"):
        schedule_tasks(cell, [build_toolpath(cell.tasks[0], cell.part)])

    cell = with_overrides(cell, duration=4.0)
    (ring,) = schedule_tasks(cell, [build_toolpath(cell.tasks[0], cell.part)]).tasks
    assert ring.end == 4.0


def test_position_only_work_off_the_surface_needs_no_tool_axis(load: Load) -> None:
    for plane, axis, x in (("xy", [0, 0, -1], [1, 0, 0]), ("yz", [-1, 0, 0], [0, 1, 0]), ("xz", [0, -1, 0], [1, 0, 0])):
        task = load(
            ("plane: xy}, project: +z", f"plane: {plane}}}, offset_mm: 10"), ("tool_axis: normal", "axes: [x, y]")
        ).tasks[0]
        np.testing.assert_array_equal(task.tool_axis, axis)
        np.testing.assert_array_equal(task.tool_x, x)
        assert task.plane_offset == 0.01


def test_a_fixed_part_stands_where_the_cell_says(load: Load) -> None:
    cell = load(("  held_by:\n    - {robot: holder, at: {xyz_mm: [-250, 0, 0]}}\n", "  at: {xyz_mm: [1000, 0, 500]}\n"))

    assert cell.positioners == ()
    assert cell.part.X_WP is not None
    np.testing.assert_array_equal(cell.part.X_WP[:3, 3], [1.0, 0.0, 0.5])


def test_limits_of_the_cell_tighten_those_of_the_model(load: Load) -> None:
    limits = "limits: {A3: {lower_deg: -10, upper_deg: 20, velocity_deg_s: 30}, B3: {upper_deg: 5}}"

    model = load(("weights: [1, 1, 1, 1, 1, 1]", limits)).robot("worker").model

    np.testing.assert_allclose(np.rad2deg([model.joints[0].lower, model.joints[0].upper]), [-10.0, 20.0])
    assert model.joints[0].velocity == pytest.approx(math.radians(30.0))
    assert model.joints[1].upper == pytest.approx(math.radians(5.0))
    assert model.joints[1].lower < 0.0


def test_acceleration_limits_of_the_cell_stand_in_for_those_that_a_model_lacks(load: Load, tmp_path: Path) -> None:
    limits = "limits: {A3: {acceleration_deg_s2: 400}}"
    assert load().robot("worker").model.joints[0].acceleration is None

    model = load(("weights: [1, 1, 1, 1, 1, 1]", limits)).robot("worker").model

    assert model.joints[0].acceleration == pytest.approx(math.radians(400.0))
    assert model.joints[1].acceleration is None


def test_acceleration_limits_of_the_cell_may_not_widen_those_of_the_model(
    load: Load, refuse: Refuse, tmp_path: Path
) -> None:
    (tmp_path / "rail.yaml").write_text(
        "robot: rail\njoints:\n"
        "  rail: {type: prismatic, axis: [1, 0, 0], lower_mm: 0, upper_mm: 3000, velocity_mm_s: 500, "
        "acceleration_mm_s2: 900}\n"
        "flange: {xyz_mm: [0, 0, 500]}\n",
        encoding="utf-8",
    )
    model, weights = ("model: abb_irb1600", "model: rail.yaml"), "weights: [1, 1, 1, 1, 1, 1]"

    joint = load(model, (weights, "limits: {rail: {acceleration_mm_s2: 600}}")).robot("worker").model.joints[0]
    reported = refuse(model, (weights, "limits: {rail: {acceleration_mm_s2: 1000}}"))

    assert joint.acceleration == pytest.approx(0.6)
    assert reported == [
        "c:11: robots.worker.limits.rail.acceleration_mm_s2: expected at most 900, the limit of the model, got 1000"
    ]


def test_meshes_and_toolpaths_below_the_cell_are_read_and_digested(load: Load, tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "part.obj").write_text(TETRAHEDRON, encoding="utf-8")
    (tmp_path / "path.csv").write_text("x_mm,y_mm,z_mm,i,j,k\n0,0,0,0,0,-1\n10,0,0,0,0,-1\n", encoding="utf-8")

    cell = load(
        ("{cylinder: {radius_mm: 250, length_mm: 500, axis: x}}", "{mesh: sub/part.obj, unit: mm}"),
        ("{circle: {radius_mm: 100, plane: xy}, project: +z}", "{csv: {file: path.csv, smooth: false}}"),
    )

    assert isinstance(cell.part.shape, Mesh)
    assert cell.part.shape.vertices.max() == pytest.approx(0.1)
    path = cell.tasks[0].path
    assert isinstance(path, SampledPath)
    assert not path.is_smooth
    assert {"sub/part.obj", "path.csv"} <= set(cell.inputs)


def test_a_part_drawn_in_collada_has_the_unit_and_the_up_axis_of_its_file(
    load: Load, refuse: Refuse, tmp_path: Path
) -> None:
    (tmp_path / "part.dae").write_text(collada(asset='<unit meter="0.01"/><up_axis>Y_UP</up_axis>'), encoding="utf-8")
    cylinder = "{cylinder: {radius_mm: 250, length_mm: 500, axis: x}}"

    shape = load((cylinder, "{mesh: part.dae}")).part.shape

    assert isinstance(shape, Mesh)
    assert np.ptp(shape.vertices, axis=0) == pytest.approx([0.003, 0.001, 0.002], abs=1e-9)
    assert shape.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-12)  # y of the file is up
    place = "c:13: part.geometry"
    assert refuse((cylinder, "{mesh: part.dae, unit: mm}")) == [
        f"{place}.mesh: part.dae: states a unit of 0.01 m, got unit: mm: leave out the unit"
    ]
    assert refuse((cylinder, "{mesh: part.stl}")) == [
        f"{place}.unit: missing, expected the unit of the mesh: mm, m or inch"
    ]


def test_an_open_part_is_refused(load: Load, tmp_path: Path) -> None:
    (tmp_path / "part.obj").write_text(TETRAHEDRON.replace("f 1 4 3\n", "f 1 2 3\n"), encoding="utf-8")

    with pytest.raises(InputError, match=r"part\.obj: "):
        load(("{cylinder: {radius_mm: 250, length_mm: 500, axis: x}}", "{mesh: part.obj, unit: mm}"))


def test_files_elsewhere_need_leave_also_through_links(load: Load, refuse: Refuse, tmp_path: Path) -> None:
    cell_folder, elsewhere = tmp_path / "cell", tmp_path / "elsewhere"
    cell_folder.mkdir()
    elsewhere.mkdir()
    (elsewhere / "part.obj").write_text(TETRAHEDRON, encoding="utf-8")
    (cell_folder / "link.obj").symlink_to(elsewhere / "part.obj")
    os.chdir(cell_folder)
    change = ("{cylinder: {radius_mm: 250, length_mm: 500, axis: x}}", "{mesh: link.obj, unit: mm}")

    assert refuse(change) == [
        "c:13: part.geometry.mesh: expected a path below the folder of the cell file, got 'link.obj'; "
        "allow other folders with --allow-dir"
    ]
    assert isinstance(load(change, allow_dirs=(elsewhere,)).part.shape, Mesh)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes in the file system")
def test_a_damaged_mesh_is_reported_with_the_line_that_names_it(refuse: Refuse, tmp_path: Path) -> None:
    (tmp_path / "part.stl").write_bytes(b"\x89PNG")

    reported = refuse(("{cylinder: {radius_mm: 250, length_mm: 500, axis: x}}", "{mesh: part.stl, unit: mm}"))

    assert [line.startswith("c:13: part.geometry.mesh: part.stl: expected ") for line in reported] == [True]


def test_a_pipe_named_as_mesh_is_refused(load: Load, refuse: Refuse, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "part.stl")

    reported = refuse(("{cylinder: {radius_mm: 250, length_mm: 500, axis: x}}", "{mesh: part.stl, unit: mm}"))

    assert reported == ["c:13: part.geometry.mesh: expected a regular file, got a folder, a pipe or a device"]


def test_a_rail_takes_its_start_by_name_and_unit(load: Load, refuse: Refuse, tmp_path: Path) -> None:
    (tmp_path / "rail.yaml").write_text(
        "robot: rail\njoints:\n"
        "  rail: {type: prismatic, axis: [1, 0, 0], lower_mm: 0, upper_mm: 3000, velocity_mm_s: 500}\n"
        "  turn: {type: revolute, axis: [0, 0, 1], point_mm: [0, 0, 0], lower_deg: -90, upper_deg: 90, "
        "velocity_deg_s: 90}\n"
        "flange: {xyz_mm: [0, 0, 500]}\n",
        encoding="utf-8",
    )
    model = ("model: abb_irb1600", "model: rail.yaml")
    weights = "weights: [1, 1, 1, 1, 1, 1]"

    start = load(model, (weights, "start: {turn_deg: 45, rail_mm: 500}")).robot("worker").start
    reported = refuse(model, (weights, "start_deg: [0, 0]"))

    np.testing.assert_allclose(start, [0.5, math.pi / 4])
    assert reported == [
        "c:11: robots.worker.start_deg: unexpected key, 'rail' is a prismatic joint: "
        "use start: {rail_mm: …, turn_deg: …}"
    ]


@pytest.mark.parametrize(
    ("folder", "joints"),
    [
        ("kuka_kr16_2", 6),
        ("abb_irb1600_8_145", 6),
        ("abb_irb2400_12_155", 6),
        ("staubli_rx160", 6),
        ("kuka_kr5_arc", 6),
    ],
)
def test_real_arms_load_from_their_urdf(
    load: Load, refuse: Refuse, shared_robots: Path, folder: str, joints: int
) -> None:
    urdf = shared_robots / folder / f"{folder}.urdf"
    model = ("model: abb_irb1600", f"model: {urdf}")

    cell = load(model, allow_dirs=(shared_robots,))
    reported = refuse(model)

    assert len(cell.robot("worker").model.joints) == joints
    assert str(urdf) in cell.inputs
    assert sum(name.endswith((".stl", ".STL", ".obj", ".dae")) for name in cell.inputs) > 0
    assert reported[0].startswith("c:8: robots.worker.model: expected a path below the folder of the cell file, got ")


def test_further_holders_may_leave_components_open(load: Callable[..., Cell]) -> None:
    cell = load(
        (
            "    - {robot: holder, at: {xyz_mm: [-250, 0, 0]}}",
            "    - {robot: holder, at: {xyz_mm: [-250, 0, 0]}}\n"
            "    - {robot: helper, at: {xyz_mm: [250, 0, 0]}, axes: [rz, x, y]}",
        ),
        ("part:\n", "  helper: {model: kuka_kr6}\npart:\n"),
        ("environment:", "checks: {closure_mm: 0.02, closure_deg: 0.5}\nenvironment:"),
    )
    assert cell.positioners == ("holder", "helper")
    assert [grasp.name for grasp in cell.closures] == ["helper@part"]
    assert cell.closures[0].axes == (0, 1, 5)
    assert cell.part.held_by[0].axes == (0, 1, 2, 3, 4, 5)
    assert [relation.name for relation in cell.relations] == ["ring", "helper@part"]
    assert cell.checks.closure_mm.si == pytest.approx(2e-5)
    assert cell.checks.closure_deg.si == pytest.approx(np.radians(0.5))


def test_the_first_holder_may_carry_the_part_along_a_path_in_the_world(load: Callable[..., Cell]) -> None:
    cell = load(
        ("    robot: worker", "    robot: holder\n    relative_to: world"),
        ("plane: xy}, project: +z}", "plane: xy}}"),
        ("    tool_axis: normal", "    tool_axis: -z"),
    )
    assert cell.task("ring").relative_to is Frame.WORLD
    assert cell.checks.closure_mm.si == 3e-6
