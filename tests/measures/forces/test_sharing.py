"""Holders of one part: balance, least norm, and internal forces of springs in series."""

from dataclasses import replace

import numpy as np
import pytest
from builders.random_cells import random_pose
from builders.scene_builders import held_part, make_cell, placed, schedule, slide_model

from cellplan.geometry.shapes import Box, Sphere
from cellplan.geometry.transforms import pose, skew
from cellplan.measures.forces.sharing import at_tip, closure_stiffness, grasp_matrix, load_shares, sharing_length
from cellplan.measures.forces.static_forces import force_report, static_forces
from cellplan.measures.tool_errors import closure_accuracy, part_poses
from cellplan.model.cell.cell import Grasp, Part
from cellplan.scene.kinematics.screw_chain import ScrewChain

SPRINGS = ((2.0e5, 3.0e4), (5.0e4, 8.0e3))  # [N/m] and [N m/rad] of two holders


def part_of(*grasps: Grasp) -> Part:
    return replace(held_part(Sphere(0.1), "h0", np.eye(4)), held_by=grasps)


def random_part(seed: int, holders: int, axes: tuple[int, ...] = (0, 1, 2, 3, 4, 5)) -> Part:
    rng = np.random.default_rng(seed)
    grasps = [Grasp(robot=f"h{k}", X_PT=random_pose(rng), axes=axes if k else tuple(range(6))) for k in range(holders)]
    return part_of(*grasps)


def force_and_moment(p, wrench):
    """Shift of a wrench from the origin to a point, by hand."""
    return np.concatenate([wrench[:3], wrench[3:] - np.cross(p, wrench[:3])])


@pytest.mark.parametrize("axes", [(0, 1, 2, 3, 4, 5), (0, 1, 2), (0, 1, 5)], ids=["rigid", "ball", "planar"])
def test_shares_add_up_and_no_holder_transmits_what_its_grasp_leaves_open(axes: tuple[int, ...]) -> None:
    part = random_part(1, 3, axes)

    shares = load_shares(part)

    assert shares.sum(axis=0) == pytest.approx(np.eye(6), abs=1e-12)
    free = [axis for axis in range(6) if axis not in axes]
    for grasp, share in zip(part.held_by[1:], shares[1:], strict=True):
        assert at_tip(grasp, share.T)[:, free] == pytest.approx(0.0, abs=1e-12)


def test_shares_have_the_least_weighted_norm_and_depend_on_no_unit() -> None:
    """Any internal wrench that is added makes the norm larger; in millimetres the shares are the same."""
    part, rng = random_part(2, 3), np.random.default_rng(2)
    load, length = rng.normal(size=6), sharing_length(part)
    tips = [at_tip(grasp, -share @ load) for grasp, share in zip(part.held_by, load_shares(part), strict=True)]
    G = np.hstack([grasp_matrix(grasp) for grasp in part.held_by])
    internal = np.linalg.svd(G)[2][6:]  # rows span the null space of G
    weights = np.tile([1.0, 1.0, 1.0, *(length**-2.0,) * 3], 3)

    f = np.concatenate(tips)

    assert G @ f + load == pytest.approx(np.zeros(6), abs=1e-12)
    assert internal @ (weights * f) == pytest.approx(np.zeros(12), abs=1e-9)
    in_mm = replace(part, held_by=tuple(replace(it, X_PT=it.X_PT * _to_mm()) for it in part.held_by))
    scale = np.repeat([1.0, 1e3], 3)
    assert load_shares(in_mm) == pytest.approx(load_shares(part) * np.outer(scale, 1.0 / scale))


def _to_mm():
    scale = np.ones((4, 4))
    scale[:3, 3] = 1e3
    return scale


def test_a_lever_is_shared_as_a_beam_on_two_supports_without_moments() -> None:
    """With balls at x = +-a a weight at x = c is borne as (a +- c) / 2a, the first holder's moment aside: none here."""
    a, c = 0.6, 0.2
    grasps = [Grasp(robot=f"h{k}", X_PT=pose((x, 0.0, 0.0)), axes=tuple(range(6))) for k, x in enumerate((-a, a))]
    far = part_of(*grasps)
    load = np.array([0.0, 0.0, -10.0, 0.0, 10.0 * c, 0.0])  # about the origin: r x f = (0, c * 10, 0)

    left, right = (at_tip(grasp, -share @ load) for grasp, share in zip(far.held_by, load_shares(far), strict=True))

    # of least norm with l = a: of the moment 2 a d + 2 m = 10 c the force d has the part a^2 / (a^2 + l^2) = 1 / 2
    assert sharing_length(far) == pytest.approx(a)
    assert left[2] == pytest.approx(5.0 - 10.0 * c / (4.0 * a))
    assert right[2] == pytest.approx(5.0 + 10.0 * c / (4.0 * a))
    assert (left[4], right[4]) == pytest.approx((-10.0 * c / 4.0,) * 2)


def test_internal_forces_of_two_holders_are_those_of_springs_in_series() -> None:
    """6 x 6 compliances in series, that of the first moved to the tip of the second."""
    rng = np.random.default_rng(3)
    first, second = (
        Grasp(robot=f"h{k}", X_PT=random_pose(rng), stiffness=stiffness) for k, stiffness in enumerate(SPRINGS)
    )
    part, error = part_of(first, second), rng.normal(size=6) * 1e-3
    motion = np.eye(6)  # of the tip of the second by one at the tip of the first
    motion[:3, 3:] = -skew(second.X_PT[:3, 3] - first.X_PT[:3, 3])
    C_1, C_2 = (np.diag(np.repeat([1.0 / force, 1.0 / moment], 3)) for force, moment in SPRINGS)

    stiffness = closure_stiffness(part)

    assert stiffness is not None
    expected = np.linalg.solve(C_2 + motion @ C_1 @ motion.T, error)
    assert at_tip(second, stiffness[1, 1] @ error) == pytest.approx(expected)
    assert stiffness[0, 1] @ error == pytest.approx(-stiffness[1, 1] @ error)  # no resultant: an internal force


def test_an_error_along_the_line_of_two_balls_meets_two_plain_springs() -> None:
    first = Grasp(robot="h0", X_PT=pose((-0.4, 0.0, 0.0)), stiffness=SPRINGS[0])
    second = Grasp(robot="h1", X_PT=pose((0.4, 0.0, 0.0)), axes=(0, 1, 2), stiffness=(SPRINGS[1][0], np.inf))

    stiffness = closure_stiffness(part_of(first, second))

    k_1, k_2 = SPRINGS[0][0], SPRINGS[1][0]
    assert stiffness is not None
    assert stiffness[1, 1] @ np.array([1e-3, 0, 0, 0, 0, 0]) == pytest.approx(
        [1e-3 * k_1 * k_2 / (k_1 + k_2), 0, 0, 0, 0, 0], abs=1e-9
    )


def test_many_holders_that_are_moved_together_exert_nothing() -> None:
    rng = np.random.default_rng(5)
    grasps = [Grasp(robot=f"h{k}", X_PT=random_pose(rng), stiffness=SPRINGS[k % 2]) for k in range(4)]
    stiffness, motion = closure_stiffness(part_of(*grasps)), rng.normal(size=6)
    assert stiffness is not None

    errors = np.stack([grasp_matrix(grasp).T @ motion for grasp in grasps])

    assert np.einsum("ijkl,jl->ik", stiffness, errors) == pytest.approx(0.0, abs=1e-7)
    assert closure_stiffness(part_of(*grasps[:3], replace(grasps[3], stiffness=None))) is None
    assert closure_stiffness(part_of(grasps[0])) is None


def test_forces_by_closure_errors_stand_in_the_report_and_a_stated_error_bounds_them() -> None:
    """Two slides along x hold a bar; the second is off its grasp by 0.1 mm along the bar in one row."""
    grasps = tuple(
        Grasp(robot=name, X_PT=pose((x, 0.0, 0.0)), stiffness=stiffness, closure_error=error)
        for name, x, stiffness, error in (("a", -0.5, SPRINGS[0], (0.0, 0.0)), ("b", 0.5, SPRINGS[1], (2e-4, 0.0)))
    )
    shape = Box((0.05, 0.05, 0.05))
    robots = [
        placed("a", slide_model(shape), base=pose((-0.5, 0, 0))),
        placed("b", slide_model(shape), base=pose((0.5, 0, 0))),
    ]
    cell = make_cell(*robots, part=replace(held_part(Box((1.0, 0.1, 0.1)), "a", np.eye(4)), held_by=grasps))
    chains = {robot.name: ScrewChain(robot) for robot in robots}
    q = {"a": np.zeros((3, 1)), "b": np.array([[0.0], [1e-4], [0.0]])}
    X_WP = part_poses(cell, chains, q)
    closures = closure_accuracy(cell, chains, q, X_WP)
    report = force_report(static_forces(cell, chains, schedule(3), q, X_WP, closures), chains, q)

    k = SPRINGS[0][0] * SPRINGS[1][0] / (SPRINGS[0][0] + SPRINGS[1][0])
    for holder in report.holders:
        assert holder.internal is not None
        assert holder.internal.force.size == pytest.approx(1e-4 * k)
        assert holder.internal.force.at_s == 0.5
        assert holder.internal.force_at_error == pytest.approx(2e-4 * k)  # the stiffest direction is along the bar
    for load in report.joints:
        assert load.by_closure == pytest.approx(2e-4 * k)
        assert not load.is_revolute
