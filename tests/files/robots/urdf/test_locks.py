"""Joints off the chain and limits that a URDF lacks: all of them in one message, whose cure works as it is pasted."""

import dataclasses
import functools
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from builders.urdf_texts import ARM, joint, refused
from hypothesis import given
from hypothesis import strategies as st

from cellplan.errors import InputError, InvalidFileError
from cellplan.files.cell.write import render_cell
from cellplan.files.robots.limits import LIMIT_TOL, StatedLimits
from cellplan.files.robots.urdf.document.document import UrdfJoint, UrdfLimit, read_document
from cellplan.files.robots.urdf.load import UrdfOptions, load_urdf, read_urdf
from cellplan.files.robots.urdf.locks import lock_positions, rest_position
from cellplan.files.yaml.reader import parse_yaml
from cellplan.model.cell.cell import Cell
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.units import Deg, Mm

Load = Callable[..., Cell]


def limit(lower: float, upper: float, speed: float = 1.0) -> str:
    return f'<limit lower="{lower!r}" upper="{upper!r}" velocity="{speed!r}"/>'


def ball(name: str) -> str:
    shape = '<origin xyz="0.1 0 0"/><geometry><sphere radius="0.01"/></geometry>'
    return f'<link name="{name}"><collision>{shape}</collision></link>'


HANDED = (
    *ARM,
    *('<link name="tool0"/>', joint("m", "tip", "tool0", "", kind="fixed")),
    *(ball("f"), joint("finger", "tip", "f", limit(0.0, 0.05), kind="prismatic")),
    *(ball("h"), joint("head", "base", "h", limit(0.1, 0.5))),
    *(ball("n"), joint("nod", "h", "n", '<mimic joint="head" multiplier="-2" offset=".3"/>' + limit(-1.0, 1.0))),
    *(ball("w"), joint("wing", "base", "w", limit(-0.3, -0.02), kind="prismatic")),
)  # elements in lines 2 to 13
HELD = "finger_mm: 0, head_deg: 5.729578, wing_mm: -20"
BARE = (
    *('<link name="base"/>', '<link name="a"/>', '<link name="b"/>', '<link name="tool0"/>'),
    joint("j1", "base", "a", limit(0.0, 0.0, 0.0)),
    joint("j2", "a", "b", '<limit velocity="1"/>', kind="continuous"),
    joint("no", "b", "tool0", "", kind="prismatic"),
)


def write(folder: Path, *lines: str) -> Path:
    path = folder / "r.urdf"
    path.write_text("\n".join(['<robot name="rig">', *lines, "</robot>"]), encoding="utf-8")
    return path


def places(model: RobotModel) -> np.ndarray:
    return np.array([body.X_BS for body in model.bodies])


def worker(key: str) -> tuple[tuple[str, str], tuple[str, str]]:
    """Changes of the small cell: its worker becomes the robot of the file, with one more key."""
    return ("model: abb_irb1600", "model: r.urdf"), ("    weights: [1, 1, 1, 1, 1, 1]", f"    {key}")


def test_one_message_lists_every_joint_to_be_locked_within_its_limits(tmp_path: Path) -> None:
    assert refused(tmp_path, *HANDED) == (
        "r.urdf:8: 3 joints move, but are not between the base and the flange 'tool0': "
        f"hold them still with `locked: {{{HELD}}}` or with `locked: {{others: zero}}`, "
        "at zero or at the nearest position within their limits"
    )


def test_joints_that_are_locked_already_are_repeated_in_the_message(tmp_path: Path) -> None:
    message = refused(tmp_path, *HANDED, options=UrdfOptions(locked={"wing": -0.1, "head": math.radians(12.5)}))

    assert "r.urdf:8: joint 'finger': moves, but is not between" in message
    assert "`locked: {wing_mm: -100, head_deg: 12.5, finger_mm: 0}`" in message


def test_both_cures_of_the_message_work_as_they_are_pasted(load: Load, tmp_path: Path) -> None:
    write(tmp_path, *HANDED)
    with pytest.raises(InvalidFileError) as caught:
        load(*worker("flange: tool0"))
    cures = re.findall("`(locked: [^`]*)`", str(caught.value))

    named, together = (load(*worker(cure)).robot("worker").model for cure in cures)

    assert cures == [f"locked: {{{HELD}}}", "locked: {others: zero}"]
    assert named.joint_names == together.joint_names == ("a1",)
    assert np.allclose(places(named), places(together), rtol=0.0, atol=LIMIT_TOL)


def test_the_others_rest_at_the_nearest_position_and_their_mimics_follow(tmp_path: Path) -> None:
    path = write(tmp_path, *HANDED)

    together = read_urdf(path, UrdfOptions(locks_others=True))
    named = read_urdf(path, UrdfOptions(locked={"finger": 0.0, "head": 0.1, "wing": -0.02}))
    head, nod = (next(body for body in together.bodies if body.name == name) for name in "hn")

    assert np.array_equal(places(together), places(named))
    assert together.followers == ()
    turned = math.atan2(*np.linalg.multi_dot([head.X_BS[:3, :3].T, nod.X_BS[:3, :3]])[1::-1, 0])
    assert turned == pytest.approx(-2 * 0.1 + 0.3, abs=1e-12)  # about z, the axis of both


def test_a_joint_that_is_named_keeps_its_position_beside_the_others(tmp_path: Path) -> None:
    path = write(tmp_path, *HANDED)

    made = read_urdf(path, UrdfOptions(locks_others=True, locked={"finger": 0.01}))
    named = read_urdf(path, UrdfOptions(locked={"finger": 0.01, "head": 0.1, "wing": -0.02}))

    assert np.array_equal(places(made), places(named))


def test_a_robot_without_joints_off_the_chain_may_lock_the_others_all_the_same(tmp_path: Path) -> None:
    assert read_urdf(write(tmp_path, *ARM), UrdfOptions(locks_others=True)).joint_names == ("a1",)


def test_a_joint_may_be_called_others(load: Load, tmp_path: Path) -> None:
    lines = [line.replace('"head"', '"others"') for line in HANDED]
    write(tmp_path, *lines)

    named, both = (
        load(*worker(f"locked: {text}")).robot("worker").model
        for text in (
            "{finger_mm: 0, others_deg: 20, wing_mm: -20}",
            "{others: zero, others_deg: 20}",
        )
    )

    assert np.array_equal(places(named), places(both))


ENDS = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0)).filter(lambda ends: ends[0] + 1e-12 < ends[1])


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], UrdfJoint]:
    """The joint of an arm that has only one, by its kind."""
    folder = tmp_path_factory.mktemp("single")

    @functools.cache
    def read(kind: str) -> UrdfJoint:
        path = write(folder, *ARM[:2], joint("a1", "base", "tip", kind=kind))
        return read_document(path).joints["a1"]

    return read


@given(ENDS, st.sampled_from(["revolute", "prismatic"]))
def test_the_number_of_a_lock_reads_back_within_the_limits(
    single: Callable[[str], UrdfJoint], ends: tuple[float, float], kind: str
) -> None:
    """However near to each other the limits are; and nothing within them is nearer to zero by more than rounding."""
    lower, upper = ends
    made = dataclasses.replace(single(kind), limit=UrdfLimit(lower=lower, upper=upper))

    (value,) = lock_positions([made], {}).values()
    read = (Deg if kind == "revolute" else Mm)(value).si

    assert lower <= read <= upper
    assert abs(read) - (0.0 if lower <= 0.0 <= upper else min(abs(lower), abs(upper))) < 2.0 * LIMIT_TOL
    assert rest_position(made) == min(max(0.0, lower), upper)


def test_a_hundred_joints_are_read_when_all_but_the_chain_are_locked(tmp_path: Path) -> None:
    chain = [joint(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(6)]
    spikes = [joint(f"s{i}", "l0", f"k{i}") for i in range(100)]
    links = [f'<link name="{name}"/>' for name in (*(f"l{i}" for i in range(7)), *(f"k{i}" for i in range(100)))]
    path = write(tmp_path, *links, *chain, *spikes)

    model = read_urdf(path, UrdfOptions(flange="l6", locks_others=True))

    assert model.joint_names == tuple(f"j{i}" for i in range(6))


def test_one_message_lists_every_limit_to_be_stated(tmp_path: Path) -> None:
    assert refused(tmp_path, *BARE) == (
        'r.urdf:6: 3 joints lack limits (j1: states lower="0.0" upper="0.0" and states velocity="0.0"; '
        "j2: is continuous; no: states no limits): state limits in the cell, with a number for each …: "
        "`limits: {j1: {lower_deg: …, upper_deg: …, velocity_deg_s: …}, j2: {lower_deg: …, upper_deg: …}, "
        '"no": {lower_mm: …, upper_mm: …, velocity_mm_s: …}}`; '
        "a continuous joint turns without end with `wrap: true` in place of its lower and upper limit"
    )


def test_joints_that_lack_the_same_are_listed_together(tmp_path: Path) -> None:
    still = limit(-1.0, 1.0, 0.0)
    lines = [*BARE[:4], joint("j1", "base", "a", still), joint("j2", "a", "b"), joint("j3", "b", "tool0", still)]

    assert '2 joints lack limits (j1, j3: states velocity="0.0"):' in refused(tmp_path, *lines)


def test_the_limits_of_the_message_work_once_they_are_filled_in(load: Load, tmp_path: Path) -> None:
    message = refused(tmp_path, *BARE)
    text = re.findall("`(limits: [^`]*)`", message)[0]
    filled = text.replace("lower_deg: …", "lower_deg: -90").replace("lower_mm: …", "lower_mm: 0").replace("…", "60")

    model = load(*worker(filled)).robot("worker").model

    assert parse_yaml(text.encode(), file="c").findings == ()
    assert np.rad2deg(model.upper[:2]) == pytest.approx([60.0, 60.0])
    assert model.velocity == pytest.approx([math.radians(60.0), 1.0, 0.06])


def test_a_limit_that_was_not_filled_in_is_found_where_it_stands(load: Load, tmp_path: Path) -> None:
    write(tmp_path, *BARE)
    with pytest.raises(InvalidFileError) as caught:
        load(*worker("limits: {j2: {lower_deg: …, upper_deg: 90}}"))

    text = "c:11: robots.worker.limits.j2.lower_deg: expected a number of degrees, got '…'"
    assert text in str(caught.value).splitlines()


def test_a_wrapping_joint_lacks_no_range(tmp_path: Path) -> None:
    limits = {
        "j1": StatedLimits(lower=-1.0, upper=1.0, velocity=1.0),
        "j2": StatedLimits(wraps=True),
        "no": StatedLimits(lower=0.0, upper=1.0, velocity=1.0),
    }
    assert np.isinf(read_urdf(write(tmp_path, *BARE), UrdfOptions(limits=limits)).upper).tolist() == [
        False,
        True,
        False,
    ]


def test_locks_and_limits_are_asked_for_at_once(tmp_path: Path) -> None:
    path = write(tmp_path, *HANDED[:2], joint("a1", "base", "tip", ""), *HANDED[3:])
    with pytest.raises(InputError) as caught:
        load_urdf(path)

    locks, limits = str(caught.value).splitlines()
    assert f"`locked: {{{HELD}}}`" in locks
    assert "r.urdf:4: joint 'a1': states no limits: " in limits


def test_a_written_cell_keeps_its_locks_and_single_ones_can_be_changed(load: Load, tmp_path: Path) -> None:
    write(tmp_path, *HANDED)
    cell = load(*worker("locked: {others: zero, finger_mm: 10}"))
    wider = cell.with_values({"robots.worker.locked.finger_mm": 20})
    only = load(*worker("locked: {finger_mm: 20, head_deg: 10, wing_mm: -20}"))
    mixed = only.with_values({"robots.worker.locked.others": "zero", "robots.worker.locked.head_deg": None})

    assert "    locked: {others: zero, finger_mm: 10}\n" in render_cell(cell)
    assert "    locked: {others: zero, finger_mm: 20}\n" in render_cell(wider)
    assert np.array_equal(places(mixed.robot("worker").model), places(wider.robot("worker").model))
    assert not np.array_equal(places(cell.robot("worker").model), places(wider.robot("worker").model))
