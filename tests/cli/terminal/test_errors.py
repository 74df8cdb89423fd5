"""Errors become plain lines and one exit status."""

import pytest

from cellplan.cli.terminal.errors import error_lines, exit_status, report_failure
from cellplan.errors import (
    CellplanError,
    ExitStatus,
    InputError,
    InvalidFileError,
    NoSolutionError,
    NotVerifiedError,
    SelfTestError,
)


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (InputError("x"), ExitStatus.BAD_INPUT),
        (InvalidFileError([InputError("x")]), ExitStatus.BAD_INPUT),
        (NoSolutionError("x"), ExitStatus.NO_SOLUTION),
        (SelfTestError("x"), ExitStatus.INTERNAL),
        (CellplanError("x"), ExitStatus.INTERNAL),
        (ZeroDivisionError("x"), ExitStatus.INTERNAL),
        (MemoryError(), ExitStatus.INTERNAL),
        (KeyboardInterrupt(), ExitStatus.INTERRUPTED),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else value.name,
)
def test_every_error_knows_its_exit_status(error: BaseException, status: ExitStatus) -> None:
    assert exit_status(error) == status


def test_a_single_error_is_one_line() -> None:
    assert error_lines(InputError("--task: expected one of a, b, got 'c'")) == [
        "error: --task: expected one of a, b, got 'c'"
    ]


def test_findings_about_a_file_begin_with_file_and_line() -> None:
    findings = [InputError("cell.yaml:3: name: missing"), InputError("cell.yaml:7: robots.a.model: unknown")]

    assert error_lines(InvalidFileError(findings)) == [
        "cell.yaml:3: name: missing",
        "cell.yaml:7: robots.a.model: unknown",
    ]


def test_a_hostile_name_can_neither_break_the_line_nor_drive_the_terminal() -> None:
    assert error_lines(InputError("no file 'a\nb\x1b[31m\u202e'")) == [r"error: no file 'a\nb\x1b[31m\u202e'"]


def test_an_internal_error_is_one_line_without_traceback(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CELLPLAN_DEBUG", raising=False)

    status = report_failure(ValueError("first\nsecond"))

    assert status == ExitStatus.INTERNAL
    assert capsys.readouterr().err == (
        "internal error: ValueError: first\\nsecond (set CELLPLAN_DEBUG=1 to see the traceback)\n"
    )


def test_the_traceback_of_an_internal_error_is_there_on_request(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CELLPLAN_DEBUG", "1")
    try:
        int("here")
    except ValueError as error:
        report_failure(error)

    reported = capsys.readouterr().err
    assert reported.startswith("Traceback (most recent call last):")
    assert "test_errors.py" in reported


def test_bad_input_never_shows_a_traceback(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CELLPLAN_DEBUG", "1")

    report_failure(InputError("x"))

    assert capsys.readouterr().err == "error: x\n"


def test_details_of_a_finding_stay_indented_below_it() -> None:
    error = NotVerifiedError(["krl: not sequence only: the part moves", "  not synchronised: two\ncontrollers"])

    assert error_lines(error) == ["krl: not sequence only: the part moves", "  not synchronised: two\\ncontrollers"]
