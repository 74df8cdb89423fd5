"""Windows: stretches of time that are resolved as a whole, cut into panels on which all joints are polynomials."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.curves.chebyshev import chebyshev
from cellplan.model.task.task import TIME_TOLERANCE

NONE: Final = np.zeros(0)
DEGREES: Final = (6, 12, 24)  # of polynomials: a panel that is not exact enough gets the next one, or is cut
MOST_NODES: Final = 50  # of a window; more cost as much as a second window saves
SHARE_OF_MOTION: Final = 0.3  # longest window, of the whole motion: it takes more passes to resolve than a short one
MOST_KNOTS: Final = 48  # inside one panel to begin with: on meshes about every second panel can have that many
PARTS: Final = 4  # of a panel over knots that is not exact enough: fewer take more tries
FEWEST_KNOTS: Final = 4  # fewer take more nodes in one panel than in one each
FINE_SHARES: Final = (1.0 / 128.0, 1.0 / 32.0)  # of the motion: a stretch below these begins with a lower degree


@dataclass(frozen=True)
class Panel:
    """A stretch of time between smooth targets: its ends in [s] and the degree of the polynomials on it.

    Inside it there may be knots, times in [s] at which a higher derivative of the targets jumps.
    """

    begin: float
    end: float
    degree: int
    knots: tuple[float, ...] = ()

    @property
    def length(self) -> float:
        """Its duration in [s]."""
        return self.end - self.begin

    @cached_property
    def points(self) -> Array:
        """Points of 0..1 at which the error is checked: between the nodes, and the knots, shape (points,)."""
        return np.append(chebyshev(self.degree).gaps, (np.array(self.knots) - self.begin) / self.length)

    def refined(self) -> "tuple[Panel, ...]":
        """What takes its place when it is not exact enough."""
        if self.degree < DEGREES[-1]:
            return (Panel(self.begin, self.end, DEGREES[DEGREES.index(self.degree) + 1], self.knots),)
        return self.parts()

    def parts(self) -> "tuple[Panel, ...]":
        """Its two halves; where it has knots, four parts that meet at knots, and few knots are taken apart at once."""
        if not self.knots:
            middle = 0.5 * (self.begin + self.end)
            return Panel(self.begin, middle, self.degree), Panel(middle, self.end, self.degree)
        ends = (self.begin, *self.knots, self.end)
        cuts = np.linspace(0, len(ends) - 1, PARTS + 1).astype(int).tolist()
        return tuple(panel for low, high in pairwise(cuts) for panel in _over(ends[low : high + 1]))

    def shifted(self, by: float) -> "Panel":
        """The same so many seconds later."""
        return Panel(self.begin + by, self.end + by, self.degree, tuple(knot + by for knot in self.knots))


@dataclass(frozen=True, eq=False)
class Window:
    """Panels one after the other. Where two meet, both have a node there, as the targets may have a corner."""

    panels: tuple[Panel, ...]  # the panels in order

    @cached_property
    def places(self) -> list[slice]:
        """Where the nodes of each panel stand among all."""
        ends = np.cumsum([panel.degree + 1 for panel in self.panels]).tolist()
        return [slice(end - panel.degree - 1, end) for end, panel in zip(ends, self.panels, strict=True)]

    @cached_property
    def count(self) -> int:
        """Number of nodes."""
        return sum(panel.degree + 1 for panel in self.panels)

    @cached_property
    def times(self) -> Array:
        """The nodes, then the points between them at which the error is checked, in [s]."""
        nodes = [panel.begin + panel.length * chebyshev(panel.degree).nodes for panel in self.panels]
        points = [panel.begin + panel.length * panel.points for panel in self.panels]
        return np.concatenate([*nodes, *points])

    @cached_property
    def stretches(self) -> tuple[Array, Array]:
        """Begin and end in [s] of the panel that each of the times belongs to."""
        begins, ends = (
            np.array(part) for part in zip(*((panel.begin, panel.end) for panel in self.panels), strict=True)
        )
        return begins[self.panel_of], ends[self.panel_of]

    @cached_property
    def integral(self) -> Array:
        """Integrals from the beginning to each node, of what is given at the nodes, shape (nodes, nodes)."""
        matrix = np.zeros((self.count, self.count))
        for panel, place in zip(self.panels, self.places, strict=True):
            matrix[place, place] = panel.length * chebyshev(panel.degree).integral
            matrix[place.stop :, place] = matrix[place.stop - 1, place]
        return matrix

    @cached_property
    def between(self) -> Array:
        """Values at the points between the nodes, shape (points, nodes)."""
        matrix = np.zeros((len(self.times) - self.count, self.count))
        first = 0
        for panel, place in zip(self.panels, self.places, strict=True):
            basis = chebyshev(panel.degree)
            block = matrix[first : first + len(panel.points), place]
            block[: panel.degree] = basis.at_gaps
            if panel.knots:
                block[panel.degree :] = basis.values(panel.points[panel.degree :])
            first += len(panel.points)
        return matrix

    @cached_property
    def rates(self) -> Array:
        """Derivatives by the time at the nodes and at the points between them, shape (nodes + points, nodes)."""
        matrix = np.zeros((self.count, self.count))
        for panel, place in zip(self.panels, self.places, strict=True):
            matrix[place, place] = chebyshev(panel.degree).derivative / panel.length
        return np.concatenate([matrix, self.between @ matrix])

    @cached_property
    def panel_of(self) -> Indices:
        """Number of the panel that each of the times belongs to."""
        counts = [panel.degree + 1 for panel in self.panels] + [len(panel.points) for panel in self.panels]
        return np.repeat(np.tile(np.arange(len(self.panels)), 2), counts)

    def refined(self, is_rough: Sequence[bool], *, shortest: float) -> "tuple[Window, ...]":
        """Windows in which rough panels are replaced by finer ones; none where one would be shorter than allowed."""
        panels: list[Panel] = []
        for panel, rough in zip(self.panels, is_rough, strict=True):
            finer = panel.refined() if rough else (panel,)
            if len(finer) > 1 and not panel.knots and finer[0].length < shortest:
                return ()
            panels += finer
        return grouped(panels, longest=np.inf)

    def parts(self, *, shortest: float) -> "tuple[Window, ...]":
        """The window in two, or one panel in its parts; none where panels would become shorter than allowed."""
        if len(self.panels) > 1:
            middle = len(self.panels) // 2
            return Window(self.panels[:middle]), Window(self.panels[middle:])
        (panel,) = self.panels
        parts = panel.parts()
        return () if not panel.knots and parts[0].length < shortest else tuple(Window((part,)) for part in parts)


def windows_between(
    breaks: Array, *, whole: float, knots: Array = NONE, highest: int = DEGREES[-1]
) -> tuple[Window, ...]:
    """Windows over a stretch of a motion.

    Args:
        breaks: Times in [s], increasing, between neighbours of which the targets are smooth but for the knots,
            shape (n,).
        whole: Duration of the whole motion in [s].
        knots: Times in [s], increasing, at which higher derivatives of the targets may jump, shape (K,). Where they
            follow each other closely, panels may reach over several of them.
        highest: Highest degree to begin with where there are no knots; what is not exact enough gets a higher one.
    """
    longest = SHARE_OF_MOTION * whole
    panels: list[Panel] = []
    for begin, end in pairwise(breaks.tolist()):
        inner = knots[np.searchsorted(knots, begin + TIME_TOLERANCE) : np.searchsorted(knots, end - TIME_TOLERANCE)]
        for group in _groups([begin, *inner.tolist(), end], fine=FINE_SHARES[0] * whole, longest=longest):
            panels += _over(group) if len(group) > 2 else _even(*group, whole=whole, longest=longest, highest=highest)
    return grouped(panels, longest=longest)


def _groups(times: Sequence[float], *, fine: float, longest: float) -> list[tuple[float, ...]]:
    """Neighbouring times, those together that follow each other closely; groups meet at their ends."""
    groups: list[list[float]] = []
    for low, high in pairwise(times):
        last = groups[-1] if groups else []
        is_fine = high - low < fine and len(last) > 1 and last[1] - last[0] < fine
        if is_fine and len(last) < MOST_KNOTS + 2 and high - last[0] <= longest:
            last.append(high)
        else:
            groups.append([low, high])
    return [tuple(group) for group in groups]


def _over(times: Sequence[float]) -> tuple[Panel, ...]:
    """One panel over many times, or one between each two where they are few."""
    if len(times) - 2 < FEWEST_KNOTS:
        return tuple(Panel(low, high, DEGREES[0]) for low, high in pairwise(times))
    return (Panel(times[0], times[-1], DEGREES[-1], tuple(times[1:-1])),)


def _even(begin: float, end: float, *, whole: float, longest: float, highest: int) -> list[Panel]:
    """Panels of the same length between two times."""
    degree = min(highest, DEGREES[int(np.searchsorted(FINE_SHARES, (end - begin) / whole))])
    cuts = np.linspace(begin, end, int(np.ceil((end - begin) / longest)) + 1).tolist()
    return [Panel(low, high, degree) for low, high in pairwise(cuts)]


def grouped(panels: Sequence[Panel], *, longest: float) -> tuple[Window, ...]:
    """Neighbouring panels together, as long as they are not too many nodes nor longer than so many seconds."""
    groups: list[list[Panel]] = []
    for panel in panels:
        if groups:
            nodes = sum(panel.degree + 1 for panel in groups[-1]) + panel.degree + 1
            if nodes <= MOST_NODES and panel.end - groups[-1][0].begin <= longest * (1.0 + 1e-12):
                groups[-1].append(panel)
                continue
        groups.append([panel])
    return tuple(Window(tuple(group)) for group in groups)
