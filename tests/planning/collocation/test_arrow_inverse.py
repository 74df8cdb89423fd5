"""The inverse by blocks against the dense weighted pseudo-inverse."""

import numpy as np
import pytest

from cellplan.geometry.transforms import Array
from cellplan.planning.collocation.arrow_inverse import ArrowInverse, eliminated

LANES = 4


class RandomSystem:
    """Random blocks of an arrow-shaped Jacobian, their weights and the dense matrix."""

    def __init__(self, tasks: int, *, joints: int = 7, shared: int = 6, seed: int = 0) -> None:
        rng = np.random.default_rng(seed + tasks)
        self.A = rng.normal(size=(6, joints, tasks, LANES))
        self.C = rng.normal(size=(6, shared, tasks, LANES))
        self.mobility = rng.uniform(0.5, 2.0, size=(joints, tasks, 1))
        self.weights = rng.uniform(0.5, 2.0, size=shared)
        self.idle = np.zeros((6, tasks, 1))
        self.b = rng.normal(size=(6, tasks, LANES))

    def inverse(self) -> ArrowInverse:
        return ArrowInverse(
            self.A, self.C, mobility=self.mobility, coupling_weights=self.weights[:, None], idle=self.idle
        )

    def dense(self, lane: int) -> tuple[Array, Array]:
        """The matrix, shape (6 tasks, tasks own + shared), and the inverse weights of its columns."""
        tasks, joints = self.A.shape[2], self.A.shape[1]
        J = np.zeros((6 * tasks, tasks * joints + self.C.shape[1]))
        for t in range(tasks):
            rows = slice(6 * t, 6 * t + 6)
            J[rows, joints * t : joints * (t + 1)] = self.A[:, :, t, lane]
            J[rows, joints * tasks :] = self.C[:, :, t, lane]
        return J, np.concatenate([self.mobility[:, :, 0].T.ravel(), 1.0 / self.weights])

    def expected(self, lane: int) -> Array:
        r"""``W^{-1/2} (J W^{-1/2})^+ b``: the smallest weighted speeds."""
        J, mobility = self.dense(lane)
        root = np.sqrt(mobility)
        speeds: Array = root * (np.linalg.pinv(J * root, rcond=1e-9) @ self.b[:, :, lane].T.ravel())
        return speeds


def stacked(speeds: tuple[Array, Array], lane: int) -> Array:
    return np.concatenate([speeds[0][:, :, lane].T.ravel(), speeds[1][:, lane]])


def repeated(system: RandomSystem, times: int) -> tuple[Array, Array]:
    """Speeds with what the damping left of the twists added again and again, as Newton's method does."""
    inverse = system.inverse()
    local, shared = inverse.velocities(system.b)
    for _ in range(times):
        more = inverse.velocities(system.b - inverse.twists(local, shared))
        local, shared = local + more[0], shared + more[1]
    return local, shared


def assert_agrees(system: RandomSystem) -> None:
    """All that is added lies in the range of the pseudo-inverse: the limit is its own."""
    speeds = repeated(system, 2)
    for lane in range(LANES):
        np.testing.assert_allclose(stacked(speeds, lane), system.expected(lane), atol=1e-8, rtol=1e-8)


@pytest.mark.parametrize("tasks", [1, 2, 3, 7, 31])
@pytest.mark.parametrize("joints", [6, 7])
def test_speeds_are_those_of_the_weighted_pseudo_inverse(tasks: int, joints: int) -> None:
    assert_agrees(RandomSystem(tasks, joints=joints))


@pytest.mark.parametrize("lost", [1, 2])
@pytest.mark.parametrize("tasks", [2, 5])
def test_refined_speeds_lose_no_digit_where_operators_cannot_do_their_tasks_alone(tasks: int, lost: int) -> None:
    system = RandomSystem(tasks)
    system.A[:lost, :, 0] = 0.0  # only the shared joints move the first tool there
    for t in range(1, tasks):
        system.A[-1, :, t] = system.A[0, :, t]  # no own joint turns it but with its shift

    speeds = system.inverse().refined_velocities(system.b)

    for lane in range(LANES):
        expected = system.expected(lane)
        np.testing.assert_allclose(stacked(speeds, lane), expected, atol=1e-10 * np.abs(expected).max())


def test_far_from_a_singularity_one_step_is_enough() -> None:
    system = RandomSystem(3)
    for t in range(3):
        for lane in range(LANES):
            system.A[:, :, t, lane] = np.linalg.qr(system.A[:, :, t, lane].T)[0].T

    speeds = system.inverse().velocities(system.b)

    for lane in range(LANES):  # 1e-10 of the trace of some 50 that own and shared joints have together
        np.testing.assert_allclose(stacked(speeds, lane), system.expected(lane), atol=2e-8)


@pytest.mark.parametrize("shared", [0, 1, 3])
def test_a_positioner_may_have_few_joints_or_none(shared: int) -> None:
    assert_agrees(RandomSystem(3, shared=shared))


def test_joints_that_may_not_move_get_exactly_nothing() -> None:
    system = RandomSystem(3, joints=8)
    system.mobility[[1, 4], [0, 2]] = 0.0
    system.C[:, 2] = 0.0
    local, shared = system.inverse().velocities(system.b)

    assert not local[1, 0].any()
    assert not local[4, 2].any()
    assert not shared[2].any()
    assert_agrees(system)


def test_components_that_a_task_leaves_open_count_for_nothing() -> None:
    system = RandomSystem(2, joints=5)
    rows, tasks = np.array([0, 3, 5, 2]), np.array([0, 0, 0, 1])
    system.A[rows, :, tasks], system.C[rows, :, tasks], system.b[rows, tasks] = 0.0, 0.0, 0.0
    system.idle[rows, tasks] = 1.0
    assert_agrees(system)


def test_a_task_without_joints_of_its_own_is_done_by_the_positioner() -> None:
    """A task that carries the part: only the shared joints move its tool."""
    system = RandomSystem(2)
    system.mobility[:, 1] = 0.0
    system.A[:, :, 1] = 0.0

    np.testing.assert_allclose(system.inverse().twists(*repeated(system, 5)), system.b, atol=1e-9)


def test_blocks_that_lost_their_rank_are_made_up_for_by_the_positioner() -> None:
    """What the damping leaves goes away by repetition, so that the tasks are met."""
    system = RandomSystem(3)
    system.A[4, :, 0] = 2.0 * system.A[1, :, 0]
    system.A[:, 1:, 2] = system.A[:, :1, 2] * np.arange(1.0, 7.0)[None, :, None]
    system.b[:, 2] = (
        system.A[:, 0, 2] + system.C[:, 0, 2]
    )  # five ranks of this block are gone: not all twists can be had

    speeds = repeated(system, 8)

    np.testing.assert_allclose(system.inverse().twists(*speeds), system.b, atol=1e-8)
    assert max(np.abs(part).max() for part in speeds) < 1e3


def test_twists_are_those_of_the_dense_matrix() -> None:
    system, rng = RandomSystem(4), np.random.default_rng(1)
    local, shared = rng.normal(size=(7, 4, LANES)), rng.normal(size=(6, LANES))
    twists = system.inverse().twists(local, shared)
    for lane in range(LANES):
        J, _ = system.dense(lane)
        np.testing.assert_allclose(twists[:, :, lane].T.ravel(), J @ stacked((local, shared), lane), atol=1e-13)


@pytest.mark.parametrize("size", [0, 1, 3, 6])
def test_elimination_gives_the_inverse_of_the_cholesky_factor(size: int) -> None:
    rng = np.random.default_rng(size)
    G, B = rng.normal(size=(LANES, size, size + 2)), rng.normal(size=(size, 4, LANES))
    M = np.moveaxis(G @ np.swapaxes(G, 1, 2), 0, -1)

    result = eliminated(M, B)

    for lane in range(LANES):
        F = np.linalg.inv(np.linalg.cholesky(M[..., lane])) if size else np.zeros((0, 0))
        np.testing.assert_allclose(result[0][..., lane], F, atol=1e-9)
        np.testing.assert_allclose(result[1][..., lane], F @ B[..., lane], atol=1e-9)


def test_batch_entries_that_are_not_positive_are_no_numbers_and_leave_the_others_alone() -> None:
    M = np.stack([np.eye(3), -np.eye(3), 2.0 * np.eye(3)], axis=-1)
    with np.errstate(invalid="ignore"):
        result, _ = eliminated(M, M[:, :0])
    assert np.all(np.isnan(result[..., 1]).any(axis=0))
    np.testing.assert_allclose(result[..., 2], np.eye(3) / np.sqrt(2.0), atol=1e-15)
