"""Where trials of a layout search begin: the given layout, those of the user, samples, and the best found so far."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Final

from cellplan.pipeline.layout.request import LayoutRequest
from cellplan.search.programs.objective import Objective
from cellplan.study.status import Best
from cellplan.study.trial import Trial

SIZE: Final = 4  # [-] trials of a round
SPREADS: Final = (0.6, 1.2, 0.3, 2.0)  # [-] usual steps of a perturbation, in turn
ADDED: Final = (0.010, 0.025, 0.005, 0.050)  # [m] clearance beyond the demand of trials for the front, in turn
SAME: Final = 5e-3  # [-] share by which the objectives of two layouts differ that are not one
BESTS: Final[Mapping[Objective, Best]] = {
    Objective.CONFORMING: Best("violation"),
    Objective.CYCLE: Best("cycle_s"),
    Objective.CLEARANCE: Best("apart_mm", is_largest=True),
    Objective.CHANGE: Best("change"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposals:
    """What each round tries; the same for the same finished rounds.

    Attributes:
        request: What is searched for.
        choices: Discrete choices, each by address with its options; every combination is tried in turn.
        rejected: Trials that are no candidates any more.
    """

    request: LayoutRequest
    choices: Mapping[str, Sequence[object]] = field(default_factory=dict)
    rejected: frozenset[int] = frozenset()

    def __call__(self, finished: Sequence[Trial]) -> list[dict[str, Any]]:
        """Values of the trials of the next round."""
        first = self._first()[len(finished) : len(finished) + SIZE]
        if first:
            return first
        number, following = len(finished) // SIZE, [*self._leading(finished)]
        spreads = [SPREADS[(2 * number + k) % len(SPREADS)] for k in range(2)]
        known = [trial for trial in finished if "x" in trial.outcome.figures]
        nearest = min(known, key=lambda trial: trial.outcome.figures["violation"], default=None)  # type: ignore[arg-type,return-value]
        best = following[0] if following else nearest
        second = following[number % min(3, len(following))] if following else best
        return [
            self._perturbed(best, spreads[0], number),
            self._sampled(number, number),
            self._perturbed(second, spreads[1], number),
            self._fourth(best, number),
        ]

    @property
    def combinations(self) -> list[dict[str, object]]:
        """All combinations of the discrete choices; one without any."""
        return [dict(zip(self.choices, each, strict=True)) for each in product(*self.choices.values())]

    def _first(self) -> list[dict[str, Any]]:
        """The given layout and those of the user, then perturbations of the given one and samples."""
        listed: list[dict[str, Any]] = [
            {"kind": "given"},
            *({"kind": "attempt", "index": k} for k in range(len(self.request.attempts))),
        ]
        options: list[dict[str, Any]] = [{**each, "choice": choice} for choice in self.combinations for each in listed]
        rest = [self._perturbed(None, SPREADS[0], 0), self._sampled(0, 0), self._perturbed(None, SPREADS[1], 1)]
        return [*options, *rest[: -len(options) % SIZE]]

    def _leading(self, finished: Sequence[Trial]) -> Iterator[Trial]:
        """Trials that conform, best first, of equal ones the first."""
        best = BESTS[self.request.objective]
        sign = -1.0 if best.is_largest else 1.0
        found = [
            (sign * value, trial)
            for trial in finished
            if (value := best.value(trial)) is not None and trial.variant.number not in self.rejected
        ]
        last: float | None = None
        for value, trial in sorted(found, key=lambda each: (each[0], each[1].variant.number)):
            if last is None or abs(value - last) > SAME * abs(last):
                last = value
                yield trial

    def _perturbed(self, trial: Trial | None, spread: float, number: int) -> dict[str, Any]:
        """A trial near the end of another one; None for the given layout."""
        if trial is None:
            choices = self.combinations
            return {"kind": "perturbed", "of": None, "spread": spread, "choice": choices[number % len(choices)]}
        figures, values = trial.outcome.figures, trial.variant.values
        return {
            "kind": "perturbed",
            "of": trial.variant.number,
            "spread": spread,
            "x": figures["x"],
            "start": figures["start"],
            "choice": values.get("choice", {}),
            **({"unled": figures["unled"]} if "unled" in figures else {}),
        }

    def _sampled(self, index: int, number: int) -> dict[str, Any]:
        """A trial anywhere within the bounds."""
        choices = self.combinations
        return {"kind": "sampled", "index": index, "choice": choices[number % len(choices)]}

    def _fourth(self, best: Trial | None, number: int) -> dict[str, Any]:
        """In turn the given layout perturbed, and the best one asked for more clearance than is demanded."""
        if number % 2 or best is None or self.request.objective is not Objective.CYCLE:
            return self._perturbed(None, SPREADS[number % len(SPREADS)], number)
        more = self._perturbed(best, 0.0, number) | {"kind": "improved"}
        return more | {"clearance_m": ADDED[number // 2 % len(ADDED)]}


def origin_text(values: Mapping[str, Any]) -> str:
    """Where a trial began, in words."""
    match values["kind"]:
        case "given":
            text = "the given layout"
        case "attempt":
            text = f"layout {values['index'] + 1} of --try"
        case "sampled":
            text = f"sample {values['index']}"
        case "improved":
            text = f"trial {values['of']}, {1000.0 * values['clearance_m']:g} mm more clearance"
        case _:
            of = "the given layout" if values["of"] is None else f"trial {values['of']}"
            text = f"{of}, perturbed"
    chosen = ", ".join(f"{address} = {value}" for address, value in (values.get("choice") or {}).items())
    return f"{text} ({chosen})" if chosen else text
