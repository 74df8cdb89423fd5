"""Resolution methods: one file and one signature each, found by the name that ``MethodName`` lists.

A method is given the tracking problem and returns the step it takes: from an instant k and the stacked joint vector
there to the joint vector at the next instant. What a method remembers from step to step lives inside that step.
"""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import cast, get_args

from cellplan.geometry.transforms import Array
from cellplan.model.cell import MethodName
from cellplan.planning.tracking_problem import TrackingProblem

Step = Callable[[int, Array], Array]
Method = Callable[[TrackingProblem], Step]


def _method(name: MethodName) -> Method:
    """The function of that name in the file of that name."""
    return cast(Method, getattr(import_module(f"cellplan.planning.methods.{name}"), name))


METHODS: Mapping[MethodName, Method] = {name: _method(name) for name in get_args(MethodName)}
