"""Resolution methods: one file and one signature each.

A method takes the constrained rows of the cooperation Jacobian, the wanted twist components, the joint weights and the
damping, and returns joint speeds.
"""

from collections.abc import Callable

from cellplan.geometry.transforms import Array
from cellplan.planning.methods.weighted_pseudo_inverse import weighted_pseudo_inverse

Method = Callable[[Array, Array, Array, float | None], Array]

METHODS: dict[str, Method] = {"weighted_pseudo_inverse": weighted_pseudo_inverse}
