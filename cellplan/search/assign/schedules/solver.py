"""The one door to OR-Tools, the extra ``assign``: models of truth values that end by counts, not by the clock."""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from importlib.metadata import version
from importlib.util import find_spec
from typing import Any, Final

import numpy as np

from cellplan.cache import keep, key_of, recall
from cellplan.geometry.arrays import Indices

WORKERS: Final = 4  # searches that take turns; their number decides the answer, not the number of processors
POOL: Final = 24  # answers that are known at the end
ROUNDING: Final = 1e-6  # [steps] of a bound
LISTENING: Final = 0.5  # [s] from one look for the end of a search to the next; it ends no search
TOLERANCE: Final = 1e-3  # [steps] of a linear model's bound


def is_installed() -> bool:
    """Whether the solver can be used."""
    return find_spec("ortools") is not None


def solver_version() -> dict[str, str]:
    """Version of the solver by the name of its package; none where it cannot be used."""
    return {"ortools": version("ortools")} if is_installed() else {}


def new_model() -> Any:
    """An empty model."""
    from ortools.sat.python import cp_model

    return cp_model.CpModel()


def new_relaxation() -> Any:
    """An empty linear model."""
    from ortools.linear_solver.python import model_builder

    model: Any = model_builder.Model
    return model()


class Relaxed:
    """A linear model, solved to its end.

    Attributes:
        bound: No answer has a smaller objective.
        reduced: By how much the objective is larger at least where a variable is one, for each of them.
    """

    def __init__(self, model: Any, variables: Sequence[Any]) -> None:
        """Solve a model."""
        from ortools.linear_solver.python import model_builder

        solver = model_builder.Solver("glop")
        solver.solve(model)
        self.bound = float(solver.objective_value) - TOLERANCE
        self.reduced = [float(solver.reduced_cost(it)) for it in variables]


class Solved:
    """The best answer of a model that was found, and what is proved of all others.

    An interrupted search goes on from here when it begins again: what was solved is kept in the cache.

    Attributes:
        answers: Values of the variables in the best answer, then in others that are nearly as good; none where none
            is known.
        objective: The objective of the best answer.
        bound: No answer has a smaller objective.
    """

    def __init__(self, model: Any, effort: float, hints: Sequence[tuple[Any, bool]] = ()) -> None:
        """Solve a model.

        Args:
            effort: Work in units of deterministic time, about seconds of one processor.
            hints: Values of an answer that is known.
        """
        from ortools.sat.python import cp_model

        for literal, value in hints:
            model.add_hint(literal, value)
        solver = cp_model.CpSolver()
        parameters = solver.parameters
        parameters.num_workers, parameters.interleave_search, parameters.random_seed = WORKERS, True, 1
        parameters.max_deterministic_time = effort
        parameters.cp_model_probing_level = parameters.symmetry_level = 0  # they take longer than they save
        parameters.fill_additional_solutions_in_response, parameters.solution_pool_size = True, POOL
        parameters.catch_sigint_signal = False  # the solver would stop early and the command go on
        about = (*solver_version().values(), str(parameters), str(model.proto))
        key = key_of("answers of a model", *(text.encode() for text in about))
        if (known := recall(key)) is None:
            keep(key, known := _solved(solver, model))
        answers, (self.objective, self.bound, proved) = known[0], known[1].tolist()
        self.answers = [tuple(it) for it in answers.tolist()]
        self.is_proved = bool(proved)

    def true(self, literals: Mapping[Any, Any], answer: int = 0) -> list[Any]:
        """Keys of the literals that are true in an answer."""
        values = self.answers[answer]
        return [key for key, literal in literals.items() if values[literal.index]]


def _solved(solver: Any, model: Any) -> tuple[Indices, Indices]:
    """Answers of a model, shape (K, variables); and the objective, its bound and whether it is proved, shape (3,)."""
    from ortools.sat.python import cp_model

    with ThreadPoolExecutor(1) as thread:
        solving = thread.submit(solver.solve, model)
        try:
            while not wait([solving], timeout=LISTENING).done:
                pass
        except KeyboardInterrupt:
            solver.stop_search()
            raise
    status, response = solving.result(timeout=LISTENING), solver.response_proto
    pool = dict.fromkeys(tuple(it.values) for it in response.additional_solutions)
    best = tuple(response.solution)
    answers = [best, *(it for it in pool if it != best)] if best else []
    bound = solver.best_objective_bound - ROUNDING
    figures = (
        round(solver.objective_value) if best else 0,
        int(bound) + (bound > int(bound)),
        status == cp_model.OPTIMAL,
    )
    return np.array(answers, dtype=np.int64), np.array(figures, dtype=np.int64)
