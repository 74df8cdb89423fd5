"""One trial of a layout search: from a start to a local optimum and its figures."""

import json
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.files.cell.load import load_cell
from cellplan.geometry.arrays import Array
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.limits import reason, standing_of
from cellplan.jobs.layout.trials.prepared import NOT_FOLLOWED, PreparedSearch, demands_near, prepared
from cellplan.jobs.layout.trials.proposals import SIZE, Proposal, proposals_of
from cellplan.model.cell.cell import Cell
from cellplan.model.seeds import generator
from cellplan.search.programs.improve import Improved, improve
from cellplan.search.programs.objective import Demands, Effort
from cellplan.search.programs.problem import perturbed
from cellplan.search.spline_path.spline_problem import SplineProblem, perturbed_path
from cellplan.study.trial import TrialOutcome, TrialStatus, Variant

EFFORT: Final = Effort(iterations=40)  # longer ones go on as perturbations of what they came to
STAGE: Final = Effort(iterations=6)  # of motions that joint paths begin with
STAGES: Final = 4
FAR: Final = 2.5  # [-] usual steps of samples of a program
PROBE: Final = Effort(iterations=12)  # of the paths that a trial chooses from
PATH: Final = Effort(least_gain=1e-3)  # many coefficients gain little each, but for long

Begin = tuple[Array, Array]  # variables, shape (n,), and start posture, shape (nq,)


@dataclass(frozen=True, slots=True, eq=False)
class _Begin:
    """Where a trial begins."""

    x: Array  # variables, shape (n,)
    start: Array  # start posture in [rad] or [m], shape (nq,)
    unled: Begin | None = None  # that of the pseudo-inverse motion which a joint path comes from; else None


def evaluate(request: LayoutRequest, variant: Variant) -> TrialOutcome:
    """Improve the layout that a trial begins with; what is wrong with it becomes its reason.

    Args:
        variant: Number of the trial, and where it begins; see ``Proposals``.
    """
    return _evaluated(request, variant.number, json.dumps(variant.values))


def evaluate_first(request: LayoutRequest) -> None:
    """Make the cell ready and work out the first trial before it is asked for; ``evaluate`` then has it at once."""
    proposed = proposals_of(request, prepared(request))([])
    _evaluated(request, 0, json.dumps(proposed[0]))


@lru_cache(maxsize=1)
def _evaluated(request: LayoutRequest, number: int, text: str) -> TrialOutcome:
    """See ``evaluate``; the values of the trial as JSON."""
    proposal = Proposal(**json.loads(text))
    try:
        ready = prepared(request, proposal.choice, proposal.detours or ())
        begin = _begin(ready, proposal, number)
    except (InputError, NoSolutionError) as error:
        return TrialOutcome(status=TrialStatus.NO_SOLUTION, reason=str(error).splitlines()[0], figures={})
    demands, limit = ready.demands(clearance=proposal.clearance_m or 0.0), proposal.give_up_above_s
    effort = EFFORT if ready.unled is None else PATH
    effort = effort if limit is None else replace(effort, give_up_above=limit)
    improved = None if begin is None else _improved(ready, begin, demands, effort)
    if begin is None or improved is None:
        return TrialOutcome(status=TrialStatus.NO_SOLUTION, reason=NOT_FOLLOWED, figures={})
    outcome = _outcome(ready, improved, begin.unled)
    return replace(outcome, figures={**outcome.figures, "sampled": True}) if _is_far(ready, proposal) else outcome


def _improved(ready: PreparedSearch, begin: _Begin, demands: Demands, effort: Effort) -> Improved | None:
    """The local optimum from a start: once more without the usual singular values where they cannot be kept."""
    smooth = ready.resolution.smooth
    first = None if smooth is None else improve(smooth, begin.x, begin.start, demands, effort)
    improved = None if first is None else improve(ready.coarse, first.x, first.start, demands, effort)
    improved = improved or improve(ready.coarse, begin.x, begin.start, demands, effort)
    if improved is None or improved.is_conforming:
        return improved
    demands_met = demands_near(ready, improved.point, clearance=demands.clearance)
    if demands_met.singular is not None or demands.singular is None:
        return improved
    return improve(ready.coarse, improved.x, improved.start, demands_met, effort)


def _begin(ready: PreparedSearch, proposal: Proposal, number: int) -> _Begin | None:
    """Where a trial begins; None where the tools cannot follow their paths."""
    if ready.unled is not None:
        return _path(ready, ready.unled, proposal, number)
    layout = _layout(ready, proposal, number)
    return None if layout is None else _Begin(*layout)


def _path(ready: PreparedSearch, unled: PreparedSearch, proposal: Proposal, number: int) -> _Begin | None:
    """Where a trial of a joint path begins: near a path that is known, or at that of a motion by the pseudo-inverse.

    Such a motion, from wherever the trial begins, is brought to its own shortest cycle first. Trials of odd numbers
    that perturb another one begin near its path, those of even numbers near the motion that led to it.
    """
    search, kind, known = ready.path_search, proposal.kind, proposal.unled
    if kind == "given" and search.is_given:
        return _Begin(ready.coarse.given, ready.given_start)
    if kind == "attempt":
        cell = _attempted(ready, proposal.index or 0)
        path = search.stated(cell)
        if path is not None:
            others = search.layout_variables.read_from(cell)
            return _Begin(search.variables(path, others), ready.start_of(cell))
    if proposal.of is not None and (kind == "improved" or number % 2 or known is None):
        x, start = proposal.begin
        if kind == "improved" or not isinstance(ready.coarse, SplineProblem):
            return _Begin(x, start)
        rng = generator(f"layout/{number}", ready.request.seed)
        point = perturbed_path(ready.coarse, x, start, rng, size=proposal.spread or 0.0)
        return None if point is None else _Begin(point.x, point.start)
    begin = _layout(unled, replace(proposal, **(known or {})), number)
    return None if begin is None else _led(ready, unled, begin)


def _led(ready: PreparedSearch, unled: PreparedSearch, begin: Begin) -> _Begin | None:
    """The path nearest to a motion by the pseudo-inverse, improved in stages, or to one of the stages on the way.

    The last stage whose path the tools can follow, the first one, or halfway between the first and the last, whichever
    some programs make fastest: a motion may be at its best where an operator just passes a singularity, which a path
    beside it does not survive.
    """
    begins = [begin]
    for _ in range(STAGES if len(begin[0]) else 0):
        better = improve(unled.coarse, *begins[-1], unled.demands(), STAGE)
        if better is None:
            break
        begins.append((better.x, better.start))
    paths = (_path_of(ready, begin) for begin in reversed(begins[1:]))
    last, first = next(filter(None, paths), None), _path_of(ready, begin)
    halfway = None if first is None or len(begins) == 1 else _halfway(ready, first, begins[-1])
    layouts = [layout for layout in (last, first, halfway) if layout is not None]
    if len(layouts) <= 1:
        return next(iter(layouts), None)
    ranks = []
    for place, verdict in enumerate(layouts):
        probed = improve(ready.coarse, verdict.x, verdict.start, ready.demands(), PROBE)
        if probed is not None:
            ranks.append((probed.violation, probed.objective, place))
            layouts[place] = replace(verdict, x=probed.x, start=probed.start)
    return layouts[min(ranks, default=(0.0, 0.0, 0))[2]]


def _halfway(ready: PreparedSearch, first: _Begin, last: Begin) -> _Begin | None:
    """The mean of a path and of that nearest to another motion; None where a tool cannot follow."""
    search = ready.path_search
    fitted = search.fitted(*last)
    if fitted is None:
        return None
    x = 0.5 * (first.x + search.variables(fitted[0], search.layout_values(last[0])))
    start = 0.5 * (first.start + fitted[1])
    return None if ready.coarse.evaluate(x, start) is None else _Begin(x, start, unled=last)


def _path_of(ready: PreparedSearch, begin: Begin) -> _Begin | None:
    """The path nearest to a motion by the pseudo-inverse; None where a tool cannot follow."""
    search = ready.path_search
    fitted = search.fitted(*begin)
    if fitted is None:
        return None
    x = search.variables(fitted[0], search.layout_values(begin[0]))
    return None if ready.coarse.evaluate(x, fitted[1]) is None else _Begin(x, fitted[1], unled=begin)


def _layout(ready: PreparedSearch, proposal: Proposal, number: int) -> Begin | None:
    """Where a trial of a layout begins; None where the tools cannot follow their paths."""
    if proposal.is_near_given:
        return _near_given(ready, proposal, number)
    if proposal.kind == "attempt":
        return _attempt(ready, proposal.index or 0)
    if proposal.kind == "sampled":
        return _sampled(ready, proposal.index or 0)
    return _perturbed(ready, proposal.begin, proposal, number) if proposal.is_near else proposal.begin


def _perturbed(ready: PreparedSearch, begin: Begin, proposal: Proposal, number: int) -> Begin | None:
    """A layout near another one."""
    rng = generator(f"layout/{number}", ready.request.seed)
    point = perturbed(ready.coarse, *begin, rng, size=proposal.spread or 0.0)
    return None if point is None else (point.x, point.start)


def _near_given(ready: PreparedSearch, proposal: Proposal, number: int) -> Begin | None:
    """The given layout or one near it; where no motion begins there, a sample that no other trial takes."""
    begin = _given(ready)
    if begin is None:
        return _sampled(ready, number or SIZE - 1)  # the last trial of the first round is sample 0
    return begin if proposal.kind == "given" else _perturbed(ready, begin, proposal, number)


def _is_far(ready: PreparedSearch, proposal: Proposal) -> bool:
    """Whether a trial of the given layout, or near it, began at a sample instead."""
    if not proposal.is_near_given or (ready.unled is not None and ready.path_search.is_given):
        return False
    return _given(ready.unled or ready) is None


@lru_cache(maxsize=8)
def _given(ready: PreparedSearch) -> Begin | None:
    """The given layout, or with other branches of its inverse kinematics; None where no motion begins there."""
    try:
        start = ready.given_start
        if ready.coarse.evaluate(ready.variables.given, start) is not None:
            return ready.variables.given, start
    except NoSolutionError:
        pass
    if ready.phases is not None:
        return None
    try:
        return ready.starts.at(0).first
    except NoSolutionError:
        return None


def _attempt(ready: PreparedSearch, index: int) -> Begin:
    """The layout of a cell file of the user's."""
    cell = _attempted(ready, index)
    return ready.variables.read_from(cell), ready.start_of(cell)


def _attempted(ready: PreparedSearch, index: int) -> Cell:
    """A cell file of the user's."""
    return load_cell(ready.request.attempts[index], allow_dirs=ready.request.allow_dirs)


def _sampled(ready: PreparedSearch, index: int) -> Begin | None:
    """A start that was sampled over all that may change; of a program one far from the given layout."""
    if ready.phases is not None:
        rng = generator(f"layout/sample/{index}", ready.request.seed)
        point = perturbed(ready.coarse, ready.coarse.given, ready.given_start, rng, size=FAR)
        return None if point is None else (point.x, point.start)
    return ready.starts.at(1 + index).first


def change_of(ready: PreparedSearch, x: Array) -> float:
    """Cost of the change from the given layout to variables of shape (n,)."""
    return float((np.abs(x - ready.coarse.given) * ready.coarse.cost).sum())


def _outcome(ready: PreparedSearch, improved: Improved, unled: Begin | None) -> TrialOutcome:
    """Figures of a local optimum."""
    standing = standing_of(ready.coarse, improved.point, demands_near(ready, improved.point), EFFORT)
    figures: dict[str, Any] = {
        "x": improved.x.tolist(),
        "start": improved.start.tolist(),
        "cycle_s": improved.cycle,
        "violation": improved.violation,
        "margin_deg": standing.margin,
        "clearance_mm": standing.clearance,
        "apart_mm": standing.apart,
        "change": change_of(ready, improved.x),
        "programs": len(improved.history),
    }
    if unled is not None:
        figures["unled"] = {"x": unled[0].tolist(), "start": unled[1].tolist()}
    if improved.is_conforming:
        return TrialOutcome(status=TrialStatus.PASSED, figures=figures)
    violations = standing.violations()
    why = reason(violations[0]) if violations else "less room than the search asks for beyond the demands"
    return TrialOutcome(status=TrialStatus.FAILED, reason=why, figures=figures)
