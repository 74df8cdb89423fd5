"""Joint path: all joints at any instant, panel by panel a polynomial in time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cellplan.geometry.curves.chebyshev import chebyshev
from cellplan.geometry.transforms import Array
from cellplan.model.task import INSTANT_ROOM
from cellplan.planning.collocation.windows import Panel


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """Motion of all joints, continuous over all panels.

    Attributes:
        start: Stacked joint vector at the beginning, shape (nq,).
        begin: First instant in [s].
        panels: Stretches of time, one after the other; none where no way leads on from the start.
        nodes: Stacked joint vectors at the nodes of each panel, shape (nq, degree + 1).
        worst: Largest tool error at the nodes and between them, in [m] or [rad].
    """

    start: Array
    begin: float
    panels: Sequence[Panel]
    nodes: Sequence[Array]
    worst: float = 0.0

    @property
    def end(self) -> float:
        """Last instant in [s]."""
        return self.panels[-1].end if self.panels else self.begin

    @property
    def last(self) -> Array:
        """Stacked joint vector at the end, shape (nq,)."""
        return self.nodes[-1][:, -1] if self.nodes else self.start

    @property
    def node_count(self) -> int:
        """Instants at which the joints were solved for; where two panels meet, there is one."""
        return 1 + sum(panel.degree for panel in self.panels)

    def at(self, times: Array) -> Array:
        """Stacked joint vectors at increasing instants in [s] within the path, shape (N, nq)."""
        q = np.tile(self.start, (len(times), 1))
        ends = np.array([panel.end for panel in self.panels])
        cuts = np.searchsorted(times, ends + INSTANT_ROOM, side="right")
        first = 0
        for panel, nodes, last in zip(self.panels, self.nodes, cuts.tolist(), strict=True):
            if last > first:
                share = np.clip((times[first:last] - panel.begin) / panel.length, 0.0, 1.0)
                end = nodes[:, -1:]  # what is added to it is exactly zero at the end and for joints that stand still
                q[first:last] = (end + (nodes - end) @ chebyshev(panel.degree).values(share).T).T
            first = last
        return q

    def shifted(self, by: float) -> "JointPath":
        """The same motion so many seconds later."""
        panels = [panel.shifted(by) for panel in self.panels]
        return JointPath(self.start, self.begin + by, panels, self.nodes, self.worst)


def joined(first: JointPath, second: JointPath) -> JointPath:
    """One motion, then another that begins where and when it ends."""
    panels, nodes = [*first.panels, *second.panels], [*first.nodes, *second.nodes]
    return JointPath(first.start, first.begin, panels, nodes, max(first.worst, second.worst))
