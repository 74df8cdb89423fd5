"""Status of a study that runs or has ended: trials done, the best so far, their rate and the time that is left."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

from cellplan.errors import InputError
from cellplan.study.folder import AHEAD, JOURNAL
from cellplan.study.journal import read_ahead, whole_lines
from cellplan.study.running import RunningState, read_state, seconds_since
from cellplan.study.trial import StudyTrial, TrialStatus

MINUTE: Final = 60.0  # [s]
HOUR: Final = 3600.0  # [s]


@dataclass(frozen=True, slots=True)
class Best:
    """What makes a trial that passed better than another."""

    figure: str  # name of the figure that is compared
    is_largest: bool = False  # whether the largest value is the best one; else the smallest

    @classmethod
    def from_header(cls, header: Mapping[str, Any]) -> Self | None:
        """What the header of a study says; None where it does not compare its trials."""
        best = header.get("best")
        return cls(str(best["figure"]), best["of"] == "largest") if isinstance(best, Mapping) else None

    @property
    def record(self) -> dict[str, str]:
        """Plain data for the header of a study."""
        return {"figure": self.figure, "of": "largest" if self.is_largest else "smallest"}

    def value(self, trial: StudyTrial) -> float | None:
        """The figure of a trial; None where it did not pass or has none."""
        value = trial.outcome.figures.get(self.figure)
        if trial.outcome.status is not TrialStatus.PASSED or isinstance(value, bool):
            return None
        return float(value) if isinstance(value, int | float) and math.isfinite(value) else None

    def of(self, trials: Iterable[StudyTrial]) -> StudyTrial | None:
        """The best trial, the first of equals; None where none passed."""
        latest: tuple[float, StudyTrial] | None = None
        for trial in trials:
            value = self.value(trial)
            if value is not None and (latest is None or self.is_better(value, latest[0])):
                latest = value, trial
        return latest[1] if latest else None

    def better(self, trial: StudyTrial, other: StudyTrial | None) -> StudyTrial | None:
        """The better one of a trial and another that passed, which stays where they are equal; None where none did."""
        return self.of([other, trial] if other else [trial])

    def is_better(self, value: float, other: float) -> bool:
        """Whether a value is better than another."""
        return value > other if self.is_largest else value < other


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyStatus:
    """How far a study is."""

    done: int  # number of trials whose outcome is recorded
    trials: int | None = None  # number at which it ends; None where only its budget or the search itself ends it
    best: StudyTrial | None = None  # the best trial so far; None where none passed or trials are not compared
    best_value: float | None = None  # its figure
    figure: str = ""  # name of that figure
    rate: float | None = None  # trials in a second since it was begun or continued; None where that is not known
    seconds_left: float | None = None  # time until it ends at this rate; None where that is not known
    is_running: bool = False  # whether it runs

    @classmethod
    def of(
        cls, done: int, best: StudyTrial | None, compared: Best | None, state: RunningState | None, *, is_running: bool
    ) -> Self:
        """The status of a study.

        Args:
            compared: What makes one better than another; None for nothing.
            state: Its state; None once it has ended.
        """
        rate = left = None
        if state is not None and is_running:
            seconds = seconds_since(state)
            since = done - state.done_before
            rate = since / seconds if seconds > 0.0 and since > 0 else None
            by_trials = (state.trials - done) / rate if state.trials is not None and rate else None
            by_budget = max(0.0, state.budget - seconds) if state.budget is not None else None
            left = min((estimate for estimate in (by_trials, by_budget) if estimate is not None), default=None)
        return cls(
            done=done,
            trials=state.trials if state else None,
            best=best,
            best_value=compared.value(best) if compared and best else None,
            figure=compared.figure if compared else "",
            rate=rate,
            seconds_left=left,
            is_running=is_running,
        )

    def text(self, noun: str = "trial") -> str:
        """One line for people."""
        parts = [f"{noun} {self.done}" + (f" of {self.trials}" if self.trials is not None else "")]
        if self.figure:
            value = "none yet" if self.best_value is None else f"{self.best_value:.5g}"
            parts.append(f"best {self.figure} {value}")
        if self.rate is not None:
            parts.append(f"{self.rate:.2g}/s" if self.rate >= 1.0 else f"{MINUTE * self.rate:.2g}/min")
        if self.seconds_left is not None:
            parts.append(f"{_duration(self.seconds_left)} left")
        return ", ".join(parts)


def read_status(folder: Path) -> StudyStatus:
    """The status of the study in a folder, which may be written meanwhile."""
    lines = whole_lines(folder / JOURNAL)[1]
    try:
        header = json.loads(lines[0]) if lines else None
        trials = [StudyTrial.from_record(json.loads(line)) for line in lines[1:]]
        compared = Best.from_header(header) if isinstance(header, Mapping) else None
    except (ValueError, KeyError, TypeError, RecursionError):
        header = None
    if not isinstance(header, Mapping):
        raise InputError(f"{folder / JOURNAL}: expected the journal of a study, got none")
    ahead = read_ahead(folder / AHEAD)
    trials += [ahead[number] for number in sorted(ahead) if number >= len(trials)]
    state, is_running = read_state(folder)
    best = compared.of(trials) if compared else None
    return StudyStatus.of(len(trials), best, compared, state, is_running=is_running)


def _duration(seconds: float) -> str:
    """A time in the unit that suits it."""
    if seconds >= HOUR:
        return f"{seconds / HOUR:.1f} h"
    return f"{seconds / MINUTE:.1f} min" if seconds >= 2 * MINUTE else f"{seconds:.0f} s"
