"""Paths round the last joint of a holder in closed form, and how tools and welds lie while it turns."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan.geometry.transforms import pose
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.model.settings.task import WeldPositionEntry
from cellplan.model.settings.units import Deg
from cellplan.scene.scene import Scene
from cellplan.search.assign.problem.clearance import ScenesByRobot
from cellplan.search.assign.problem.goals import Stations, TaskGoal, task_goals
from cellplan.search.assign.problem.moving_blocks import MovingBlockSearch, joint_angles

DRUM = Path(__file__).resolve().parents[4] / "examples" / "open_tasks" / "drum.yaml"
LEVEL = WeldPositionEntry(slope_deg=(Deg(-1.0), Deg(1.0)), rotation_deg=(Deg(-1.0), Deg(1.0)))


@pytest.fixture(scope="module")
def draft() -> AssignmentDraft:
    return AssignmentDraft.load(DRUM)


@pytest.fixture(scope="module")
def ring(draft: AssignmentDraft) -> TaskGoal:
    return task_goals(draft.cell, draft.robots)[0]


def turned(goal: TaskGoal, X: np.ndarray) -> TaskGoal:
    return replace(goal, X_PT=X @ goal.X_PT)


def test_the_joint_turns_against_a_ring_and_as_far(draft: AssignmentDraft, ring: TaskGoal) -> None:
    angles, back = joint_angles(draft.cell, ring), joint_angles(draft.cell, replace(ring, X_PT=ring.X_PT[::-1]))

    assert angles is not None
    assert back is not None
    assert np.abs(np.abs(angles[1:-1]) - np.linspace(0.0, 2.0 * np.pi, len(angles) - 2)).max() < 1e-4
    assert (angles[0], angles[-1]) == (angles[1], angles[-2])
    assert np.abs(back + angles).max() < 1e-6


@pytest.mark.parametrize(("size", "is_coaxial"), [(0.0, True), (0.0005, True), (0.02, False)])
def test_a_ring_beside_the_axis_is_not_coaxial(
    draft: AssignmentDraft, ring: TaskGoal, size: float, is_coaxial: bool
) -> None:
    aside = turned(ring, pose(np.array([size, 0.0, 0.1]), np.zeros(3)))

    assert (joint_angles(draft.cell, aside) is not None) is is_coaxial


def test_a_tilted_ring_and_a_tool_that_keeps_its_heading_are_not_coaxial(
    draft: AssignmentDraft, ring: TaskGoal
) -> None:
    heading = ring.X_PT.copy()
    heading[:, :3, :3] = heading[:1, :3, :3]

    assert joint_angles(draft.cell, turned(ring, pose(np.zeros(3), np.radians([0.0, 10.0, 0.0])))) is None
    assert joint_angles(draft.cell, replace(ring, X_PT=heading)) is None


def test_a_tool_at_the_top_of_a_turning_drum_stays_upright_and_its_weld_level(
    draft: AssignmentDraft, ring: TaskGoal
) -> None:
    """At rest some of a ring is overhead at every pose; while the drum turns all of it is where its begin is."""
    angles = joint_angles(draft.cell, ring)
    assert angles is not None
    level = replace(ring, weld_position=LEVEL)
    begins = draft.stations().q
    rows = np.repeat(begins[:, None], len(angles), axis=1)
    rows[:, :, -1] += angles
    X_WP = Stations.of(draft.cell, rows.reshape(-1, 2)).X_WP.reshape(*rows.shape[:2], 4, 4)
    moving = Stations(holder="table", q=begins, X_WP=X_WP)

    assert not draft.stations().allowed(ring)[False].any()
    assert np.degrees(begins[moving.allowed(ring)[False], 1]).round().tolist() == [-180, -150, 150, 180]
    assert np.degrees(begins[moving.allowed(level)[False], 1]).round().tolist() == [-180, 180]


def test_candidates_have_a_turn_of_the_part_and_robots_that_stand_still(draft: AssignmentDraft) -> None:
    search = MovingBlockSearch(
        cell=draft.cell,
        goals=task_goals(draft.cell, draft.robots),
        stations=draft.stations(),
        spins=draft.spins(),
        scenes=ScenesByRobot(Scene.from_cell(draft.cell)),
        home=draft.home,
        conflict=0.05,
    )

    candidates = search.candidates()

    assert [len(it) for it in candidates] == sorted((len(it) for it in candidates), reverse=True)
    pairs = [it for it in candidates if len(it) == 2]
    assert pairs
    for pair in pairs:
        assert {option.mode.robot for option in pair} == {"north", "south"}
        for option in pair:
            assert abs(np.ptp(option.holder_q[:, -1]) - 2.0 * np.pi) < 1e-4
            assert np.ptp(option.q[1:-1], axis=0).max() < 0.01  # [rad] of an arm along the path
            assert np.array_equal(option.q[::-1] if option.is_reversed else option.q, option.mode.q)
