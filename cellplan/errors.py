"""Everything that can go wrong, as one tree; each class knows the exit status it ends the program with."""

from enum import IntEnum


class ExitStatus(IntEnum):
    """What the shell sees when a command ends."""

    PASSED = 0
    CHECK_FAILED = 1
    BAD_INPUT = 2
    NO_SOLUTION = 3
    INTERNAL = 4
    INTERRUPTED = 130


class CellplanError(Exception):
    """Anything cellplan refuses or cannot do; the message is one line that says where, what, got and allowed."""

    status = ExitStatus.INTERNAL


class InputError(CellplanError):
    """Something the user wrote cannot be used: a value, a file, an option."""

    status = ExitStatus.BAD_INPUT


class InvalidFileError(InputError):
    """All findings about one file at once, one line each.

    Attributes:
        findings: The single errors, in the order of the file.
    """

    def __init__(self, findings: list[InputError]) -> None:
        """Join the findings, one per line."""
        super().__init__("\n".join(str(finding) for finding in findings))
        self.findings = findings

    def __reduce__(self) -> tuple[type["InvalidFileError"], tuple[list[InputError]]]:
        """Cross to another process with every finding."""
        return InvalidFileError, (self.findings,)


class OverrunError(InputError):
    """A file took its reader down, or more time or memory than any sound file needs."""


class NotVerifiedError(CellplanError):
    """A run on disk is whole, but a check fails on what it holds.

    Attributes:
        findings: What fails, one line each.
    """

    status = ExitStatus.CHECK_FAILED

    def __init__(self, findings: list[str]) -> None:
        """Join the findings, one per line."""
        super().__init__("\n".join(findings))
        self.findings = findings


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
    """Joint speeds were imposed that no speeds of the other joints can go with."""


class NoSolutionError(CellplanError):
    """The input is sound, but no motion can be found for it."""

    status = ExitStatus.NO_SOLUTION


class StartNotFoundError(NoSolutionError):
    """No start posture was found that reaches the task within limits and without collision."""


class HomeNotFoundError(NoSolutionError):
    """No configuration was found in which an idle robot stands free of everything for the whole of its runs."""


class DivergedError(NoSolutionError):
    """The integration left the task by so much that going on would be meaningless."""


class SelfTestError(CellplanError):
    """A start-up test with a known answer gave another one: no verdict can be trusted."""
