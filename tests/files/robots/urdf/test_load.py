"""A URDF becomes joint axes and bodies at the zero configuration, and moves as pinocchio says."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from cellplan.errors import InputError
from cellplan.files.robots.limits import StatedLimits
from cellplan.files.robots.urdf.load import UrdfOptions, load_urdf, read_urdf
from cellplan.geometry.mesh.load import mesh_volume
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Sphere
from cellplan.geometry.transforms import Array, pose, pose_from, rotation_about
from cellplan.model.robot.robot import BASE, JointKind, RobotModel

LIMIT = '<limit lower="-1" upper="2" velocity="3" effort="0"/>'


def link(name: str, inside: str = "") -> str:
    return f'<link name="{name}">{inside}</link>\n'


def joint(name: str, parent: str, child: str, inside: str = LIMIT, *, kind: str = "revolute") -> str:
    if kind != "fixed" and "<axis" not in inside:
        inside += '<axis xyz="0 0 1"/>'
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>\n'


def collision(shape: str, origin: str = "") -> str:
    return f"<collision>{origin}<geometry>{shape}</geometry></collision>"


def write(folder: Path, *parts: str, name: str = "robot.urdf") -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'<?xml version="1.0"?>\n<robot name="rig">\n{"".join(parts)}</robot>\n', encoding="utf-8")
    return path


def arm(*extra: str) -> tuple[str, ...]:
    """Two links and one revolute joint, and whatever is added."""
    return (link("base"), link("tip"), joint("a1", "base", "tip"), *extra)


def write_box(path: Path, size: float = 0.2) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh.creation.box((size, size, size)).export(path)


def link_motions(model: RobotModel, q: Array) -> list[Array]:
    """Successive screw displacements of joints and followers."""
    positions = [*q, *(f.ratio * q[f.leader] + f.offset for f in model.followers)]
    motions: list[Array] = []
    for axis, position in zip([*model.joints, *model.followers], positions, strict=True):
        before = np.eye(4) if axis.parent == BASE else motions[axis.parent]
        R = rotation_about(axis.axis_B, position if axis.is_revolute else 0.0)
        shift = axis.point_B - R @ axis.point_B + (0.0 if axis.is_revolute else position) * axis.axis_B
        motions.append(before @ pose_from(R, shift))
    return motions


def test_rails_turns_slides_locks_and_mimics_move_as_pinocchio_says(tmp_path: Path) -> None:
    """A rail, a tilted turn, a slide, a fixed flange, a locked side arm with a mimic finger, and a mimic lever."""
    path = write(
        tmp_path,
        *(
            link(name, collision('<box size="0.1 0.2 0.3"/>', '<origin xyz="1 2 3" rpy=".1 .2 .3"/>'))
            for name in "abcdefgh"
        ),
        joint("rail", "a", "b", f'<origin xyz=".1 .2 .3" rpy="1 .2 .3"/><axis xyz="0 3 4"/>{LIMIT}', kind="prismatic"),
        joint("turn", "b", "c", f'<origin xyz="0 .5 .3" rpy="0 1.5 .3"/><axis xyz="1 -2 .5"/>{LIMIT}'),
        joint("slide", "c", "d", f'<origin xyz="0 .1 .2"/>{LIMIT}', kind="prismatic"),
        joint("mount", "d", "e", '<origin xyz="0 0 .1" rpy="0 1 0"/>', kind="fixed"),
        joint("side", "c", "f", f'<origin rpy="0 0 1"/><axis xyz="0 1 0"/>{LIMIT}'),
        joint("finger", "f", "g", '<mimic joint="side" multiplier="-2" offset=".3"/><axis xyz="0 0 1"/>' + LIMIT),
        joint(
            "lever",
            "f",
            "h",
            '<origin xyz=".3 0 0"/><axis xyz="0 1 1"/><mimic joint="turn" multiplier="-.5" offset=".2"/>'
            '<limit lower="-9" upper="9" velocity="9" effort="0"/>',
        ),
    )
    ours = read_urdf(path, UrdfOptions(flange="e", locked={"side": 0.4}))
    theirs = pin.buildModelFromUrdf(str(path))
    shapes = pin.buildGeomFromUrdf(theirs, str(path), pin.GeometryType.COLLISION)
    data, shape_data = theirs.createData(), shapes.createData()

    assert ours.joint_names == ("rail", "turn", "slide")
    assert [joint.kind for joint in ours.joints] == [JointKind.PRISMATIC, JointKind.REVOLUTE, JointKind.PRISMATIC]
    assert [joint.parent for joint in ours.joints] == [BASE, 0, 1]
    assert [(f.name, f.leader, f.parent) for f in ours.followers] == [("lever", 1, 1)]
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = rng.uniform(-1, 2, 3)
        values = {"rail": q[0], "turn": q[1], "slide": q[2], "side": 0.4, "finger": -0.5, "lever": -0.5 * q[1] + 0.2}
        full = np.array([values[name] for name in list(theirs.names)[1:]])
        pin.framesForwardKinematics(theirs, data, full)
        pin.updateGeometryPlacements(theirs, data, shapes, shape_data)
        motions = link_motions(ours, q)
        flange = data.oMf[theirs.getFrameId("e")].homogeneous
        # tolerance: rounding of a handful of matrix products
        assert np.abs(motions[ours.flange_link] @ ours.X_BF - flange).max() < 1e-12
        for body in ours.bodies:
            placed = body.X_BS if body.link == BASE else motions[body.link] @ body.X_BS
            truth = shape_data.oMg[shapes.getGeometryId(f"{body.name}_0")].homogeneous
            assert np.abs(placed - truth).max() < 1e-12, body.name


def test_primitive_shapes_keep_sizes_origins_and_get_unique_names(tmp_path: Path) -> None:
    shapes = [
        collision('<box size=".1 .2 .3"/>', '<origin xyz="1 2 3" rpy="0 0 1"/>'),
        *(collision(text) for text in ('<cylinder radius=".1" length=".5"/>', '<sphere radius=".2"/>')),
        collision('<capsule radius=".1" length=".4"/>'),
    ]
    model = read_urdf(write(tmp_path, link("base", "".join(shapes)), *arm()[1:], link("base_2")[:0]))

    assert [body.name for body in model.bodies] == ["base", "base_2", "base_3", "base_4"]
    assert [body.shape for body in model.bodies] == [
        *(Box((0.1, 0.2, 0.3)), Cylinder(0.1, 0.5), Sphere(0.2), Capsule(0.1, 0.4)),
    ]
    assert np.array_equal(model.bodies[0].X_BS, pose([1, 2, 3], [0, 0, 1]))
    assert {body.link for body in model.bodies} == {BASE}


def test_a_second_body_never_takes_the_name_of_a_link(tmp_path: Path) -> None:
    ball = collision('<sphere radius=".1"/>')
    model = read_urdf(write(tmp_path, link("arm", ball + ball), link("arm_2", ball), joint("a1", "arm", "arm_2")))

    assert [body.name for body in model.bodies] == ["arm", "arm_3", "arm_2"]


def test_limits_and_names_are_taken_over(tmp_path: Path) -> None:
    bare = joint("a1", "base", "tip").replace('<axis xyz="0 0 1"/>', "")
    model = read_urdf(write(tmp_path, *arm()[:2], bare), UrdfOptions(flange="tip"))

    assert (model.name, model.source, model.joint_names) == ("rig", "robot.urdf", ("a1",))
    assert (model.lower.tolist(), model.upper.tolist(), model.velocity.tolist()) == ([-1.0], [2.0], [3.0])
    assert model.joints[0].axis_B.tolist() == [1, 0, 0]  # the axis of a URDF joint that names none


def test_the_cell_tightens_and_supplies_limits(tmp_path: Path) -> None:
    def limits_of(inside: str, desired: StatedLimits, kind: str = "revolute") -> tuple[float, float, float]:
        path = write(tmp_path, link("base"), link("tip"), joint("a1", "base", "tip", inside, kind=kind))
        made = read_urdf(path, UrdfOptions(limits={"a1": desired})).joints[0]
        return made.lower, made.upper, made.velocity

    assert limits_of(LIMIT, StatedLimits(lower=0.0)) == (0.0, 2.0, 3.0)
    assert limits_of(LIMIT, StatedLimits(upper=1.0, velocity=2.0)) == (-1.0, 1.0, 2.0)
    assert limits_of(LIMIT, StatedLimits(lower=-1.0 - 1e-12)) == (-1.0, 2.0, 3.0)  # rounding of degrees, clamped
    assert limits_of("", StatedLimits(lower=-1, upper=1, velocity=2)) == (-1.0, 1.0, 2.0)
    assert limits_of(
        '<limit lower="0" upper="0" velocity="0" effort="0"/>', StatedLimits(lower=-1, upper=1, velocity=2)
    ) == (*(-1.0, 1.0, 2.0),)
    assert limits_of(LIMIT, StatedLimits(lower=-9, upper=9), "continuous") == (-9.0, 9.0, 3.0)
    assert limits_of(LIMIT, StatedLimits(wraps=True), "continuous") == (-np.inf, np.inf, 3.0)


def test_the_cell_supplies_an_acceleration_limit(tmp_path: Path) -> None:
    path = write(tmp_path, *arm())
    desired = {"a1": StatedLimits(acceleration=5.0)}
    assert [joint.acceleration for joint in read_urdf(path, UrdfOptions(limits=desired)).joints][:1] == [5.0]


def test_a_follower_limits_its_leader(tmp_path: Path) -> None:
    mimic = '<mimic joint="a1" multiplier="-2" offset="1"/><limit lower="-2" upper="2" velocity="1" effort="0"/>'
    model = read_urdf(
        write(tmp_path, *arm(link("lever"), joint("l", "base", "lever", mimic))), UrdfOptions(flange="tip")
    )

    assert (model.joints[0].lower, model.joints[0].upper, model.joints[0].velocity) == (-0.5, 1.5, 0.5)


def test_the_flange_is_the_named_link_or_tool0_or_flange_or_the_only_moving_leaf(tmp_path: Path) -> None:
    def reach(*names: str, flange: str | None = None) -> float:
        ends = [
            link(name) + joint(f"to_{name}", "tip", name, f'<origin xyz="0 0 {i + 1}"/>', kind="fixed")
            for i, name in enumerate(names)
        ]
        foot = link("world") + joint("foot", "base", "world", "", kind="fixed")
        return float(read_urdf(write(tmp_path, *arm(*ends, foot)), UrdfOptions(flange=flange)).X_BF[2, 3])

    assert reach() == 0.0
    assert reach("flange", "tool0") == 2.0
    assert reach("flange", "camera") == 1.0
    assert reach("gripper") == 1.0
    assert reach("flange", "tool0", flange="tip") == 0.0
    with pytest.raises(InputError) as caught:
        reach("left", "right")
    assert str(caught.value) == "robot.urdf: flange: expected the name of a link, as it could be any of: left, right"


@pytest.mark.parametrize(
    "place", ["relative", "parent", "package dir", "package itself", "above", "own", "file", "absolute"]
)
def test_meshes_are_found_where_people_keep_them(tmp_path: Path, place: str) -> None:
    robot = tmp_path / "ws" / "my_arm" / "urdf" / "robot.urdf"
    mesh, uri, dirs = {
        "relative": (robot.parent / "m" / "box.stl", "m/box.stl", []),
        "parent": (robot.parent.parent / "m" / "box.stl", "../m/box.stl", []),
        "package dir": (tmp_path / "other" / "arm" / "box.stl", "package://arm/box.stl", [tmp_path / "other"]),
        "package itself": (
            tmp_path / "other" / "arm" / "box.stl",
            "package://arm/box.stl",
            [tmp_path / "other" / "arm"],
        ),
        "above": (tmp_path / "ws" / "sister" / "m" / "box.stl", "package://sister/m/box.stl", []),
        "own": (tmp_path / "ws" / "my_arm" / "m" / "box.stl", "package://my_arm/m/box.stl", []),
        "file": (robot.parent / "a box.stl", f"file://{robot.parent}/a%20box.stl", []),
        "absolute": (robot.parent / "box.stl", f"{robot.parent}/box.stl", []),
    }[place]
    write_box(mesh, 200.0)
    write(robot.parent, link("base", collision(f'<mesh filename="{uri}" scale="0.001 0.001 0.001"/>')), *arm()[1:])

    loaded = load_urdf(robot, UrdfOptions(package_dirs=tuple(dirs)))

    assert [path.resolve() for path in loaded.mesh_files] == [mesh]
    shape = loaded.model.bodies[0].shape
    assert isinstance(shape, Mesh)
    assert mesh_volume(shape) == pytest.approx(0.008, rel=1e-6)  # single precision in the file


def test_the_packages_of_the_cell_come_before_those_around_the_urdf(tmp_path: Path) -> None:
    robot = tmp_path / "ws" / "arm" / "robot.urdf"
    write_box(tmp_path / "ws" / "arm" / "box.stl", 0.1)
    write_box(tmp_path / "mine" / "arm" / "box.stl", 0.3)
    write(robot.parent, link("base", collision('<mesh filename="package://arm/box.stl"/>')), *arm()[1:])

    loaded = load_urdf(robot, UrdfOptions(package_dirs=(tmp_path / "mine",)))

    assert loaded.mesh_files == (tmp_path / "mine" / "arm" / "box.stl",)


def test_a_mesh_used_twice_is_read_once_and_mirrored_faces_still_look_outward(tmp_path: Path) -> None:
    write_box(tmp_path / "box.stl")
    text = "".join(
        collision(f'<mesh filename="box.stl" scale="{scale}"/>') for scale in ("1 1 1", "1 1 1", "-1 1 1", "2")
    )
    loaded = load_urdf(write(tmp_path, link("base", text), *arm()[1:]))

    shapes = [body.shape for body in loaded.model.bodies]
    assert loaded.mesh_files == (tmp_path / "box.stl",)
    assert shapes[0] is shapes[1]
    assert [mesh_volume(s) for s in shapes if isinstance(s, Mesh)] == pytest.approx(
        [0.008, 0.008, 0.008, 0.064], rel=1e-6
    )


def test_a_link_without_collision_is_represented_by_what_is_drawn(tmp_path: Path) -> None:
    visual = '<visual><geometry><box size="1 2 3"/></geometry></visual>'
    hidden = visual + collision('<sphere radius=".5"/>')
    model = read_urdf(write(tmp_path, link("base", visual), link("tip", hidden), joint("a1", "base", "tip")))

    assert [body.shape for body in model.bodies] == [Box((1.0, 2.0, 3.0)), Sphere(0.5)]


def test_foreign_elements_and_text_encodings_do_no_harm(tmp_path: Path) -> None:
    extras = (
        '<transmission name="t"><joint name="a1"><hardwareInterface>x</hardwareInterface></joint></transmission>'
        '<gazebo reference="tip"><link name="ghost"><collision/></link></gazebo><material name="grün"/>'
        '<ros2_control name="c" type="system"><joint name="a1"/></ros2_control>'
    )
    inertial = '<inertial><mass value="1"/></inertial><contact><lateral_friction value="1"/></contact>'
    dynamics = LIMIT + '<dynamics damping="1"/><safety_controller k_velocity="1"/><calibration rising="0"/>'
    parts = (link("foot"), link("tip", inertial), joint("a1", "foot", "tip", dynamics), extras)
    plain = read_urdf(write(tmp_path, *parts))
    path = tmp_path / "latin.urdf"
    text = f'<?xml version="1.0" encoding="iso-8859-1"?><robot name="rig">{"".join(parts)}</robot>'
    path.write_bytes(text.encode("latin-1"))

    assert plain.joint_names == read_urdf(path).joint_names == ("a1",)


def test_reading_the_same_file_twice_gives_the_same_numbers(shared_robots: Path) -> None:
    path = shared_robots / "abb_irb2400_12_155" / "abb_irb2400_12_155.urdf"
    one, two = read_urdf(path), read_urdf(path)

    for a, b in zip(one.bodies, two.bodies, strict=True):
        assert np.array_equal(a.X_BS, b.X_BS)
        assert isinstance(a.shape, Mesh)
        assert isinstance(b.shape, Mesh)
        assert np.array_equal(a.shape.vertices, b.shape.vertices)
        assert np.array_equal(a.shape.faces, b.shape.faces)


def test_a_quaternion_turns_as_the_angles_do(tmp_path: Path) -> None:
    """URDF 1.1 has ``quat_xyzw`` in place of ``rpy``: of joints and of bodies."""
    rpy, xyz = np.array([0.3, -0.4, 2.0]), np.array([0.1, 0.2, 0.3])
    quaternion = pin.Quaternion(pin.rpy.rpyToMatrix(rpy)).coeffs()
    turned = " ".join(f"{value:.17g}" for value in quaternion)
    origin = f'<origin xyz="0.1 0.2 0.3" quat_xyzw="{turned}"/>'
    path = write(
        tmp_path,
        link("base", collision('<box size="1 2 3"/>', origin)),
        link("tip"),
        joint("a1", "base", "tip", origin + LIMIT),
    )
    model = read_urdf(path)

    assert np.abs(model.X_BF - pose(xyz, rpy)).max() < 1e-15  # rounding
    assert np.abs(model.bodies[0].X_BS - pose(xyz, rpy)).max() < 1e-15


@pytest.mark.parametrize(
    ("origin", "message"),
    [
        ('rpy="0 0 0" quat_xyzw="0 0 0 1"', "expected either 'rpy' or 'quat_xyzw' in <origin>, got both"),
        ('quat_xyzw="0 0 0 2"', "expected 'quat_xyzw' of length 1, got one of length 2"),
        ('quat_xyzw="0 0 1"', "expected 4 finite numbers in 'quat_xyzw', got '0 0 1'"),
        ('quat_xyz="0 0 0 1"', "unknown attribute 'quat_xyz' in <origin>, did you mean 'quat_xyzw'?"),
    ],
)
def test_a_quaternion_that_is_none_is_refused(tmp_path: Path, origin: str, message: str) -> None:
    path = write(tmp_path, *arm()[:2], joint("a1", "base", "tip", f"<origin {origin}/>{LIMIT}"))
    with pytest.raises(InputError) as caught:
        read_urdf(path)
    assert str(caught.value) == f"robot.urdf:5: joint 'a1': {message}"
