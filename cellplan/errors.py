"""All errors as one hierarchy; each class has the exit status with which it ends the program."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import IntEnum


class ExitStatus(IntEnum):
    """Exit statuses of the commands."""

    PASSED = 0
    CHECK_FAILED = 1
    BAD_INPUT = 2
    NO_SOLUTION = 3
    INTERNAL = 4
    INTERRUPTED = 130


class CellplanError(Exception):
    """Base class of all errors; the message is one line: where, what, the value found and the values allowed."""

    status = ExitStatus.INTERNAL

    @property
    def details(self) -> Mapping[str, object]:
        """What a script reads of it beside its message."""
        return {}


class InputError(CellplanError):
    """A value, a file or an option of the user cannot be used."""

    status = ExitStatus.BAD_INPUT


class InvalidFileError(InputError):
    """All findings about one file at once, one line each."""

    def __init__(self, findings: list[InputError]) -> None:
        """Join the findings, one per line."""
        super().__init__("\n".join(str(finding) for finding in findings))
        self.findings = findings  # the single errors, in the order of the file

    def __reduce__(self) -> tuple[type["InvalidFileError"], tuple[list[InputError]]]:
        """Cross to another process with every finding."""
        return InvalidFileError, (self.findings,)


def raise_findings(findings: Iterable[InputError]) -> None:
    """Raise all findings at once, each of them once; a single one as it is, none not at all.

    Raises:
        InputError: There is one, or more.
    """
    single = list({str(finding): finding for finding in findings}.values())
    if single:
        raise single[0] if len(single) == 1 else InvalidFileError(single)


def refusals(*demands: Callable[[], object]) -> Iterator[InputError]:
    """The errors of all demands that are not met, in their order, instead of the first alone."""
    for demand in demands:
        try:
            demand()
        except InvalidFileError as error:
            yield from error.findings
        except InputError as error:
            yield error


class OverrunError(InputError):
    """Work in a child process crashed it, or exceeded the limits of time or memory."""


class TimeLimitError(OverrunError):
    """Work in a child process took longer than it may."""


class StudyStoppedError(InputError):
    """A study cannot go on, whatever its next trial is: its folder cannot be written, its cluster does not answer."""


class TooFewStepsError(InputError):
    """A task takes fewer steps of the clock than checks of its path need."""


class NotVerifiedError(CellplanError):
    """A run on disk is whole, but a check fails on what it holds.

    Attributes:
        findings: What fails, one line each; a line that begins with two spaces is a detail of the one before it.
    """

    status = ExitStatus.CHECK_FAILED

    def __init__(self, findings: list[str]) -> None:
        """Join the findings, one per line."""
        super().__init__("\n".join(findings))
        self.findings = findings


class LineRefusedError(NotVerifiedError):
    """A tool cannot move on the lines and arcs of a task as it must.

    Attributes:
        task: Name of the task.
        reason: Why not, with its place.
    """

    def __init__(self, task: str, reason: str) -> None:
        """Name the task before the reason, which begins with ``:`` or ``,``."""
        super().__init__([f"task '{task}'{reason}"])
        self.task, self.reason = task, reason.lstrip(":, ")


class StartOutsideLimitsError(InputError):
    """A start posture given in the cell lies outside the joint limits."""


class HomeOutsideLimitsError(InputError):
    """The home that is given for a robot is outside its joint limits."""


class StartOffTaskError(InputError):
    """A start posture given in the cell does not put the tool on the start of its task."""


class StartOffGraspError(InputError):
    """A start posture given in the cell does not put the tool of a further holder where it holds the part."""


class NotPlanarError(InputError):
    """A cell was to be treated as planar, but one of its joints moves something out of the plane."""


class PrimaryChoiceError(InputError):
    """Joint velocities were imposed that are not compatible with any velocities of the other joints."""


class NoSolutionError(CellplanError):
    """The input is sound, but no motion can be found for it."""

    status = ExitStatus.NO_SOLUTION


class ImpossibleTasksError(NoSolutionError):
    """Tasks that no robot can do.

    Attributes:
        findings: One line for each of them.
        tasks: Their names.
    """

    def __init__(self, findings: list[str], tasks: list[str]) -> None:
        """Join the findings, one per line."""
        super().__init__("\n".join(findings))
        self.findings, self.tasks = findings, tasks


class StartNotFoundError(NoSolutionError):
    """No start posture was found that reaches the task within limits and without collision."""


class HomeNotFoundError(NoSolutionError):
    """No collision-free configuration was found for an idle robot during its runs."""


class TransferNotFoundError(NoSolutionError):
    """A transfer move begins or ends too close to something, or no free way was found for it."""


class DivergedError(NoSolutionError):
    """The integration deviated so far from the task that it was stopped."""


class SelfTestError(CellplanError):
    """A start-up test of the collision engine failed: no verdict can be trusted."""


class NotFiniteError(CellplanError):
    """A figure that a search compares is no finite number: no search can go on with it."""


class MissingPackageError(InputError, ImportError):
    """An optional package is not installed; the message has the line that installs it."""
