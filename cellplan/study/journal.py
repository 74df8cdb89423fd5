"""Journal of a study: ``study.jsonl``, a header and a line for each trial, in their order and only ever appended to."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Final, Self

from cellplan.errors import InputError
from cellplan.io.input.files import read_regular_file
from cellplan.study.trial import Trial
from cellplan.study.variants import Variant

SCHEMA: Final = "cellplan.study/1"
JOURNAL: Final = "study.jsonl"
MAX_BYTES: Final = 500_000_000


class Journal:
    """Writer of a journal, to be used in a ``with`` statement; every line is on the disk before the next trial counts.

    Attributes:
        trials: The trials that were recorded earlier and need not be repeated, in their order.
    """

    def __init__(self, folder: Path, header: Mapping[str, Any], variants: Sequence[Variant], *, resume: bool) -> None:
        """Name the journal; it is opened by the ``with`` statement.

        Args:
            folder: Folder of the study, which exists.
            header: What the study is about: a journal with another header is not continued.
            variants: All variants of the study.
            resume: Whether trials of an earlier journal count.

        Raises:
            InputError: The earlier journal cannot be read, or is that of another study.
        """
        self._path = folder / JOURNAL
        self._header = json.dumps({"schema": SCHEMA, **header}, ensure_ascii=False, allow_nan=False)
        self._file: IO[bytes] | None = None
        self._kept = b""
        self.trials: list[Trial] = []
        if resume and self._path.exists():
            self._read(variants)

    def __enter__(self) -> Self:
        """Write the header and the trials that are kept; a line that was cut off is dropped."""
        kept = self._kept or f"{self._header}\n".encode()
        draft = self._path.with_name(f".{JOURNAL}.draft")
        try:
            draft.write_bytes(kept)
            draft.replace(self._path)
            self._file = self._path.open("ab")
        except OSError as error:
            raise self._cannot_write(error) from error
        return self

    def append(self, trial: Trial) -> None:
        """Record a trial.

        Raises:
            InputError: The disk is full or otherwise refuses.
        """
        if self._file is None:
            raise ValueError("journal: not open")
        try:
            self._file.write(f"{trial.line}\n".encode())
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise self._cannot_write(error) from error
        self.trials.append(trial)

    def __exit__(self, *_exception: object) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _read(self, variants: Sequence[Variant]) -> None:
        """Take over the trials of an earlier journal."""
        content = read_regular_file(self._path, file=str(self._path), limit=MAX_BYTES)
        complete = content[: content.rfind(b"\n") + 1]  # the line at which it was interrupted may be cut off
        lines = complete.decode("utf-8", "replace").splitlines()
        if not lines:
            return
        if lines[0] != self._header:
            raise InputError(
                f"{self._path}:1: expected the study that is to be continued, got {self._difference(lines[0])}"
            )
        for number, line in enumerate(lines[1:]):
            self.trials.append(self._trial(line, number, variants))
        self._kept = complete

    def _trial(self, line: str, number: int, variants: Sequence[Variant]) -> Trial:
        """The trial of a line, which must be the next variant."""
        where = f"{self._path}:{number + 2}"
        try:
            trial = Trial.from_record(json.loads(line))
        except (ValueError, KeyError, TypeError, RecursionError):
            raise InputError(
                f"{where}: expected a trial of a study, got something else; begin anew without --resume"
            ) from None
        if number >= len(variants) or trial.variant != variants[number]:
            raise InputError(
                f"{where}: expected the trial of variant {number}, got another one; begin anew without --resume"
            )
        return trial

    def _difference(self, line: str) -> str:
        """What in the header of another study is not as in this one."""
        anew = "begin anew without --resume or in another folder"
        try:
            other, own = json.loads(line), json.loads(self._header)
            keys = [key for key in {**own, **other} if own.get(key) != other.get(key)]
        except (ValueError, AttributeError, RecursionError):
            return f"no header of a study; {anew}"
        return f"one with another value of '{keys[0]}'; {anew}" if keys else f"its values in another order; {anew}"

    def _cannot_write(self, error: OSError) -> InputError:
        """The error that users see."""
        return InputError(f"{self._path}: cannot write the study: {(error.strerror or str(error)).lower()}")
