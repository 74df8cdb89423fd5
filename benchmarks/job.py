"""Job: what an engine is given to resolve, as plain arrays that any library can take.

No library of cellplan is imported here, so that the process of a peer holds the peer and nothing else.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arm:
    """One robot: a chain of revolute joints, written down at its reference configuration (all joints at zero).

    Attributes:
        X_WB: Base in the world, shape (4, 4).
        points_B: A point on each axis in [m], shape (n, 3).
        axes_B: Unit vectors along the axes, shape (n, 3).
        X_BT: Tool tip in the base, shape (4, 4).
    """

    X_WB: Array
    points_B: Array
    axes_B: Array
    X_BT: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Job:
    """Tools that must follow poses on a part that another robot moves.

    Attributes:
        cell: Path of the cell file that the job was made from; for cellplan's own engines.
        arms: All robots, in the order of the stacked joint vector.
        holder: Index of the robot that holds the part.
        X_HP: The part in the tool frame of its holder, shape (4, 4).
        operators: Index of the robot of each task, shape (tasks,).
        times: Times of the samples in [s], evenly spaced, shape (N,).
        X_PT: Reference tool tips on the part, shape (N, tasks, 4, 4).
        start: Stacked start posture in [rad], shape (nq,).
    """

    cell: str
    arms: tuple[Arm, ...]
    holder: int
    X_HP: Array
    operators: NDArray[np.intp]
    times: Array
    X_PT: Array
    start: Array

    @property
    def step(self) -> float:
        """Time between two samples in [s]."""
        return float(self.times[-1] / (len(self.times) - 1))


def save(job: Job, path: Path) -> None:
    """Write a job into a file."""
    flat: dict[str, Any] = {field.name: getattr(job, field.name) for field in fields(Job) if field.name != "arms"}
    for index, arm in enumerate(job.arms):
        flat |= {f"arm{index}_{field.name}": getattr(arm, field.name) for field in fields(Arm)}
    np.savez(path, **flat)


def load(path: Path) -> Job:
    """Read a job back."""
    with np.load(path) as flat:
        count = sum(name.endswith("_X_WB") for name in flat.files)
        arms = tuple(_arm(flat, index) for index in range(count))
        plain = {name: flat[name] for name in ("X_HP", "operators", "times", "X_PT", "start")}
        return Job(cell=str(flat["cell"]), holder=int(flat["holder"]), arms=arms, **plain)


def _arm(flat: Mapping[str, Array], index: int) -> Arm:
    """The robot of one index."""
    return Arm(**{field.name: flat[f"arm{index}_{field.name}"] for field in fields(Arm)})
