"""Phases, plans and clocks: what they derive from roles and nominal times, and what they refuse."""

from dataclasses import replace

import numpy as np
import pytest

from cellplan.model.motion.motion import Clock, Motion
from cellplan.model.motion.plan import ALL_TASKS, Carry, Hold, Phase, Plan, Role, Transfer, Work, rows_of

ROLES: dict[str, Role] = {"arm": Work("cut"), "holder": Carry(), "other": Hold(at_home=True), "further": Hold()}
FIRST = Phase(name="cut", roles=ROLES, begin=0.0, end=0.2)
GAP = Phase(name="cut to weld", roles={"arm": Transfer("weld")}, begin=0.2, end=0.3, in_program=False)
SECOND = Phase(name="weld", roles={"other": Work("weld"), "arm": Hold(at_home=True)}, begin=0.3, end=0.5)
PLAN = Plan(phases=(FIRST, GAP, SECOND))
TIMES = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])


def test_roles_tell_who_works_moves_and_stands() -> None:
    assert (FIRST.tasks, FIRST.moving, FIRST.idle) == (("cut",), ("arm", "holder"), ("other",))
    assert [str(role) for role in ROLES.values()] == ["work: cut", "carry", "hold at home", "hold"]
    assert str(GAP.roles["arm"]) == "transfer: weld"


def test_a_phase_among_some_robots_keeps_the_order_of_roles() -> None:
    assert FIRST.among({"holder", "arm"}).moving == ("arm", "holder")
    assert FIRST.among({"further"}).tasks == ()


def test_only_the_only_phase_of_a_program_has_no_label() -> None:
    assert FIRST.label == "cut"
    assert replace(FIRST, name=ALL_TASKS).label is None


def test_the_rows_of_the_phases_and_their_gaps_follow_from_the_nominal_times() -> None:
    motion = Motion(times=TIMES, q=np.zeros((6, 1)), plan=PLAN)

    assert [motion.rows(phase) for phase in PLAN.program] == [slice(0, 3), slice(3, 6)]
    assert motion.gaps == {3: "cut to weld"}
    assert (PLAN.end, PLAN.phase("weld")) == (0.5, SECOND)
    assert rows_of(GAP, TIMES) == slice(2, 4)  # its ends are rows of its neighbours
    with pytest.raises(KeyError):
        PLAN.phase("grind")


def test_a_piece_has_the_phases_that_follow_one_another_without_a_gap() -> None:
    roles: dict[str, Role] = {"holder": Carry()}
    ends = {"a": (0.0, 1.0), "b": (1.0, 2.0), "b to c": (2.0, 3.0), "c": (3.0, 4.0)}
    phases = tuple(
        Phase(name=name, roles=roles, begin=begin, end=end, in_program=name != "b to c")
        for name, (begin, end) in ends.items()
    )
    motion = Motion(times=np.arange(5.0), q=np.zeros((5, 1)), plan=Plan(phases=phases))

    pieces = motion.pieces

    assert [piece.name for piece in pieces] == [None, "c"]
    assert [piece.rows for piece in pieces] == [slice(0, 3), slice(3, 5)]
    assert [[(place, phase.name, rows) for place, phase, rows in piece.phases] for piece in pieces] == [
        [(0, "a", slice(0, 2)), (1, "b", slice(1, 3))],
        [(2, "c", slice(0, 2))],
    ]


def test_phases_share_their_ends_and_do_not_end_before_they_begin() -> None:
    with pytest.raises(ValueError, match=r"plan: 'cut' ends at 0.2 s, 'weld' begins at 0.3 s"):
        Plan(phases=(FIRST, SECOND))
    with pytest.raises(ValueError, match=r"phase 'cut': ends at -1.0 s before it begins at 0.0 s"):
        replace(FIRST, end=-1.0)


def test_nominal_time_is_the_time_unless_it_is_given() -> None:
    assert Motion(times=TIMES, q=np.zeros((6, 1))).sigma is TIMES
    with pytest.raises(ValueError, match="motion: 2 nominal times for 6 times"):
        Motion(times=TIMES, q=np.zeros((6, 1)), sigma=TIMES[:2])


def test_a_clock_as_written_has_its_own_times_everywhere() -> None:
    clock = Clock.as_written(TIMES)

    assert clock.is_as_written
    assert clock.at(np.array([0.05, 0.42])) == pytest.approx([0.05, 0.42], abs=1e-15)


def test_a_dwell_keeps_the_nominal_time() -> None:
    clock = Clock(times=np.array([0.0, 1.0, 2.0, 3.0]), sigma=np.array([0.0, 0.5, 0.5, 1.5]))

    assert not clock.is_as_written
    assert clock.at(np.array([1.5, 2.5])) == pytest.approx([0.5, 1.0], abs=1e-15)


@pytest.mark.parametrize(
    ("times", "sigma", "message"),
    [
        ([0.0, 1.0], [0.0], "clock: \\(1,\\) nominal times for \\(2,\\) times"),
        ([0.0, np.nan], [0.0, 1.0], "a time is not finite"),
        ([0.0, 0.0], [0.0, 1.0], "expected times that increase from 0"),
        ([1.0, 2.0], [0.0, 1.0], "expected times that increase from 0"),
        ([0.0, 1.0, 2.0], [0.0, 1.0, 0.9], "expected a nominal time that starts at 0 and never decreases"),
        ([0.0, 1.0], [0.1, 1.0], "expected a nominal time that starts at 0 and never decreases"),
    ],
)
def test_a_clock_that_is_none_is_refused(times: list[float], sigma: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Clock(times=np.array(times), sigma=np.array(sigma))
