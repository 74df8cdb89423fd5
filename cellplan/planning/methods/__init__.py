"""Resolution methods: one file and one signature each, found by the name that ``MethodName`` lists.

A method is given the tracking problem and returns the step it takes: from a sample k and the stacked joint vector
there to the configuration at the next sample. What a method remembers from step to step lives inside that step.
"""

from collections.abc import Callable
from importlib import import_module
from typing import cast

from cellplan.geometry.transforms import Array
from cellplan.model.solver import MethodName
from cellplan.planning.tracking.problem import StepResult, TrackingProblem

Step = Callable[[int, Array], StepResult]
Method = Callable[[TrackingProblem], Step]


def method_named(name: MethodName) -> Method:
    """The function of that name in the file of that name; only this file and what it needs is imported."""
    return cast(Method, getattr(import_module(f"cellplan.planning.methods.{name}"), name))
