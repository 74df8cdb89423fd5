"""Journal of a study: ``study.jsonl``, a header and a line for each trial, in their order and only ever appended to.

A trial that ends before one with a smaller number waits in ``study-ahead.jsonl``, so that it is not lost either.
"""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Final, Self

from cellplan.errors import InputError, StudyStoppedError
from cellplan.files.input.files import read_regular_file
from cellplan.files.run.whole_file import write_whole
from cellplan.study.folder import AHEAD, JOURNAL, SCHEMA
from cellplan.study.trial import StudyTrial, Variant

MAX_BYTES: Final = 500_000_000


class Journal:
    """Writer of a journal, for a ``with`` statement; every line is on the disk before the next trial counts."""

    def __init__(self, folder: Path, header: Mapping[str, Any], *, resume: bool) -> None:
        """Name the journal; it is opened by the ``with`` statement.

        Args:
            header: What the study is about: a journal with another header is not continued.

        Raises:
            InputError: The earlier journal cannot be read, or is that of another study.
        """
        self._path, self._ahead = folder / JOURNAL, folder / AHEAD
        self._header = json.dumps({"schema": SCHEMA, **header}, ensure_ascii=False, allow_nan=False)
        self._files: dict[Path, IO[bytes]] = {}
        self._written = f"{self._header}\n".encode()
        self.trials: list[StudyTrial] = []  # recorded ones in order; those of an earlier journal need not be repeated
        self.ahead: dict[int, StudyTrial] = {}  # known although one before them is not, by number
        if resume:
            self._read()

    def __enter__(self) -> Self:
        """Write the header and the trials that are kept; a line that was cut off is dropped."""
        waiting = "".join(f"{self.ahead[number].line}\n" for number in sorted(self.ahead)).encode()
        try:
            write_whole(self._path, self._written)
            if waiting:
                write_whole(self._ahead, waiting)
            else:
                self._ahead.unlink(missing_ok=True)
        except OSError as error:
            raise self._cannot_write(error) from error
        return self

    def append(self, trial: StudyTrial) -> None:
        """Record the next trial."""
        self._write(self._path, trial)
        self.trials.append(trial)
        self.ahead.pop(trial.variant.number, None)

    def park(self, trial: StudyTrial) -> None:
        """Record a trial before which another is missing."""
        self._write(self._ahead, trial)
        self.ahead[trial.variant.number] = trial

    def require(self, variants: Sequence[Variant]) -> None:
        """Refuse trials that are not those of the study, among the variants of one round."""
        for variant in variants:
            number = variant.number
            if number < len(self.trials) and self.trials[number].variant != variant:
                raise InputError(
                    f"{self._path}:{number + 2}: expected the trial of variant {number}, got another one; begin anew "
                    "without --resume"
                )
            if number in self.ahead and self.ahead[number].variant != variant:
                del self.ahead[number]

    def __exit__(self, *_exception: object) -> None:
        """Close the files; the one of trials that wait for another goes when there are none."""
        while self._files:
            self._files.popitem()[1].close()
        if not self.ahead:
            self._ahead.unlink(missing_ok=True)

    def _write(self, path: Path, trial: StudyTrial) -> None:
        """Append a line and have it on the disk."""
        try:
            file = self._files.get(path) or self._files.setdefault(path, path.open("ab"))
            file.write(f"{trial.line}\n".encode())
            file.flush()
            os.fsync(file.fileno())
        except OSError as error:
            raise self._cannot_write(error) from error

    def _read(self) -> None:
        """Take over the trials of an earlier journal."""
        complete, lines = whole_lines(self._path)
        if lines:
            if lines[0] != self._header:
                raise InputError(
                    f"{self._path}:1: expected the study that is to be continued, got {self._difference(lines[0])}"
                )
            self.trials = [self._trial(line, number) for number, line in enumerate(lines[1:])]
            self._written = complete
        self.ahead = {number: trial for number, trial in read_ahead(self._ahead).items() if number >= len(lines) - 1}

    def _trial(self, line: str, number: int) -> StudyTrial:
        try:
            trial = StudyTrial.from_record(json.loads(line))
        except (ValueError, KeyError, TypeError, RecursionError):
            raise InputError(
                f"{self._path}:{number + 2}: expected a trial of a study, got something else; begin anew without "
                "--resume"
            ) from None
        return trial

    def _difference(self, line: str) -> str:
        """What in the header of another study is not as in this one."""
        anew = "begin anew without --resume or in another folder"
        try:
            other, header = json.loads(line), json.loads(self._header)
            keys = [key for key in {**header, **other} if header.get(key) != other.get(key)]
        except (ValueError, AttributeError, TypeError, RecursionError):
            return f"no header of a study; {anew}"
        return f"one with another value of '{keys[0]}'; {anew}" if keys else f"its values in another order; {anew}"

    def _cannot_write(self, error: OSError) -> InputError:
        """The error that users see."""
        return StudyStoppedError(f"{self._path}: cannot write the study: {(error.strerror or str(error)).lower()}")


def whole_lines(path: Path) -> tuple[bytes, list[str]]:
    """Content of a journal and its lines, without one that was cut off; nothing where there is no file."""
    if not path.exists():
        return b"", []
    content = read_regular_file(path, file=str(path), limit=MAX_BYTES)
    complete = content[: content.rfind(b"\n") + 1]
    return complete, complete.decode("utf-8", "replace").split("\n")[:-1]


def read_ahead(path: Path) -> dict[int, StudyTrial]:
    """Trials that wait for others, by number; a line that cannot be read is none."""
    trials: dict[int, StudyTrial] = {}
    for line in whole_lines(path)[1]:
        try:
            trial = StudyTrial.from_record(json.loads(line))
        except (ValueError, KeyError, TypeError, RecursionError):
            continue
        trials[trial.variant.number] = trial
    return trials
