"""Answers of one long search as a study: recorded in its journal in their order, and not worked out again."""

import json
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from cellplan.errors import CellplanError, StudyStoppedError
from cellplan.files.input.files import digest
from cellplan.report.text.method import counted
from cellplan.study.folder import BEFORE_JOURNAL, JOURNAL
from cellplan.study.interruptions import deferred_interruptions
from cellplan.study.journal import Journal
from cellplan.study.running import RunningState, cannot_write, require_idle, running
from cellplan.study.trial import StudyTrial, TrialOutcome, TrialStatus, Variant

UNFINISHED: Final = BEFORE_JOURNAL | {JOURNAL}  # files of an unfinished search in the folder of its result


@dataclass
class RecordedAnswers:
    """Answers of a search that asks the same questions in the same order whenever it is made."""

    file: Path  # the journal
    journal: Journal
    count: int = 0  # questions so far

    def __call__(self, question: str, about: str, work: Callable[[], Any]) -> Any:
        """The recorded answer to the next question, plain data as it is read back; else as it is worked out now.

        Raises:
            InputError: The recorded question is another one.
        """
        trials, variant = self.journal.trials, Variant(self.count, {question: digest(about.encode())})
        self.journal.require([variant])
        if self.count == len(trials):
            answer = json.loads(json.dumps(work(), allow_nan=False))
            outcome = TrialOutcome(status=TrialStatus.PASSED, figures={"answer": answer})
            with deferred_interruptions():
                self.journal.append(StudyTrial(variant=variant, outcome=outcome))
        self.count += 1
        return trials[variant.number].figures["answer"]


@contextmanager
def recorded_answers(folder: Path, header: Mapping[str, Any], *, resume: bool) -> Iterator[RecordedAnswers]:
    """Answers that are recorded in the folder of the result, for a ``with`` statement.

    The journal stays where the search is interrupted or its process killed; it goes where the search has no result.

    Args:
        header: What the search is about: a journal with another header is not continued.
        resume: Whether answers that the folder has are not worked out again.

    Raises:
        InputError: The folder is in use or cannot be written, or its journal is that of another study.
        KeyboardInterrupt: The search was interrupted; says how many answers are recorded.
    """
    require_idle(folder)
    journal = Journal(folder, header, resume=resume)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from error
    state = RunningState(began=time.time(), done_before=len(journal.trials), trials=None, budget=None)
    try:
        with running(folder, state), journal:
            yield RecordedAnswers(folder / JOURNAL, journal)
    except KeyboardInterrupt:
        count = len(journal.trials)
        recorded = f"{counted(count, 'answer')} {'is' if count == 1 else 'are'} recorded in {folder}"
        raise KeyboardInterrupt(f"interrupted: {recorded}; --resume goes on from there") from None
    except CellplanError as error:
        if not isinstance(error, StudyStoppedError):
            (folder / JOURNAL).unlink(missing_ok=True)
            if not any(folder.iterdir()):
                folder.rmdir()
        raise
