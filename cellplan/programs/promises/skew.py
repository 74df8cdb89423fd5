"""Allowed skew of a run: how far the starts of controllers may be apart, over all of its phases."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Final

from cellplan.model.report.skew import MOST_SKEW, PairSkew, has_clocks
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.report.text.notes import demand_text
from cellplan.report.text.notes import skew_text as report_text

PER_SECOND: Final = 1e3  # [ms/s]


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockPair:
    """Two robots on different controllers."""

    first: str  # the one robot
    second: str  # the other one
    allowed: float  # largest skew in [s] that keeps all that is demanded; ``MOST_SKEW`` for that or more
    stated: float | None  # largest difference in [s] that the cell states of them; None for nothing stated
    reason: str  # what more would break

    @property
    def is_met(self) -> bool:
        """Whether what is stated is allowed, as far as anything is stated."""
        return self.stated is None or self.stated <= self.allowed


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSkew:
    """Allowed skew of a run."""

    pairs: tuple[ClockPair, ...]  # all pairs of robots on different controllers
    cycle: float  # duration of the run in [s]

    @property
    def least(self) -> ClockPair:
        """The pair that allows least, the first of these."""
        return min(self.pairs, key=lambda pair: pair.allowed)

    def broken(self, robots: Collection[str]) -> Iterator[ClockPair]:
        """Pairs of some robots of which more is stated than is allowed, the worst first."""
        among = [pair for pair in self.pairs if {pair.first, pair.second} <= set(robots) and not pair.is_met]
        yield from sorted(among, key=lambda pair: pair.allowed)

    def shortest_cycle(self, pair: ClockPair) -> str:
        """In words, the cycle at which what is stated is allowed.

        A motion that takes k times as long allows k times the skew.
        """
        if pair.allowed <= 0.0 or pair.stated is None:
            return "no cycle keeps the tolerance"
        return f"a cycle of {self.cycle * pair.stated / pair.allowed:.4g} s or more would keep it"


def run_skew(run: VerifiedRun) -> RunSkew | None:
    """How far the starts of controllers may be apart, ends of phases included; None where a cell states no two."""
    least: dict[tuple[str, str], ClockPair] = {}
    for motion in run.motions:
        for pair in () if motion.report.skew is None else motion.report.skew.pairs:
            key, allowed = (pair.first, pair.second), _clock_pair(pair, motion.name)
            if key not in least or allowed.allowed < least[key].allowed:
                least[key] = allowed
    return RunSkew(pairs=tuple(least.values()), cycle=float(run.motion.times[-1])) if has_clocks(run.cell) else None


def skew_text(seconds: float) -> str:
    """A skew in milliseconds, never rounded up."""
    return report_text(PER_SECOND * seconds, or_more=seconds >= MOST_SKEW)


def _clock_pair(pair: PairSkew, phase: str | None) -> ClockPair:
    """A pair with what limits it."""
    least = pair.least
    if least is None or least.skew >= MOST_SKEW or least.at_s is None:
        reason = "nothing limits it"
    else:
        where = "" if phase is None else f"{phase}, "
        reason = f"{demand_text(least.limit, least.subject)}, {where}{least.at_s:.3f} s"
    return ClockPair(first=pair.first, second=pair.second, allowed=pair.allowed, stated=pair.stated, reason=reason)
