"""Running of a study: variants on an executor, outcomes recorded in the order of the variants."""

import multiprocessing
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, Final

from cellplan.errors import CellplanError
from cellplan.model.progress import Progress, silent
from cellplan.study.journal import Journal
from cellplan.study.trial import Outcome, Trial
from cellplan.study.variants import Variant

AHEAD: Final = 4  # variants of each worker that are begun before the first of them is recorded
BEGUN: Final = 256  # variants that are begun at once on an executor of the caller

Evaluate = Callable[[Variant], Outcome]


def run_trials(
    variants: Sequence[Variant],
    evaluate: Evaluate,
    journal: Journal,
    *,
    workers: int | Executor = 1,
    progress: Progress = silent,
) -> list[Trial]:
    """Evaluate all variants that the journal does not hold yet.

    The journal is the same for any number of workers: outcomes are recorded in the order of the variants.

    Args:
        variants: All variants of the study.
        evaluate: Outcome of a variant; sent to the workers, so it must be picklable.
        journal: The open journal.
        workers: Number of processes, 1 to evaluate in this one; or an executor, which stays open.
        progress: Called with the stage and the fraction done.

    Returns:
        All trials in the order of the variants.

    Raises:
        CellplanError: A worker process ended by itself.
    """
    left = variants[len(journal.trials) :]
    with outcomes(left, evaluate, workers) as found:
        for variant, outcome in zip(left, found, strict=True):
            journal.append(Trial(variant=variant, outcome=outcome))
            progress(f"variant {len(journal.trials)} of {len(variants)}", len(journal.trials) / len(variants))
    return list(journal.trials)


@contextmanager
def outcomes(variants: Sequence[Variant], evaluate: Evaluate, workers: int | Executor) -> Iterator[Iterator[Outcome]]:
    """Outcomes in the order of the variants, for a ``with`` statement; arguments as in ``run_trials``."""
    if isinstance(workers, Executor):
        yield _in_order(variants, evaluate, workers, ahead=BEGUN)
    elif min(workers, len(variants)) <= 1:
        yield (evaluate(variant) for variant in variants)
    else:
        with _processes(min(workers, len(variants))) as pool:
            yield _in_order(variants, evaluate, pool, ahead=AHEAD * workers)


def _in_order(variants: Sequence[Variant], evaluate: Evaluate, executor: Executor, *, ahead: int) -> Iterator[Outcome]:
    """Outcomes in the order of the variants, at most ``ahead`` of them begun."""
    waiting: deque[Future[Outcome]] = deque()
    following = iter(variants)
    try:
        while True:
            while len(waiting) < ahead and (variant := next(following, None)) is not None:
                waiting.append(executor.submit(evaluate, variant))
            if not waiting:
                return
            yield waiting.popleft().result()
    except BrokenProcessPool:
        raise CellplanError(
            "a worker process ended by itself, for want of memory perhaps; continue with --resume and fewer --workers"
        ) from None
    finally:
        for future in waiting:
            future.cancel()


@contextmanager
def _processes(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Worker processes, which are ended at once when the study is interrupted."""
    earlier = set(multiprocessing.active_children())
    context = multiprocessing.get_context("spawn")
    pool = _Workers(workers, mp_context=context, initializer=_ignore_interruptions)
    try:
        yield pool
    except BaseException:
        for process in set(multiprocessing.active_children()) - earlier:
            process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)
        raise
    pool.shutdown()


class _Workers(ProcessPoolExecutor):
    """Processes that never see Ctrl-C: the parent, which sees it too, ends them."""

    def submit(self, function: Callable[..., Any], /, *arguments: object, **named: object) -> Future[Any]:
        """Begin a job; a process that is started for it inherits that interruptions are blocked."""
        if not hasattr(signal, "pthread_sigmask"):
            return super().submit(function, *arguments, **named)
        earlier = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return super().submit(function, *arguments, **named)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, earlier)


def _ignore_interruptions() -> None:
    """Ignore Ctrl-C in a worker, and no longer block it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
