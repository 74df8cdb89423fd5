"""Places in the common reach: by counting again, and the same when everything stands elsewhere."""

from pathlib import Path

import numpy as np
import pytest

from cellplan.geometry.arrays import Array
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.search.assign.problem.goals import task_goals
from cellplan.search.assign.problem.reach import AROUND, Reach, places_in_reach

OPEN = Path(__file__).resolve().parents[4] / "examples" / "open_tasks" / "open_frame.yaml"
PLACES = 3


@pytest.fixture(scope="module")
def given() -> AssignmentDraft:
    return AssignmentDraft.load(OPEN)


def turned(angles: Array) -> Array:
    """Poses of the part at the place of no robot, turned about the vertical."""
    X = np.tile(np.eye(4), (len(angles), 1, 1))
    X[:, 0, 0] = X[:, 1, 1] = np.cos(angles)
    X[:, 1, 0] = np.sin(angles)
    X[:, 0, 1] = -X[:, 1, 0]
    X[:, :3, 3] = [9.0, 9.0, 9.0]
    return X


def test_no_place_has_more_tasks_in_reach(given: AssignmentDraft) -> None:
    goals = task_goals(given.cell, given.robots)
    reach = {name: Reach.of(given.cell.robot(name)) for name in given.operators}
    poses = turned(np.array([0.0, 0.7, 2.0]))

    places = places_in_reach(given.cell, goals, poses, most=PLACES)

    assert places.shape == (3, PLACES, 3)
    middle = np.mean([it.centre for it in reach.values()], axis=0)
    every = [middle + np.array([x, y, z]) for x in AROUND for y in AROUND for z in AROUND]
    for X, best in zip(poses, places, strict=True):

        def tasks_within(place: Array, X: Array = X) -> int:
            count = 0
            for goal in goals:
                down = X[:3, :3] @ goal.X_PT[1:-1, :3, 2].T
                if goal.torch is not None and np.arccos(-down[2]).max() > goal.torch.within_deg.si + 1e-9:
                    continue
                tips = goal.X_PT[:, :3, 3] @ X[:3, :3].T + place
                for name in goal.robots:
                    far = np.linalg.norm(tips - reach[name].centre, axis=1)
                    count += bool(far.min() >= reach[name].nearest and far.max() <= reach[name].farthest)
            return count

        counts = [tasks_within(place) for place in best]
        assert counts == sorted(counts, reverse=True)
        assert counts[0] == max(tasks_within(place) for place in every) > 0


def test_the_reach_of_a_robot_goes_with_its_base(given: AssignmentDraft) -> None:
    robot = given.cell.robot("west")
    x, y, z = given.cell.origin.document["robots"]["west"]["base"]["xyz_mm"]

    moved = given.cell.with_values({"robots.west.base.xyz_mm": [x + 100.0, y, z - 200.0]}).robot("west")

    there, here = Reach.of(moved), Reach.of(robot)
    assert np.abs(there.centre - here.centre - [0.1, 0.0, -0.2]).max() < 1e-9
    assert there.farthest == pytest.approx(here.farthest, abs=1e-9)
    assert here.nearest < here.farthest < 3.0
