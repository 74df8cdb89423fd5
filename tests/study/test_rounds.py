"""Studies in rounds: what decides a trial, where a study ends, accidents of trials and the status."""

import json
from collections.abc import Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from builders.study_trials import SIZE, InThisProcess, accident, from_the_best, halved, rounds

from cellplan.errors import InputError, StudyStoppedError
from cellplan.study.folder import AHEAD, JOURNAL
from cellplan.study.running import STATE, RunningState, running
from cellplan.study.status import Best, StudyStatus, read_status
from cellplan.study.study import Finished, Stop, StoppedBy
from cellplan.study.trial import StudyTrial, TrialOutcome, TrialStatus, Variant
from cellplan.study.workers import Limits, Workers

SHORT = Limits(seconds=0.5)
LENGTHS = [0.9, 0.95, 1 - 0.1 / 3, 0.975, 0.9 * 0.98, 0.9 * 0.9, 0.9 * 0.95]


def run(folder: Path, trials: int | None = None, *, seconds: float | None = None, **changed: Any) -> Finished:
    """A study in this process."""
    resume = changed.pop("resume", False)
    stop = Stop(trials=trials, seconds=seconds)
    return rounds(folder, **changed).run(halved, workers=InThisProcess(), stop=stop, resume=resume)


def journal(folder: Path) -> bytes:
    """The bytes of a journal."""
    return (folder / JOURNAL).read_bytes()


def test_a_round_begins_with_the_best_of_the_rounds_before(tmp_path: Path) -> None:
    finished = run(tmp_path / "study", 7)
    assert [trial.figures["length"] for trial in finished.trials] == pytest.approx(LENGTHS, rel=1e-15)
    assert [trial.variant.values["place"] for trial in finished.trials[:2]] == [[0, 1], [1, 1]]  # as they are read back
    assert (finished.rounds, finished.stopped_by) == (1, StoppedBy.TRIALS)
    assert json.loads(journal(tmp_path / "study").splitlines()[0])["best"] == {"figure": "length", "of": "smallest"}


class Deaf(InThisProcess):
    """Answers for the first trials only, and for none of the others ever."""

    def submit(self, function: Any, /, *arguments: Any, **named: Any) -> Future[Any]:
        return super().submit(function, *arguments, **named) if len(self.numbers) < 5 else Future()


def test_an_executor_that_does_not_answer_ends_the_study_and_what_is_recorded_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cellplan.study.workers.PATIENCE", 0.001)
    with pytest.raises(
        StudyStoppedError, match=r"^no trial has ended for 0\.3005 s, longer than one may take: .* --resume"
    ):
        rounds(tmp_path / "deaf").run(halved, workers=Deaf(), stop=Stop(trials=8), limits=SHORT)

    run(tmp_path / "deaf", 8, resume=True)
    run(tmp_path / "whole", 8)
    assert journal(tmp_path / "deaf") == journal(tmp_path / "whole")


def test_a_shorter_study_is_a_prefix_of_a_longer_one_and_can_be_continued_to_it(tmp_path: Path) -> None:
    run(tmp_path / "long", 30)
    whole = journal(tmp_path / "long")
    run(tmp_path / "short", 6)
    assert whole.startswith(journal(tmp_path / "short"))
    assert len(run(tmp_path / "short", 30, resume=True).trials) == 30
    assert journal(tmp_path / "short") == whole


def test_a_budget_ends_after_a_whole_round_and_its_number_of_trials_repeats_the_study(tmp_path: Path) -> None:
    finished = run(tmp_path / "budget", seconds=1e-9)
    assert (len(finished.trials), finished.rounds, finished.stopped_by) == (SIZE, 1, StoppedBy.BUDGET)
    run(tmp_path / "again", len(finished.trials))
    assert journal(tmp_path / "again") == journal(tmp_path / "budget")
    run(tmp_path / "longer", 12, seconds=1e9)
    assert journal(tmp_path / "longer").startswith(journal(tmp_path / "budget"))


def test_the_first_trial_that_is_enough_is_the_last_one(tmp_path: Path) -> None:
    def enough(trial: StudyTrial) -> bool:
        return trial.outcome.figures["length"] == pytest.approx(LENGTHS[5])

    for resume in (False, True):
        finished = run(tmp_path / "study", 30, enough=enough, resume=resume)
        assert (len(finished.trials), finished.stopped_by) == (6, StoppedBy.ENOUGH)
    run(tmp_path / "whole", 30)
    assert journal(tmp_path / "whole").startswith(journal(tmp_path / "study"))


@pytest.mark.parametrize(("count", "trials"), [(0, 4), (3, 7)])
def test_a_round_that_is_not_full_is_the_last_one(tmp_path: Path, count: int, trials: int) -> None:
    def propose(finished: Sequence[StudyTrial]) -> list[dict[str, object]]:
        return from_the_best(finished)[: count if finished else None]

    finished = run(tmp_path / "study", propose=propose)
    assert (len(finished.trials), finished.stopped_by) == (trials, StoppedBy.SEARCH)


@pytest.mark.slow
def test_accidents_are_failed_trials_with_their_reasons(tmp_path: Path) -> None:
    study = rounds(tmp_path / "study")
    with Workers(2, ("builders.study_trials",)) as workers:
        finished = study.run(accident, workers=workers, stop=Stop(trials=10), limits=SHORT)
    crashed = [trial for trial in finished.trials if trial.outcome.status is TrialStatus.CRASHED]
    assert {trial.number: trial.outcome.reason for trial in crashed} == {
        1: "ValueError: no good",
        2: "trial 2: its process crashed (exit status 5)",
        4: "trial 4: its process needed more than 16000 MB",
        5: "trial 5: its process crashed (SIGSEGV)",
        6: "trial 6: its process took longer than 0.5 s",
        8: "expected finite numbers and other plain data as its figures, got something else",
    }


@pytest.mark.slow
def test_accidents_are_the_same_for_one_worker(tmp_path: Path) -> None:
    for count in (1, 2, 4):
        with Workers(count) as workers:
            rounds(tmp_path / f"{count}").run(
                accident, workers=workers, stop=Stop(trials=10), limits=Limits(seconds=2.0)
            )
    assert journal(tmp_path / "1") == journal(tmp_path / "2") == journal(tmp_path / "4")


def test_an_evaluator_that_cannot_be_sent_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="expected a function of a module, bound to plain data"):
        rounds(tmp_path / "study").run(lambda variant: TrialOutcome(status=TrialStatus.PASSED, figures=variant.values))


def test_the_status_of_a_study_that_was_killed_counts_trials_that_wait_for_others(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    run(folder, 12)
    lines = journal(folder).splitlines(keepends=True)
    (folder / JOURNAL).write_bytes(b"".join(lines[:5]) + lines[5][:10])
    (folder / AHEAD).write_bytes(lines[6] + lines[7][:10])
    (folder / STATE).write_text('{"began": 0.0, "done_before": 0, "trials": 12, "budget": null}')
    status = read_status(folder)
    assert (status.done, status.trials, status.is_running, status.rate) == (5, 12, False, None)
    assert status.text() == "trial 5 of 12, best length 0.81"


def test_the_status_of_a_running_study_has_rate_and_time_left(tmp_path: Path) -> None:
    best = StudyTrial(variant=Variant(2, {}), outcome=TrialOutcome(status=TrialStatus.PASSED, figures={"length": 0.25}))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("time.time", lambda: 1050.0)
        state = RunningState(began=1000.0, done_before=5, trials=105, budget=None)
        status = StudyStatus.of(30, best, Best("length"), state, is_running=True)
    assert status.text("variant") == "variant 30 of 105, best length 0.25, 30/min, 2.5 min left"  # 25 in 50 s, 75 left
    assert (status.rate, status.seconds_left) == (0.5, 150.0)


def test_a_folder_that_a_study_writes_is_refused_to_another(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    run(folder, 4)
    with running(folder, RunningState(began=0.0, done_before=0, trials=None, budget=None)):
        assert read_status(folder).is_running
        with pytest.raises(InputError, match="another study is being written there; wait for it or choose another"):
            run(folder, 4)
    assert not read_status(folder).is_running
    assert len(journal(folder).splitlines()) == 5


def test_a_study_that_was_killed_at_its_very_start_is_continued(tmp_path: Path) -> None:
    (tmp_path / "study").mkdir()
    (tmp_path / "study" / STATE).write_text("{")
    (tmp_path / "study" / f".{JOURNAL}.draft").write_text("{")
    assert len(run(tmp_path / "study", 2, resume=True).trials) == 2
    with pytest.raises(InputError, match="expected the journal of a study, got none"):
        read_status(tmp_path)
