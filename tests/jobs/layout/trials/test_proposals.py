"""What the rounds of a layout search try depends on the finished rounds alone."""

from pathlib import Path
from typing import Any

from cellplan import LayoutRequest
from cellplan.jobs.layout.trials.prepared import NOT_FOLLOWED
from cellplan.jobs.layout.trials.proposals import SIZE, Proposal, Proposals, choice_text, origin_text
from cellplan.search.programs.objective import Objective
from cellplan.study.trial import StudyTrial, TrialOutcome, TrialStatus, Variant

REQUEST = LayoutRequest(cell=Path("cell.yaml"))


def ended(number: int, cycle: float, status: TrialStatus = TrialStatus.PASSED) -> StudyTrial:
    figures = {"cycle_s": cycle, "violation": 0.0, "x": [cycle], "start": [0.0]}
    return StudyTrial(variant=Variant(number, {"kind": "given"}), outcome=TrialOutcome(status=status, figures=figures))


def test_the_first_round_begins_with_the_given_layout_and_those_of_the_user() -> None:
    request = LayoutRequest(cell=Path("cell.yaml"), attempts=(Path("one.yaml"), Path("two.yaml")))

    kinds = [entry["kind"] for entry in Proposals(request=request)([])]

    assert kinds[:3] == ["given", "attempt", "attempt"]
    assert len(kinds) == SIZE


def test_every_combination_of_choices_is_tried_from_the_given_layout() -> None:
    choices = [{}, {"tasks.a.robot": "two", "robots.two.start_deg": "auto"}, {"tasks.a.robot": "three"}]
    proposals = Proposals(request=REQUEST, choices=choices)

    tried: list[dict[str, Any]] = []
    for _ in range(2):
        tried += proposals([ended(number, 1.0) for number in range(len(tried))])

    assert [entry["choice"] for entry in tried if entry["kind"] == "given"] == choices
    assert [entry["choice"] for entry in tried if entry["kind"] == "sampled"][:2] == choices[1:]
    assert len(tried) == 2 * SIZE
    assert [choice_text(choice) for choice in choices] == ["", "tasks.a.robot = two", "tasks.a.robot = three"]


def test_other_branches_are_tried_as_they_are() -> None:
    branches = [{"x": [0.5], "start": [1.0]}, {"x": [0.5], "start": [2.0]}]

    first = Proposals(request=REQUEST, branches=branches)([])

    assert [entry["start"] for entry in first if entry["kind"] == "branch"] == [[1.0], [2.0]]
    assert origin_text(Proposal(**first[1])) == "the given layout, another branch"


def test_later_rounds_go_on_from_the_best_trial_of_finished_rounds() -> None:
    finished = [ended(0, 2.0), ended(1, 1.0), ended(2, 0.5, TrialStatus.FAILED), ended(3, 3.0)]

    following = Proposals(request=REQUEST)(finished)

    assert (following[0]["kind"], following[0]["of"], following[0]["x"]) == ("perturbed", 1, [1.0])
    assert (following[1]["kind"], following[1]["of"]) == ("perturbed", None)
    assert {entry.get("give_up_above_s") for entry in following} == {1.25}
    assert Proposals(request=REQUEST)(finished) == following


def test_while_nothing_conforms_every_round_has_a_sample() -> None:
    failed = [ended(number, 2.0, TrialStatus.FAILED) for number in range(3 * SIZE)]

    rounds = [Proposals(request=REQUEST)(failed[: SIZE * count]) for count in (1, 2, 3)]

    assert ["sampled" in {entry["kind"] for entry in tried} for tried in rounds] == [True, True, True]
    assert not any("give_up_above_s" in entry for tried in rounds for entry in tried)


def test_another_seed_begins_a_search_for_any_conforming_layout_elsewhere() -> None:
    begins = [
        Proposals(request=LayoutRequest(cell=Path("cell.yaml"), objective=Objective.CONFORMING, seed=seed))([])[0]
        for seed in (0, 1)
    ]

    assert [begin["kind"] for begin in begins] == ["given", "perturbed"]


def test_where_the_given_layout_leads_nowhere_samples_take_its_place() -> None:
    lost = TrialOutcome(status=TrialStatus.NO_SOLUTION, reason=NOT_FOLLOWED, figures={})
    finished = [StudyTrial(variant=Variant(number, {"kind": "given"}), outcome=lost) for number in range(SIZE)]

    following = Proposals(request=REQUEST)(finished)

    assert [entry["kind"] for entry in following] == ["sampled"] * SIZE
    assert len({entry["index"] for entry in following}) == SIZE


def test_a_rejected_trial_is_not_built_on() -> None:
    finished = [ended(0, 2.0), ended(1, 1.0), ended(2, 1.5), ended(3, 3.0)]

    following = Proposals(request=REQUEST, rejected=frozenset({1}))(finished)

    assert following[0]["of"] == 2


def test_the_beginning_of_a_trial_in_words() -> None:
    more = Proposal(kind="improved", of=3, clearance_m=0.01, choice={"motion.mode": "part_at_rest"})

    assert origin_text(more) == "trial 3, 10 mm more clearance (motion.mode = part_at_rest)"
    assert origin_text(Proposal(kind="perturbed")) == "the given layout, perturbed"
