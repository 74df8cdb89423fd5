"""What works out the trials of a study: processes of this machine, or the workers of a cluster."""

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING

from cellplan.errors import InputError
from cellplan.guard import processors

if TYPE_CHECKING:
    from cellplan.study.bundle import Bundle


def crew(
    workers: int | None, scheduler: str | None, files: Callable[[], "Bundle"], *, keep_runs: bool = False
) -> AbstractContextManager[int | Executor]:
    """A number of processes, or the executor of a cluster, for a ``with`` statement.

    Args:
        files: Gives the files that the trials read, for a cluster.

    Raises:
        InputError: The options contradict each other, or there is no such cluster.
    """
    if scheduler is None:
        return nullcontext(workers or processors())
    if workers is not None:
        raise InputError("--workers: unexpected beside --scheduler, whose workers do the work; leave one of them out")
    if keep_runs:
        raise InputError(
            "--keep-runs: unexpected beside --scheduler, on whose workers the runs would stay; leave it out"
        )
    from cellplan.study.cluster import Cluster

    return Cluster(scheduler, files())
