"""Where trials of a layout search begin: the given layout, those of the user, samples, and the best found so far."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, Final

import numpy as np

from cellplan.errors import NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.prepared import PreparedSearch
from cellplan.search.programs.objective import Objective
from cellplan.search.variables.choices import Choices
from cellplan.study.status import Best
from cellplan.study.trial import StudyTrial

SIZE: Final = 4  # [-] trials of a round
WIDE: Final = (1.0, 1.0, 1.5)  # [-] usual steps of perturbations of the given layout, in turn
NARROW: Final = (0.7, 1.0, 0.4)  # [-] and of the best ones
SLIGHT: Final = 0.2  # [-] and of the given one where the first layout that conforms ends the search
GIVEN_UP: Final = 1.25  # [-] cycle as a multiple of the best one above which a trial is given up on its way
ADDED: Final = (0.010, 0.025, 0.005, 0.050)  # [m] clearance beyond the demand of trials for the front, in turn
SAME: Final = 5e-3  # [-] share by which the objectives of two layouts differ that are not one
BESTS: Final[Mapping[Objective, Best]] = {
    Objective.CONFORMING: Best("violation"),
    Objective.CYCLE: Best("cycle_s"),
    Objective.CLEARANCE: Best("apart_mm", is_largest=True),
    Objective.CHANGE: Best("change"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """Where a trial begins, and what is asked of it; the fields are its values in a study."""

    kind: str  # given, attempt, branch, sampled, perturbed, or improved: the same layout with more clearance
    of: int | None = None  # number of the trial at whose end it begins; None for the given layout
    spread: float | None = None  # usual steps of a perturbation
    index: int | None = None  # of a layout of the user's, or of a sample
    x: Sequence[float] | None = None  # variables that it begins with
    start: Sequence[float] | None = None  # start posture in [rad] or [m]
    choice: Mapping[str, object] = field(default_factory=dict)  # discrete choices, values by address
    unled: Mapping[str, Any] | None = None  # ``x`` and ``start`` of the motion without the joint path that it led to
    clearance_m: float | None = None  # clearance beyond what is demanded
    give_up_above_s: float | None = None  # cycle above which it is given up on its way
    detours: Sequence[float] | None = None  # of the transfers of a program, see ``Transfers``

    @classmethod
    def of_trial(cls, trial: StudyTrial) -> "Proposal":
        """What a trial of a study began with."""
        return cls(**trial.variant.values)  # type: ignore[arg-type]

    @property
    def values(self) -> dict[str, Any]:
        """The values of the trial: those that there are, and the layout that is perturbed."""
        written = {key.name: getattr(self, key.name) for key in fields(self)}
        return {key: value for key, value in written.items() if value is not None or (key == "of" and self.is_near)}

    @property
    def is_near(self) -> bool:
        """Whether it begins near another layout."""
        return self.kind == "perturbed"

    @property
    def is_near_given(self) -> bool:
        """Whether it begins at the given layout or near it."""
        return self.kind == "given" or (self.is_near and self.of is None)

    @property
    def begin(self) -> tuple[Array, Array]:
        """Variables, shape (n,), and start posture, shape (nq,), that it begins with."""
        return np.array(self.x, dtype=float), np.array(self.start, dtype=float)


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposals:
    """What each round tries; the same for the same finished rounds."""

    request: LayoutRequest  # what is searched for
    choices: Sequence[Mapping[str, object]] = ({},)  # combinations of discrete choices, tried in turn
    branches: Sequence[Mapping[str, Any]] = ()  # other starts of the given layout: ``x`` and ``start``
    rejected: frozenset[int] = frozenset()  # trials that are no candidates any more
    detours: Sequence[float] | None = None  # of the transfers of the given program; None where they are not known

    def __call__(self, finished: Sequence[StudyTrial]) -> list[dict[str, Any]]:
        """Values of the trials of the next round."""
        proposed = self.next_round(finished)  # other choices have other transfers
        return [replace(it, detours=None if it.choice else self.detours).values for it in proposed]

    def next_round(self, finished: Sequence[StudyTrial]) -> list[Proposal]:
        """What the next round tries."""
        first = self._first()[len(finished) : len(finished) + SIZE]
        if first:
            return first
        number, following = len(finished) // SIZE, [*self._leading(finished)]
        known = [trial for trial in finished if "x" in trial.outcome.figures]
        nearest = min(known, key=lambda trial: trial.outcome.figures["violation"], default=None)  # type: ignore[arg-type,return-value]
        best = following[0] if following else nearest
        second = following[number % min(3, len(following))] if following else best
        size, wide = NARROW[number % len(NARROW)], WIDE[number % len(WIDE)]
        proposed = [
            self._perturbed(best, size, number),
            self._perturbed(None, wide, number),
            self._perturbed(second, NARROW[(number + 1) % len(NARROW)], number),
            self._fourth(best, number, is_conforming=bool(following)),
        ]
        lost = [choice_of(trial) for trial in finished if _leads_nowhere(trial)]
        for place, proposal in enumerate(proposed):
            if (proposal.kind == "sampled" or proposal.is_near_given) and proposal.choice in lost:
                proposed[place] = replace(self._sampled(len(finished) + place, 0), choice=proposal.choice)
        if not following or self.request.objective is not Objective.CYCLE:
            return proposed
        limit = GIVEN_UP * (BESTS[Objective.CYCLE].value(following[0]) or math.inf)
        return [it if it.clearance_m is not None else replace(it, give_up_above_s=limit) for it in proposed]

    def _first(self) -> list[Proposal]:
        """The given layout and those of the user with all choices, then perturbations of the given one and samples."""
        attempts = (Proposal(kind="attempt", index=k) for k in range(len(self.request.attempts)))
        listed = [Proposal(kind="given"), *attempts]
        if self.request.seed and self.request.objective is Objective.CONFORMING:
            listed[0] = Proposal(kind="perturbed", spread=SLIGHT)  # another seed, another layout
        options = [replace(proposal, choice=choice) for choice in self.choices for proposal in listed]
        options += [Proposal(kind="branch", choice=self.choices[0], **branch) for branch in self.branches]
        options += [self._sampled(0, number) for number in range(1, len(self.choices))]
        rest = [self._perturbed(None, WIDE[0], 0), self._perturbed(None, WIDE[1], 1), self._sampled(0, 0)]
        return [*options, *rest[: -len(options) % SIZE]]

    def _leading(self, finished: Sequence[StudyTrial]) -> Iterator[StudyTrial]:
        """Trials that conform, best first, of equal ones the first."""
        best = BESTS[self.request.objective]
        sign = -1.0 if best.is_largest else 1.0
        ranked = [
            (sign * value, trial)
            for trial in finished
            if (value := best.value(trial)) is not None and trial.variant.number not in self.rejected
        ]
        last: float | None = None
        for value, trial in sorted(ranked, key=lambda entry: (entry[0], entry[1].variant.number)):
            if last is None or abs(value - last) > SAME * abs(last):
                last = value
                yield trial

    def _perturbed(self, trial: StudyTrial | None, spread: float, number: int) -> Proposal:
        """A trial near the end of another one; None for the given layout."""
        if trial is None:
            return Proposal(kind="perturbed", spread=spread, choice=self.choices[number % len(self.choices)])
        figures = trial.figures
        return Proposal(
            kind="perturbed",
            of=trial.number,
            spread=spread,
            x=figures["x"],
            start=figures["start"],
            choice=choice_of(trial),
            unled=figures.get("unled"),
        )

    def _sampled(self, index: int, number: int) -> Proposal:
        """A trial anywhere within the bounds."""
        return Proposal(kind="sampled", index=index, choice=self.choices[number % len(self.choices)])

    def _fourth(self, best: StudyTrial | None, number: int, *, is_conforming: bool) -> Proposal:
        """In turn a sample, the given layout perturbed, and the best one asked for more clearance than is demanded.

        While nothing conforms, a sample in every round.
        """
        turn = number % 4
        if turn == 0 or not is_conforming:
            return self._sampled(number, number)
        if turn != 2 or best is None or self.request.objective is not Objective.CYCLE:
            return self._perturbed(None, WIDE[(number + 1) % len(WIDE)], number)
        more = ADDED[number // 4 % len(ADDED)]
        return replace(self._perturbed(best, 0.0, number), kind="improved", clearance_m=more)


def proposals_of(request: LayoutRequest, ready: PreparedSearch) -> "Proposals":
    """What the rounds of a search of a cell try."""
    choices = tuple(Choices.of(ready.cell).values())
    return Proposals(request=request, choices=choices, branches=_branches(ready.unled or ready))


def _branches(ready: PreparedSearch) -> list[dict[str, list[float]]]:
    """Other start postures of the given layout from which all tools follow their paths, with their variables.

    Those of the robots whose branch may change; none where the given layout has no start.
    """
    robots = frozenset(Choices.of(ready.variables.base).branches)
    if not robots:
        return []
    try:
        x, start = ready.starts.branches(robots, ready.given_start)
    except NoSolutionError:
        return []
    return [{"x": values.tolist(), "start": q.tolist()} for values, q in zip(x, start, strict=True)]


def _leads_nowhere(trial: StudyTrial) -> bool:
    """Whether a trial is the given layout and no motion begins there."""
    return Proposal.of_trial(trial).kind == "given" and ("x" not in trial.figures or "sampled" in trial.figures)


def choice_of(trial: StudyTrial) -> Mapping[str, object]:
    """The discrete choices of a trial; empty for those of the cell."""
    return Proposal.of_trial(trial).choice


def is_candidate(trial: StudyTrial) -> bool:
    """Whether a trial conforms to what is demanded; one that asks for more clearance only leads to others."""
    return trial.passed and not Proposal.of_trial(trial).clearance_m


def origin_text(proposal: Proposal, *, is_sampled: bool = False) -> str:
    """Where a trial began, in words; ``is_sampled`` says that a sample took the place of the given layout."""
    match proposal.kind:
        case _ if is_sampled:
            text = "a sample in place of the given layout"
        case "given":
            text = "the given layout"
        case "attempt":
            text = f"layout {(proposal.index or 0) + 1} of --try"
        case "branch":
            text = "the given layout, another branch"
        case "sampled":
            text = f"sample {proposal.index}"
        case "improved":
            text = f"trial {proposal.of}, {1000.0 * (proposal.clearance_m or 0.0):g} mm more clearance"
        case _:
            of = "the given layout" if proposal.of is None else f"trial {proposal.of}"
            text = f"{of}, perturbed"
    chosen = choice_text(proposal.choice)
    return f"{text} ({chosen})" if chosen else text


def choice_text(choice: Mapping[str, object]) -> str:
    """A combination of discrete choices in words; starts that are to be found anew go without saying."""
    return ", ".join(f"{address} = {value}" for address, value in choice.items() if value != "auto")
