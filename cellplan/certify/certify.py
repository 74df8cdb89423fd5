"""The certificate: the one entry of this layer."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.certify.bound import Bound
from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.linear_motion import StraightMotion
from cellplan.certify.search import StretchSearch
from cellplan.certify.survey import Survey
from cellplan.geometry.arrays import Array
from cellplan.model.report.report import ClearanceClass
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

CHUNK_WORK: Final = 400_000  # bodies times samples searched at once: 40 MB of poses
MAX_SAMPLES: Final = 16_384  # samples searched at once, however few bodies there are
MIN_SAMPLES: Final = 512  # likewise, however many bodies there are


def certify(
    scene: Scene,
    q: Array,
    demand: float | None = None,
    *,
    with_minimum: bool = True,
    with_curves: bool = True,
    progress: Callable[[float], object] | None = None,
) -> Bound:
    """Bound the distance of every pair of bodies from below, at the samples of a motion and between them.

    Between two samples every joint moves linearly, so what is proved holds at all times. The verdict comes first: that
    nothing touches and that every pair keeps what is demanded of it. The smallest distances are searched for after it.

    Args:
        scene: The scene; the rules of its pairs may depend on the run, see ``scene_of_run``.
        q: Stacked joint positions in [rad] or [m], shape (N, nq), N at least 2.
        demand: Distance in [m] that pairs with the rule ``clearance`` are to keep; that of the scene when None.
        with_minimum: Whether the smallest distances are searched for too. Otherwise the search ends with the first pair
            that does not keep its demand, and only ``Bound.is_met`` of the result is valid.
        with_curves: Whether the bounds of each class are then raised in every block, to be drawn; the verdict and the
            smallest distances are known before.
    """
    if demand is not None:
        pairs = (replace(pair, demand=demand) if pair.rule is Rule.CLEARANCE else pair for pair in scene.pairs)
        scene = replace(scene, pairs=tuple(pairs))
    survey, arms = Survey(scene, q), LeverArms(scene, q)
    for first, last in _stretches(survey):
        motion = StraightMotion.of_cell(scene, arms, q[survey.edges[first] : survey.edges[last] + 1])
        stretch = StretchSearch(survey, motion, first, last)
        if with_minimum:
            stretch.search_all()
            for kind in ClearanceClass if with_curves else ():
                stretch.raise_curve(kind)
            stretch.note_work()
        elif not stretch.prove_all():
            survey.low[:, last:] = -np.inf  # nothing is known of the rest
            break
        if progress is not None:
            progress(last / (len(survey.edges) - 1))
    return survey.bound()


def _stretches(survey: Survey) -> Iterator[tuple[int, int]]:
    """Runs of blocks small enough to be searched at once: the first block, and the first one after the last."""
    edges = survey.edges
    most = min(MAX_SAMPLES, max(MIN_SAMPLES, CHUNK_WORK // max(1, len(survey.scene.engine.bodies))))
    first = 0
    while first < len(edges) - 1:
        last = int(np.searchsorted(edges, edges[first] + most, side="right")) - 1
        last = max(last, first + 1)
        yield first, last
        first = last
