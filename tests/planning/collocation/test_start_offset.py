"""A tool that starts beside its path comes to it smoothly, from rest to rest."""

from dataclasses import replace

import numpy as np
import pytest
from builders.lane_cells import CELLS, everyone, postures, relations, seen_poses

from cellplan.geometry.transforms import rotation_exp, rotation_vector
from cellplan.planning.collocation.batch_tasks import LaneTasks, Wanted
from cellplan.planning.collocation.start_offset import StartOffset, start_offset

ACCURACY = 1e-7
H = 1e-5  # [s]


def wanted_beside(name: str, distance: float) -> tuple[LaneTasks, Wanted, np.ndarray]:
    """Targets that turn and move evenly, beside the tools at first by so many metres and radians."""
    cell, rng = CELLS[name], np.random.default_rng(3)
    q = postures(cell, 1)
    X = seen_poses(cell, q.T)[0]
    count = len(X)
    R = rotation_exp(distance * rng.normal(size=(count, 3))) @ X[:, :3, :3]
    p = X[:, :3, 3] + distance * rng.normal(size=(count, 3))
    twists = rng.normal(size=(6, count, 1))
    tasks = LaneTasks(cell, relations(cell), everyone(cell))
    return tasks, Wanted(np.moveaxis(R, 0, -1)[..., None], p.T[..., None], twists), q[:, 0]


def found(name: str, distance: float, until: float = 0.5) -> tuple[LaneTasks, Wanted, np.ndarray, StartOffset | None]:
    tasks, wanted, start = wanted_beside(name, distance)
    count = wanted.p.shape[1]
    placement = tasks.chains.placement(CELLS[name])
    offset = start_offset(tasks, wanted, placement, start=start, until=np.full(count, until), accuracy=ACCURACY)
    return tasks, wanted, start, offset


def even(wanted: Wanted, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Targets that go on from the first with their twists."""
    twists = np.broadcast_to(wanted.twists, (*wanted.twists.shape[:2], len(t)))
    p = wanted.p + twists[:3] * t
    turn = rotation_exp(np.moveaxis(wanted.twists[3:] * t, 0, -1))
    return np.einsum("tbij,jkt->iktb", turn, wanted.R[..., 0]), p, twists


@pytest.mark.parametrize("name", CELLS)
@pytest.mark.parametrize("distance", [1e-5, 1e-2, 0.3])
def test_targets_begin_where_the_tools_are(name: str, distance: float) -> None:
    tasks, wanted, start, offset = found(name, distance)
    assert offset is not None

    moved = Wanted(*offset.applied(np.zeros(1), wanted.R, wanted.p, wanted.twists))

    placement = tasks.chains.placement(CELLS[name])
    assert np.abs(tasks.errors(start[:, None], moved, placement)).max() <= 0.1 * ACCURACY
    np.testing.assert_array_equal(moved.twists[:3], wanted.twists[:3])  # at rest beside the moving target


@pytest.mark.parametrize("name", ["plain", "spin", "partial", "world"])
def test_twists_are_the_derivatives_of_the_poses(name: str) -> None:
    _, wanted, _, offset = found(name, 0.3)
    assert offset is not None
    t = np.linspace(0.03, 0.47, 9)

    (R0, p0, _), (R, _, twists), (R1, p1, _) = (
        offset.applied(t + shift, *even(wanted, t + shift)) for shift in (-H, 0.0, H)
    )

    np.testing.assert_allclose((p1 - p0) / (2 * H), twists[:3], atol=1e-6)  # H^2 times the third derivative
    turn = np.einsum("ijtb,kjtb->tbik", R1, R0)
    np.testing.assert_allclose(np.moveaxis(rotation_vector(turn), -1, 0) / (2 * H), twists[3:], atol=1e-6)
    np.testing.assert_allclose(np.einsum("ijtb,ijtb->tb", R, R), 3.0, atol=1e-12)


def test_nothing_is_left_of_it_in_the_end() -> None:
    _, wanted, _, offset = found("mixed", 0.3)
    assert offset is not None
    t = np.array([0.5, 0.7])
    for before, after in zip(even(wanted, t), offset.applied(t, *even(wanted, t)), strict=True):
        np.testing.assert_allclose(after, before, atol=1e-14)


def test_tools_on_their_paths_need_none() -> None:
    assert found("plain", 1e-9)[-1] is None


def test_components_that_a_task_leaves_open_are_left_alone() -> None:
    _, _, _, offset = found("partial", 0.1)
    assert offset is not None
    for task, linear, angular in zip(CELLS["partial"].tasks, offset.linear.T, offset.angular.T, strict=True):
        error = np.concatenate([linear, angular])
        assert not error[[axis for axis in range(6) if axis not in task.axes]].any()
        assert error[list(task.axes)].all()


def test_each_task_has_its_own_time() -> None:
    _, wanted, _, offset = found("plain", 0.1)
    assert offset is not None
    offset = replace(offset, until=np.array([0.2, 0.8]))
    t = np.array([0.3])
    moved = offset.applied(t, *even(wanted, t))
    p = even(wanted, t)[1]
    assert np.array_equal(moved[1][:, 0], p[:, 0])
    assert np.linalg.norm(moved[1][:, 1] - p[:, 1]) > 0.01
