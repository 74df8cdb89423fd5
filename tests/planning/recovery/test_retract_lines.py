"""Straight lines of tools, by another kinematics than the one that plans them; rows along a path."""

import numpy as np
import pytest
from builders.transfer_cells import arm, scene_of

from cellplan.planning.recovery.retract import STEP, Lines
from cellplan.planning.recovery.rows_path import RowsPath, retract_rows, timed_rows
from cellplan.runs.plan.retiming import transfer_retimer
from cellplan.scene.kinematics.screw_chain import ScrewChain

BENT = np.array([0.2, -1.2, 1.4, 0.3, 0.8, -0.4])


@pytest.mark.parametrize("model", ["kuka_kr6", "ur10e", "staubli_rx160"])
def test_a_tool_goes_straight_and_does_not_turn(model: str) -> None:
    scene = scene_of(arm("arm", model))
    lines = Lines(scene.cell, BENT)
    chain = ScrewChain(scene.cell.robots[0])
    X_WT = chain.tool_poses(BENT[None])[0]

    for direction, words in lines.directions("arm"):
        line = lines.line("arm", direction, words, longest=0.1)
        assert line is not None
        X = chain.tool_poses(line.q)
        goals = X_WT[:3, 3] + (STEP * np.arange(len(line.q)))[:, None] * direction
        np.testing.assert_allclose(X[:, :3, 3], goals, atol=2e-7)  # what the steps of the search leave
        np.testing.assert_allclose(X[:, :3, :3], np.broadcast_to(X_WT[:3, :3], (len(X), 3, 3)), atol=2e-7)


def test_the_first_direction_is_backwards_along_the_tool() -> None:
    scene = scene_of(arm("arm", "ur10e"))
    direction, words = Lines(scene.cell, BENT).directions("arm")[0]

    X_WT = ScrewChain(scene.cell.robots[0]).tool_poses(BENT[None])[0]
    np.testing.assert_allclose(direction, -X_WT[:3, 2], atol=1e-12)
    assert words == "along its tool axis"


def test_a_line_ends_at_a_joint_limit() -> None:
    scene = scene_of(arm("arm", "kuka_kr6"))
    model = scene.cell.robots[0].model
    line = Lines(scene.cell, BENT).line("arm", np.array([0.0, 0.0, 1.0]), "upwards", longest=3.0)

    assert line is not None
    assert STEP * (len(line.q) - 1) < 3.0
    assert np.all((line.q >= model.lower) & (line.q <= model.upper))


def test_rows_along_a_path_keep_all_limits_and_its_ends() -> None:
    scene = scene_of(arm("arm", "ur10e"))
    retimer = transfer_retimer(scene)
    line = Lines(scene.cell, BENT).line("arm", np.array([0.0, 0.0, 1.0]), "upwards", longest=0.1)
    assert line is not None
    path = RowsPath(line.lengths, line.q)

    for rows in (retract_rows(path, retimer), timed_rows(path, retimer)):
        assert np.array_equal(rows[[0, -1]], line.q[[0, -1]])
        speeds = np.diff(rows, axis=0) / retimer.step
        assert np.all(np.abs(speeds) <= retimer.bounds.velocity * (1.0 + 1e-9))
        rest = np.zeros((1, 6))
        accelerations = np.diff(np.concatenate([rest, speeds, rest]), axis=0) / retimer.step
        assert np.all(np.abs(accelerations) <= 1.02 * retimer.bounds.acceleration)


def test_a_path_passes_through_its_rows_and_a_straight_one_is_straight() -> None:
    rng = np.random.default_rng(1)
    sigma, q = np.array([0.0, 0.3, 0.5, 1.1]), rng.normal(size=(4, 2))

    np.testing.assert_allclose(RowsPath(sigma, q).at(sigma), q, atol=1e-12)
    line = np.outer(sigma, [1.0, -2.0])
    at = np.linspace(0.0, 1.1, 23)
    np.testing.assert_allclose(RowsPath(sigma, line).at(at), np.outer(at, [1.0, -2.0]), atol=1e-12)
