"""Denavit-Hartenberg frames from joint-axis tables: parallel, crossing, skew and opposite axes."""

import numpy as np
import pytest
from builders.jacobian_cells import model_of, planners_jacobian, with_operator
from builders.random_cells import random_cell, random_model

from cellplan.files.robots.joint_table import bundled_names, load_bundled
from cellplan.geometry.transforms import inverse, pose, rotation_about, rotation_vector
from cellplan.jobs.explain.derivations.denavit_hartenberg import dh_chain, dh_cooperation_jacobian, geometric_jacobian
from cellplan.model.cell.cell import Robot, Tool
from cellplan.scene.kinematics.screw_chain import ScrewChain

FLANGE = pose([0.4, -0.3, 0.9], [0.7, -0.2, 1.4])
POSE_TOL = 1e-12  # [m], [-] rounding of a dozen products over a few metres
AGREEMENT = 1e-11  # [-] of the largest entry


def second_opinion(model, q):
    """Flange in B by screw displacements."""
    robot = Robot(
        name="r", model=model, X_WB=np.eye(4), tool=Tool(X_FT=np.eye(4), bodies=()), start=None, weights=np.ones(0)
    )
    return ScrewChain(robot).flange_poses(q[None])[0]


def tilted(angle):
    """The z axis tilted about x."""
    return tuple(rotation_about(np.array([1.0, 0.0, 0.0]), angle) @ [0.0, 0.0, 1.0])


Z, X, Y = (0, 0, 1), (1, 0, 0), (0, 1, 0)
LAID = {
    "parallel": [("R", Z, (0, 0, 0)), ("R", Z, (0.5, 0.1, 0.2)), ("R", Z, (0.9, 0, -0.3))],
    "opposite": [("R", Z, (0, 0, 0)), ("R", (0, 0, -1), (0.5, 0.1, 0.2)), ("R", Z, (0.9, 0, 0))],
    "coincident": [("R", Z, (0, 0, 0)), ("R", Z, (0, 0, 0.4)), ("R", (0, 0, -1), (0, 0, 0.7))],
    "intersecting": [("R", Z, (0, 0, 0)), ("R", Y, (0, 0, 0.4)), ("R", X, (0, 0, 0.4))],
    "skew": [("R", Z, (0, 0, 0)), ("R", (1, 1, 0), (0.2, -0.4, 0.4)), ("R", (1, -2, 3), (0.6, 0.3, 0.9))],
    "sliding": [
        ("P", X, (9, 9, 9)),
        ("P", X, (0, 3, 0)),
        ("P", Y, (0, 0, 0)),
        ("R", Y, (1, 0, 0)),
        ("P", Z, (0, 0, 0)),
    ],
    "turn of rounding": [("R", Z, (0, 0, 0)), ("R", tilted(1e-12), (0.5, 0, 0)), ("R", Z, (0.9, 0, 0))],
    "tilt of a typing digit": [
        ("R", Z, (0, 0, 0)),
        ("R", tilted(1e-7), (0.5, 0, 0)),
        ("R", tilted(-3e-9), (0.9, 0, 0)),
    ],
    "tilt below the bound": [("R", Z, (0, 0, 0)), ("P", tilted(0.99e-3), (0.5, 0, 0)), ("R", X, (0.9, 0, 0))],
    "tilt above the bound": [("R", Z, (0, 0, 0)), ("R", tilted(1.01e-3), (0.5, 0.2, 0)), ("R", X, (0.9, 0, 0))],
    "nearly opposite": [("R", Z, (0, 0, 0)), ("R", tilted(np.pi - 1e-5), (0.5, 0, 0)), ("R", Y, (0.9, 0, 0))],
}


@pytest.mark.parametrize("axes", LAID.values(), ids=LAID.keys())
def test_frames_carry_the_flange_where_screw_displacements_do(axes):
    model = model_of(axes, FLANGE)
    chain = dh_chain(model)
    for q in [np.zeros(len(axes)), *np.random.default_rng(0).uniform(-3.0, 3.0, (5, len(axes)))]:
        np.testing.assert_allclose(chain.flange_pose(q), second_opinion(model, q), atol=POSE_TOL)


@pytest.mark.parametrize("axes", LAID.values(), ids=LAID.keys())
def test_the_jacobian_agrees_however_the_axes_lie(axes):
    cell = with_operator(random_cell(5, operators=1), model_of(axes, FLANGE))
    q = np.random.default_rng(1).uniform(-3.0, 3.0, cell.joint_count)

    J, planned = dh_cooperation_jacobian(cell, q), planners_jacobian(cell, q)

    assert np.abs(J - planned).max() <= AGREEMENT * np.abs(planned).max()


@pytest.mark.parametrize("axes", LAID.values(), ids=LAID.keys())
def test_every_frame_has_its_z_along_the_next_axis(axes):
    model = model_of(axes, FLANGE)
    frames = dh_chain(model).frames(np.zeros(len(axes)))
    for joint, X_BD in zip(model.joints, frames[:-1], strict=True):
        np.testing.assert_allclose(X_BD[:3, 2], joint.axis_B, atol=POSE_TOL)
        away = np.cross(joint.axis_B, X_BD[:3, 3] - joint.point_B)
        np.testing.assert_allclose(away, 0.0, atol=POSE_TOL)
    np.testing.assert_allclose(frames[-1][:3, 2], FLANGE[:3, 2], atol=POSE_TOL)


def test_the_flange_is_a_turn_about_and_a_slide_along_the_last_z():
    offset = dh_chain(model_of(LAID["skew"], FLANGE)).X_DF
    np.testing.assert_allclose(offset[:3, 2], [0, 0, 1], atol=POSE_TOL)
    np.testing.assert_allclose(offset[:2, 3], 0.0, atol=POSE_TOL)


def test_a_planar_arm_has_the_rows_of_the_textbook():
    """Link lengths 0.5, 0.4 and 0.2 m, nothing else; the bundled arm's flange looks down: the last twist is pi."""
    rows = dh_chain(load_bundled("planar_3r")).rows

    assert [row.a for row in rows] == pytest.approx([0.5, 0.4, 0.2], abs=POSE_TOL)
    assert [row.d for row in rows] == pytest.approx([0.0, 0.0, 0.0], abs=POSE_TOL)
    assert [row.theta for row in rows] == pytest.approx([0.0, 0.0, 0.0], abs=POSE_TOL)
    assert [row.alpha for row in rows] == pytest.approx([0.0, 0.0, np.pi], abs=POSE_TOL)


def test_the_rows_of_the_staubli_are_those_of_its_drawing():
    """Shoulder 420 mm up, upper arm 450 mm, forearm 650 mm, wrist 85 mm; all consecutive axes cross or are parallel."""
    chain = dh_chain(load_bundled("staubli_rx90l"))

    assert [abs(row.alpha) for row in chain.rows] == pytest.approx(
        [np.pi / 2, 0.0, np.pi / 2, np.pi / 2, np.pi / 2, 0.0], abs=1e-12
    )
    assert [row.a for row in chain.rows] == pytest.approx([0, 0.45, 0, 0, 0, 0], abs=POSE_TOL)
    assert abs(chain.rows[0].d) == pytest.approx(0.420 - 0.249, abs=POSE_TOL)  # from the point of the first axis
    assert abs(chain.rows[3].d) == pytest.approx(0.650, abs=POSE_TOL)
    assert chain.X_DF[2, 3] == pytest.approx(0.085, abs=POSE_TOL)


@pytest.mark.parametrize("name", bundled_names())
def test_bundled_arms_need_no_fifth_parameter(name):
    assert max(abs(row.beta) for row in dh_chain(load_bundled(name)).rows) < 1e-14  # rounding


@pytest.mark.parametrize("name", bundled_names())
def test_bundled_arms_stand_where_screw_displacements_put_them(name):
    model = load_bundled(name)
    chain = dh_chain(model)
    for q in np.random.default_rng(2).uniform(model.lower, model.upper, (5, len(model.joints))):
        np.testing.assert_allclose(chain.flange_pose(q), second_opinion(model, q), atol=POSE_TOL)


@pytest.mark.parametrize("with_follower", [False, True], ids=["plain", "follower"])
def test_the_geometric_jacobian_is_the_derivative_of_the_flange(with_follower):
    model = random_model(np.random.default_rng(3), 6, with_follower=with_follower)
    chain, q, h = dh_chain(model), np.random.default_rng(4).uniform(-2, 2, 6), 1e-5

    J_v, J_w = geometric_jacobian(chain, q)

    for joint, step in enumerate(h * np.eye(6)):
        ahead, behind = second_opinion(model, q + step), second_opinion(model, q - step)
        turn = rotation_vector((ahead @ inverse(behind))[:3, :3])
        np.testing.assert_allclose(J_v[:, joint], (ahead - behind)[:3, 3] / (2 * h), atol=1e-8)  # h^2 and eps / h
        np.testing.assert_allclose(J_w[:, joint], turn / (2 * h), atol=1e-8)
