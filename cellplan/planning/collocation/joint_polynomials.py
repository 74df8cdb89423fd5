"""Collocated path: all joints, panel by panel a polynomial in time, and how exact they are."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.motion.joint_path import JointPath
from cellplan.planning.collocation.windows import Panel


@dataclass(frozen=True, slots=True, eq=False)
class CollocatedPath:
    """Motion of all joints, continuous over all panels."""

    start: Array  # stacked joint vector at the beginning, shape (nq,)
    begin: float  # first time in [s]
    panels: Sequence[Panel]  # stretches of time, one after the other; none where collocation did not converge
    nodes: Sequence[Array]  # stacked joint vectors at the nodes of each panel, shape (nq, degree + 1)
    worst: float = 0.0  # largest tool error at the nodes and between them, in [m] or [rad]

    @property
    def end(self) -> float:
        """Last time in [s]."""
        return self.panels[-1].end if self.panels else self.begin

    @property
    def last(self) -> Array:
        """Stacked joint vector at the end, shape (nq,)."""
        return self.nodes[-1][:, -1] if self.nodes else self.start

    @property
    def node_count(self) -> int:
        """Times at which the joints were solved for; where two panels meet, there is one."""
        return 1 + sum(panel.degree for panel in self.panels)

    @property
    def joints(self) -> JointPath:
        """The motion alone, without what it took."""
        breaks = np.array([self.begin, *(panel.end for panel in self.panels)])
        return JointPath(self.start, breaks, self.nodes)

    def at(self, times: Array) -> Array:
        """Stacked joint vectors at increasing times in [s] within the path, shape (N, nq)."""
        return self.joints.at(times)

    def shifted(self, by: float) -> "CollocatedPath":
        """The same motion so many seconds later."""
        panels = [panel.shifted(by) for panel in self.panels]
        return CollocatedPath(self.start, self.begin + by, panels, self.nodes, self.worst)


def joined(first: CollocatedPath, second: CollocatedPath) -> CollocatedPath:
    """One motion, then another that begins where and when it ends."""
    panels, nodes = [*first.panels, *second.panels], [*first.nodes, *second.nodes]
    return CollocatedPath(first.start, first.begin, panels, nodes, max(first.worst, second.worst))
