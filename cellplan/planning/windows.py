"""Windows: stretches of time that are resolved as a whole, cut into panels on which all joints are polynomials."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.geometry.chebyshev import chebyshev
from cellplan.geometry.transforms import Array

DEGREES: Final = (
    6,
    12,
    24,
)  # of polynomials: a panel that is not exact enough gets the next, or is halved after the last
MOST_NODES: Final = 50  # of a window; more cost as much as a second window saves
SHARE_OF_MOTION: Final = 0.3  # longest window, of the whole motion: it takes more passes to resolve than a short one
FINE_SHARES: Final = (1.0 / 128.0, 1.0 / 32.0)  # of the motion: a stretch below these begins with a lower degree


@dataclass(frozen=True, slots=True)
class Panel:
    """A stretch of time between smooth targets: its ends in [s] and the degree of the polynomials on it."""

    begin: float
    end: float
    degree: int

    @property
    def length(self) -> float:
        """Its duration in [s]."""
        return self.end - self.begin

    def refined(self) -> "tuple[Panel, ...]":
        """What takes its place when it is not exact enough."""
        if self.degree < DEGREES[-1]:
            return (Panel(self.begin, self.end, DEGREES[DEGREES.index(self.degree) + 1]),)
        return self.halves()

    def halves(self) -> "tuple[Panel, ...]":
        """Its two halves."""
        middle = 0.5 * (self.begin + self.end)
        return Panel(self.begin, middle, self.degree), Panel(middle, self.end, self.degree)


@dataclass(frozen=True, eq=False)
class Window:
    """Panels one after the other; where two meet, each has a node of its own, as the targets may have a corner there.

    Attributes:
        panels: The panels in order.
    """

    panels: tuple[Panel, ...]

    @property
    def begin(self) -> float:
        """Its first instant in [s]."""
        return self.panels[0].begin

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
    def instants(self) -> Array:
        """The nodes, then the points between them at which the error is looked at, in [s]."""
        bases = [(panel, chebyshev(panel.degree)) for panel in self.panels]
        nodes = [panel.begin + panel.length * basis.nodes for panel, basis in bases]
        gaps = [panel.begin + panel.length * basis.gaps for panel, basis in bases]
        return np.concatenate([*nodes, *gaps])

    @cached_property
    def stretches(self) -> tuple[Array, Array]:
        """Begin and end in [s] of the panel that each of the instants belongs to."""
        counts = [panel.degree + 1 for panel in self.panels] + [panel.degree for panel in self.panels]
        panels = self.panels * 2
        return (
            np.repeat([panel.begin for panel in panels], counts),
            np.repeat([panel.end for panel in panels], counts),
        )

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
        matrix = np.zeros((self.count - len(self.panels), self.count))
        first = 0
        for panel, place in zip(self.panels, self.places, strict=True):
            matrix[first : first + panel.degree, place] = chebyshev(panel.degree).at_gaps
            first += panel.degree
        return matrix

    @cached_property
    def panel_of(self) -> "np.ndarray[tuple[int], np.dtype[np.intp]]":
        """Number of the panel that each of the instants belongs to."""
        counts = [panel.degree + 1 for panel in self.panels] + [panel.degree for panel in self.panels]
        return np.repeat(np.tile(np.arange(len(self.panels)), 2), counts)

    def refined(self, is_rough: Sequence[bool], *, shortest: float) -> "tuple[Window, ...]":
        """Windows in which rough panels are replaced by finer ones; none where one would be shorter than allowed."""
        panels: list[Panel] = []
        for panel, rough in zip(self.panels, is_rough, strict=True):
            finer = panel.refined() if rough else (panel,)
            if len(finer) > 1 and finer[0].length < shortest:
                return ()
            panels += finer
        return grouped(panels, longest=np.inf)

    def halves(self, *, shortest: float) -> "tuple[Window, ...]":
        """The window in two; none where panels would become shorter than allowed."""
        if len(self.panels) > 1:
            middle = len(self.panels) // 2
            return Window(self.panels[:middle]), Window(self.panels[middle:])
        first, second = self.panels[0].halves()
        return () if first.length < shortest else (Window((first,)), Window((second,)))


def windows_between(breaks: Array, *, whole: float) -> tuple[Window, ...]:
    """Windows over a stretch of a motion.

    Args:
        breaks: Instants in [s], increasing, between neighbours of which the targets are smooth, shape (n,).
        whole: Duration of the whole motion in [s].
    """
    longest = SHARE_OF_MOTION * whole
    panels: list[Panel] = []
    for begin, end in pairwise(breaks.tolist()):
        degree = DEGREES[int(np.searchsorted(FINE_SHARES, (end - begin) / whole))]
        cuts = np.linspace(begin, end, int(np.ceil((end - begin) / longest)) + 1).tolist()
        panels += [Panel(low, high, degree) for low, high in pairwise(cuts)]
    return grouped(panels, longest=longest)


def grouped(panels: Sequence[Panel], *, longest: float) -> tuple[Window, ...]:
    """Neighbouring panels together, as long as they are not too many nodes nor longer than so many seconds."""
    groups: list[list[Panel]] = []
    for panel in panels:
        if groups:
            nodes = sum(each.degree + 1 for each in groups[-1]) + panel.degree + 1
            if nodes <= MOST_NODES and panel.end - groups[-1][0].begin <= longest * (1.0 + 1e-12):
                groups[-1].append(panel)
                continue
        groups.append([panel])
    return tuple(Window(tuple(group)) for group in groups)
