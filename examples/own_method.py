"""A resolution method of your own: minimum-norm joint velocities, without weights or damping.

A method is a module of the package ``cellplan.planning.methods`` that holds a function of the module's name. This file
is such a module; its folder is added to those in which modules of that package are found.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

import cellplan.planning.methods
from cellplan import load_cell, solve
from cellplan.planning.tracking.problem import StepResult, TrackingProblem

CELL = Path(__file__).resolve().parent / "plate.yaml"


def own_method(problem: TrackingProblem):
    """One Euler step of ``qdot = J^+ (xdot_d + K e)`` with the Moore-Penrose inverse of the cooperation Jacobian."""

    def advance(k: int, q: np.ndarray) -> StepResult:
        tasks = problem.first_order(k, q)
        velocity = np.linalg.pinv(tasks.J) @ (tasks.twist + problem.gain * tasks.error)
        return StepResult(q=q + velocity * problem.step(k))

    return advance


if __name__ == "__main__":
    cellplan.planning.methods.__path__.append(str(Path(__file__).resolve().parent))
    cell = load_cell(CELL)
    cell = replace(cell, solver=cell.solver.model_copy(update={"method": "own_method", "integrator": "euler"}))
    (task,) = solve(cell).runs[0].report.accuracy
    error = np.linalg.norm(task.position_error, axis=1).max()  # [m]
    print(f"{task.task}: {len(task.position_error) - 1} Euler steps, position error {1e3 * error:.4f} mm")
