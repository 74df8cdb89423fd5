"""Resolution methods: one file and one signature each, found by the name that ``MethodName`` lists.

A method takes the constrained rows of the cooperation Jacobian, the wanted twist components, the joint weights and the
damping, and returns joint speeds.
"""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import cast, get_args

from cellplan.geometry.transforms import Array
from cellplan.model.cell import MethodName

Method = Callable[[Array, Array, Array, float | None], Array]


def _method(name: MethodName) -> Method:
    """The function of that name in the file of that name."""
    return cast(Method, getattr(import_module(f"cellplan.planning.methods.{name}"), name))


METHODS: Mapping[MethodName, Method] = {name: _method(name) for name in get_args(MethodName)}
