"""A tool that starts beside its path comes to it smoothly, from rest to rest."""

from dataclasses import replace

import numpy as np
import pytest
from builders.batch_cells import CELLS, configurations, everyone, relations, seen_poses

from cellplan.geometry.transforms import rotation_exp, rotation_vector
from cellplan.planning.collocation.batch_tasks import BatchTasks, Desired
from cellplan.planning.collocation.start_offset import StartOffset, start_offset

ACCURACY = 1e-7
H = 1e-5  # [s]


def desired_beside(name: str, distance: float) -> tuple[BatchTasks, Desired, np.ndarray]:
    """Targets that turn and move evenly, beside the tools at first by so many metres and radians."""
    cell, rng = CELLS[name], np.random.default_rng(3)
    q = configurations(cell, 1)
    X = seen_poses(cell, q.T)[0]
    count = len(X)
    X[:, :3, :3] = rotation_exp(distance * rng.normal(size=(count, 3))) @ X[:, :3, :3]
    X[:, :3, 3] += distance * rng.normal(size=(count, 3))
    twists = rng.normal(size=(6, count, 1))
    tasks = BatchTasks(cell, relations(cell), everyone(cell))
    return tasks, (np.moveaxis(X, 0, -1)[..., None], twists), q[:, 0]


def offset_of(
    name: str, distance: float, until: float = 0.5
) -> tuple[BatchTasks, Desired, np.ndarray, StartOffset | None]:
    tasks, desired, start = desired_beside(name, distance)
    count = desired[0].shape[2]
    placement = tasks.chains.placement(CELLS[name])
    offset = start_offset(tasks, desired, placement, start=start, until=np.full(count, until), accuracy=ACCURACY)
    return tasks, desired, start, offset


def even(desired: Desired, t: np.ndarray) -> Desired:
    """Targets that go on from the first with their twists."""
    X, V = (np.repeat(part, len(t), axis=-1) for part in desired)
    X[:3, 3] += V[:3] * t
    X[:3, :3] = np.einsum("tbij,jktb->iktb", rotation_exp(np.moveaxis(V[3:] * t, 0, -1)), X[:3, :3])
    return X, V


@pytest.mark.parametrize("name", CELLS)
@pytest.mark.parametrize("distance", [1e-5, 1e-2, 0.3])
def test_targets_begin_where_the_tools_are(name: str, distance: float) -> None:
    tasks, desired, start, offset = offset_of(name, distance)
    assert offset is not None

    X, V = offset.applied(np.zeros(1), *desired)

    placement = tasks.chains.placement(CELLS[name])
    assert np.abs(tasks.errors(start[:, None], X, placement)).max() <= 0.1 * ACCURACY
    np.testing.assert_array_equal(V[:3], desired[1][:3])  # at rest beside the moving target


@pytest.mark.parametrize("name", ["plain", "spin", "partial", "world"])
def test_twists_are_the_derivatives_of_the_poses(name: str) -> None:
    _, desired, _, offset = offset_of(name, 0.3)
    assert offset is not None
    t = np.linspace(0.03, 0.47, 9)

    (X0, _), (X, twists), (X1, _) = (offset.applied(t + shift, *even(desired, t + shift)) for shift in (-H, 0.0, H))

    R0, R, R1 = (entry[:3, :3] for entry in (X0, X, X1))
    np.testing.assert_allclose((X1[:3, 3] - X0[:3, 3]) / (2 * H), twists[:3], atol=1e-6)  # H^2
    turn = np.einsum("ijtb,kjtb->tbik", R1, R0)
    np.testing.assert_allclose(np.moveaxis(rotation_vector(turn), -1, 0) / (2 * H), twists[3:], atol=1e-6)
    np.testing.assert_allclose(np.einsum("ijtb,ijtb->tb", R, R), 3.0, atol=1e-12)


def test_nothing_is_left_of_it_in_the_end() -> None:
    _, desired, _, offset = offset_of("mixed", 0.3)
    assert offset is not None
    t = np.array([0.5, 0.7])
    for before, after in zip(even(desired, t), offset.applied(t, *even(desired, t)), strict=True):
        np.testing.assert_allclose(after, before, atol=1e-14)


def test_tools_on_their_paths_need_none() -> None:
    assert offset_of("plain", 1e-9)[-1] is None


def test_components_that_a_task_leaves_open_are_left_alone() -> None:
    _, _, _, offset = offset_of("partial", 0.1)
    assert offset is not None
    for task, linear, angular in zip(CELLS["partial"].tasks, offset.linear.T, offset.angular.T, strict=True):
        error = np.concatenate([linear, angular])
        assert not error[[axis for axis in range(6) if axis not in task.axes]].any()
        assert error[list(task.axes)].all()


def test_each_task_has_its_own_time() -> None:
    _, desired, _, offset = offset_of("plain", 0.1)
    assert offset is not None
    offset = replace(offset, until=np.array([0.2, 0.8]))
    t = np.array([0.3])
    moved = offset.applied(t, *even(desired, t))
    X = even(desired, t)[0]
    assert np.array_equal(moved[0][:, :, 0], X[:, :, 0])
    assert np.linalg.norm(moved[0][:3, 3, 1] - X[:3, 3, 1]) > 0.01
