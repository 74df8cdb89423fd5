"""Instants from which joints stand still, in the order of the stacked joint vector."""

from dataclasses import replace

import numpy as np
from builders.random_cells import random_cell

from cellplan.model.cell.cell import LockedJoint
from cellplan.planning.tracking.locked_joints import locked_since


def test_each_joint_stands_still_from_its_earliest_instant_on() -> None:
    cell = random_cell(1, operators=2)
    locks = (
        LockedJoint(robot="op1", joint="j2", since=0.7),
        LockedJoint(robot="op1", joint="j2", since=0.4),
        LockedJoint(robot="holder", joint="j0", since=0.0),
    )

    since = locked_since(replace(cell, motion=replace(cell.motion, locked=locks)))

    assert since[cell.columns("op1").start + 2] == 0.4
    assert since[0] == 0.0
    assert np.isinf(since).sum() == cell.joint_count - 2
    assert np.all(np.isinf(locked_since(cell)))
