"""Times of transfers: near those of straight moves in closed form, and no time where nothing moves."""

import numpy as np

from cellplan.planning.timing.retime import JointLimitsInTime
from cellplan.planning.transfer.straight_time import box_widths
from cellplan.search.programs.transfers import HOME, NORM, Transfers

JOINTS = 6
STEP = 0.01  # [s]
BOUNDS = JointLimitsInTime(
    velocity=np.linspace(1.0, 3.0, JOINTS), acceleration=np.linspace(4.0, 9.0, JOINTS), jerk=np.full(JOINTS, np.inf)
)


class _Nothing:
    """Bodies that are never near each other."""

    most_demanded = 0.0
    demands = np.zeros(0)

    def near(self, x: object, q: object, within: float) -> "_Nothing":
        return self

    rows, distances = np.zeros(0, dtype=int), np.zeros(0)


def _seconds(begin: np.ndarray, end: np.ndarray) -> float:
    ends = np.array([[np.zeros(JOINTS)], [np.ones(JOINTS)]], dtype=int)
    bodies: tuple = (_Nothing(),)
    transfers = Transfers(
        parts=(slice(0, 1), slice(1, 2)),
        ends=ends,
        home=np.zeros(JOINTS),
        of=np.zeros(1, dtype=int),
        bounds=BOUNDS,
        step=STEP,
        stays=np.zeros(1),
        bodies=bodies,
        detours=np.ones(1),
    )
    return transfers.seconds(np.zeros(2), np.array([begin, end]))


def test_a_transfer_lasts_at_least_as_long_as_a_straight_move_and_little_longer() -> None:
    for move in np.random.default_rng(3).normal(size=(50, JOINTS)):
        true = box_widths(move, BOUNDS, least=STEP).sum()
        assert true <= _seconds(np.zeros(JOINTS), move) <= JOINTS ** (1.0 / NORM) * true + 1e-12


def test_robots_that_stay_where_they_are_need_no_time() -> None:
    assert _seconds(np.ones(JOINTS), np.ones(JOINTS)) == 0.0


def test_one_motion_has_no_transfers() -> None:
    transfers = Transfers.none(JOINTS, nodes=4)
    q, dq = np.ones((4, JOINTS)), np.ones((4, JOINTS, 2))
    assert transfers.seconds(np.zeros(2), q) == 0.0
    assert np.array_equal(transfers.derivatives(np.zeros(2), q, dq), np.zeros(2))
    assert HOME not in range(len(q))
