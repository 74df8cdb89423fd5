"""One trial of a layout search: from a start to a local optimum and its figures."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.io.cell.load import load_cell
from cellplan.model.seeds import generator
from cellplan.pipeline.layout.limits import reason, standing_of
from cellplan.pipeline.layout.prepared import Prepared, prepared
from cellplan.pipeline.layout.request import LayoutRequest
from cellplan.search.programs.improve import Improved, improve
from cellplan.search.programs.objective import Effort
from cellplan.search.programs.perturb import perturbed
from cellplan.search.starts.generator import Starts
from cellplan.study.trial import Outcome, TrialStatus, Variant

EFFORT: Final = Effort(iterations=40)  # longer ones go on as perturbations of what they came to
NOT_FOLLOWED: Final = "a tool cannot follow its path"

Begin = tuple[Array, Array]  # variables, shape (n,), and start posture, shape (nq,)


def evaluate(request: LayoutRequest, variant: Variant) -> Outcome:
    """Improve the layout that a trial begins with; what is wrong with it becomes its reason.

    Args:
        request: What is searched for.
        variant: Number of the trial, and where it begins; see ``proposed``.
    """
    values = variant.values
    try:
        ready = prepared(request, _mapping(values.get("choice")))
        begin = _begin(ready, variant)
    except (InputError, NoSolutionError) as error:
        return Outcome(status=TrialStatus.NO_SOLUTION, reason=str(error).splitlines()[0], figures={})
    if begin is None:
        return Outcome(status=TrialStatus.NO_SOLUTION, reason=NOT_FOLLOWED, figures={})
    added = float(str(values.get("clearance_m", 0.0)))
    demands = ready.demands(clearance=added)
    limit = values.get("give_up_above_s")
    effort = EFFORT if limit is None else replace(EFFORT, give_up_above=float(str(limit)))
    found = improve(ready.coarse, *begin, demands, effort)
    if found is None:
        return Outcome(status=TrialStatus.NO_SOLUTION, reason=NOT_FOLLOWED, figures={})
    return _outcome(ready, found)


def _begin(ready: Prepared, variant: Variant) -> Begin | None:
    """Where a trial begins; None where the tools cannot follow their paths."""
    values = variant.values
    kind = values["kind"]
    if kind == "given":
        return _given(ready)
    if kind == "attempt":
        return _attempt(ready, int(str(values["index"])))
    if kind == "sampled":
        return _sampled(ready, int(str(values["index"])))
    if kind == "perturbed" and values["of"] is None:
        x, start = _given(ready)
    else:
        x, start = (np.array(values[key], dtype=float) for key in ("x", "start"))
    if kind in {"improved", "branch"}:
        return x, start
    rng = generator(f"layout/{variant.number}", ready.request.seed)
    point = perturbed(ready.coarse, x, start, rng, size=float(str(values["spread"])))
    return None if point is None else (point.x, point.start)


def _attempt(ready: Prepared, index: int) -> Begin:
    """The layout of a cell file of the user's."""
    path = ready.request.attempts[index]
    cell = load_cell(path, allow_dirs=ready.request.allow_dirs)
    return ready.variables.read_from(cell), ready.start_of(cell)


def _sampled(ready: Prepared, index: int) -> Begin:
    """A start that was sampled over all that may change.

    Raises:
        NoSolutionError: There is none.
    """
    return _first_of(ready.starts.at(1 + index))


def _given(ready: Prepared) -> Begin:
    """The given layout, or with other branches of its inverse kinematics where its start leads nowhere.

    Raises:
        NoSolutionError: There is none.
    """
    try:
        start = ready.given_start
    except NoSolutionError:
        return _first_of(ready.starts.at(0))
    if ready.coarse.evaluate(ready.variables.given, start) is None:
        return _first_of(ready.starts.at(0))
    return ready.variables.given, start


def _first_of(starts: Starts) -> Begin:
    """The best of some starts.

    Raises:
        NoSolutionError: There is none.
    """
    for start in starts:
        return start.x, start.start
    raise NoSolutionError(starts.reason)


def _outcome(ready: Prepared, found: Improved) -> Outcome:
    """Figures of a local optimum."""
    standing = standing_of(ready.coarse, found.point, ready.demands(), EFFORT)
    cost = ready.variables.cost
    figures: dict[str, Any] = {
        "x": found.x.tolist(),
        "start": found.start.tolist(),
        "cycle_s": found.cycle,
        "violation": found.violation,
        "margin_deg": standing.margin,
        "clearance_mm": standing.clearance,
        "apart_mm": standing.apart,
        "change": float((np.abs(found.x - ready.variables.given) * cost).sum()),
        "programs": len(found.history),
    }
    if found.is_conforming:
        return Outcome(status=TrialStatus.PASSED, figures=figures)
    violations = standing.violations()
    why = reason(violations[0]) if violations else "less room than the search asks for beyond the demands"
    return Outcome(status=TrialStatus.FAILED, reason=why, figures=figures)


def _mapping(value: object) -> Mapping[str, object]:
    """Discrete choices of a trial."""
    return value if isinstance(value, Mapping) else {}
