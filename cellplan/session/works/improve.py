"""Improve a cell from where it is: trials of a layout search for some seconds, each better one as it comes."""

import time
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.search import finish_of
from cellplan.jobs.layout.trials.prepared import PreparedSearch, prepared
from cellplan.jobs.layout.trials.proposals import Proposal, origin_text, proposals_of
from cellplan.jobs.layout.trials.trial import evaluate
from cellplan.jobs.repair.neat import changed_values
from cellplan.session.works.events import Send, progress_event, progress_of
from cellplan.session.works.request import require_inputs
from cellplan.study.trial import StudyTrial, Variant

WORK: Final = "improve"
BUDGET_S: Final = 10.0  # [s] after which no trial is begun


def improve(request: LayoutRequest, inputs: Mapping[str, str], seconds: float = BUDGET_S, *, send: Send) -> None:
    """Send every trial that is better than all before it: that misses less, or else has the shorter cycle.

    The trials are those of ``cellplan layout`` in their order; only how many there are depends on the time. They are
    planned at few nodes. The best one is finished as there at last: improved until solved motions pass all checks.

    Args:
        request: The cell and its settings.
        inputs: Digests of the files that the cell was read from.
        seconds: Time in [s] after which no trial is begun.
    """
    send(progress_event(WORK, 0.0, "making ready"))
    begun, ready = time.monotonic(), prepared(request)
    require_inputs(ready.cell, inputs)
    propose, finished, best = proposals_of(request, ready), list[StudyTrial](), _Best()
    while values := propose(finished):
        for number, value in enumerate(values, start=len(finished)):
            spent = time.monotonic() - begun
            if finished and spent > seconds:
                _finish(ready, best.trial, send)
                return
            text = f"trial {number}: {origin_text(Proposal(**value))}"
            send(progress_event(WORK, spent / seconds, text))
            variant = Variant(number, value)
            trial = StudyTrial(variant=variant, outcome=evaluate(request, variant))
            finished.append(trial)
            if best.is_replaced_by(trial):
                send({"event": "trial", "work": WORK, "text": _text(trial), "values": _values(request, trial)})


def _finish(ready: PreparedSearch, trial: StudyTrial | None, send: Send) -> None:
    """Finish the best trial, and send it once more where it passes."""
    if trial is None or not trial.passed:
        return
    finish = finish_of(ready, progress_of(WORK, send), workers=1)
    result = finish.certified(finish.ordered([trial])[0])
    if not result.passed:
        send(progress_event(WORK, 1.0, f"trial {trial.number} does not pass: {result.reason}"))
        return
    figures = f"cycle {result.cycle:.3f} s at full speed, margin {result.margin:.3g} deg"
    choice = Proposal.of_trial(trial).choice
    values = {**choice, **changed_values(prepared(ready.request, choice), result.x, result.start)}
    send({"event": "trial", "work": WORK, "text": f"trial {trial.number} finished: {figures}", "values": values})


class _Best:
    """The best trial so far."""

    def __init__(self) -> None:
        """Begin without one."""
        self.trial: StudyTrial | None = None
        self._rank = (np.inf, np.inf)

    def is_replaced_by(self, trial: StudyTrial) -> bool:
        """Whether a trial is better, and the best one from now on."""
        if is_better := (rank := _rank(trial)) < self._rank:
            self.trial, self._rank = trial, rank
        return is_better


def _rank(trial: StudyTrial) -> tuple[float, float]:
    """What is missed, and the cycle in [s]: the less the better; infinite without a motion."""
    figures: Mapping[str, Any] = trial.outcome.figures
    return (0.0 if trial.passed else figures["violation"], figures["cycle_s"]) if figures else (np.inf, np.inf)


def _text(trial: StudyTrial) -> str:
    """A trial in one line."""
    figures: Mapping[str, Any] = trial.outcome.figures
    known = [("margin", figures["margin_deg"], "deg"), ("clearance", figures["clearance_mm"], "mm")]
    parts = [f"cycle {figures['cycle_s']:.3f} s"]
    parts += [f"{name} {value:.3g} {unit}" for name, value, unit in known if value is not None]
    parts += [] if trial.passed else [trial.outcome.reason]
    return f"trial {trial.number}: {', '.join(parts)}; planned"


def _values(request: LayoutRequest, trial: StudyTrial) -> dict[str, object]:
    """What the trial changes, by address."""
    figures: Mapping[str, Any] = trial.outcome.figures
    proposal = Proposal.of_trial(trial)
    ready = prepared(request, proposal.choice, proposal.detours or ())
    return {**proposal.choice, **changed_values(ready, np.array(figures["x"]), np.array(figures["start"]))}
