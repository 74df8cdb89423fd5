"""Assignments that are interrupted: continued, they end with the bytes of an undisturbed one."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from builders.commands import run_command

from cellplan.jobs.assign.assign import ROUNDS, assign
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.result import assign_record
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress
from cellplan.runs.solution import Solution
from cellplan.runs.solve import solve
from cellplan.study.answers import RecordedAnswers
from cellplan.study.folder import JOURNAL

EXAMPLES = Path(__file__).resolve().parents[3] / "examples" / "open_tasks"
OPEN = EXAMPLES / "open_frame.yaml"
LEFT_OUT = ("top_3", "edge_1", "edge_2", "edge_3", "side_1", "side_2")
FEW = " ".join(
    [*(f"--set tasks.{name}=null" for name in LEFT_OUT), "--set assign.stations=[[0,0]] --set assign.spin_step_deg=180"]
)


def files(folder: Path) -> dict[str, bytes]:
    """Content of all files of a folder."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def interrupt_after(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    """Have Ctrl-C come as the answer after some is to be worked out."""
    answered = RecordedAnswers.__call__

    def until(self: RecordedAnswers, question: str, about: str, work: object) -> object:
        if self.count == count:
            raise KeyboardInterrupt
        return answered(self, question, about, work)  # type: ignore[arg-type]

    monkeypatch.setattr(RecordedAnswers, "__call__", until)


@pytest.mark.slow
def test_a_bound_that_was_interrupted_ends_with_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    command = f"cellplan assign {OPEN} {FEW} --only-bound --quiet"
    assert run_command(f"{command} -o whole", tmp_path)[0] == 0
    with monkeypatch.context() as patched:
        interrupt_after(patched, 1)
        status, out, err = run_command(f"{command} -o cut", tmp_path)
    assert (status, out) == (130, "")
    assert err == "interrupted: 1 answer is recorded in cut; --resume goes on from there\n"
    assert list(files(tmp_path / "cut")) == [JOURNAL]

    for other, key in (("--effort 3", "effort"), ("--stations 3", "stations"), ("--set checks.clearance_mm=6", "set")):
        status, _, err = run_command(f"{command} {other} -o cut --resume", tmp_path)
        assert status == 2
        assert err.startswith("cut/study.jsonl:1: expected the study that is to be continued, got one with another va")
        assert f"value of '{key}" in err
        assert err.endswith("; begin anew without --resume or in another folder\n")
    status, _, err = run_command(f"cellplan solve {EXAMPLES.parents[1]}/cells/planar_pair.yaml -o cut", tmp_path)
    assert (status, err.count("\n")) == (2, 1)
    assert "holds a study, which no run replaces" in err
    assert run_command(f"{command} -o cut --resume", tmp_path)[0] == 0

    assert files(tmp_path / "cut") == files(tmp_path / "whole")
    assert run_command(f"{command} -o cut", tmp_path)[0] == 0  # in place of the earlier result
    assert files(tmp_path / "cut") == files(tmp_path / "whole")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("whole")
    assert run_command(f"cellplan assign {OPEN} -o out --effort 1 --quiet", folder)[0] == 0
    return files(folder / "out")


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 15, 25, 36])
def test_an_assignment_that_was_interrupted_ends_with_the_same_bytes(
    whole: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    command = f"cellplan assign {OPEN} -o out --effort 1 --quiet"
    with monkeypatch.context() as patched:
        interrupt_after(patched, count)
        assert run_command(command, tmp_path)[0] == 130
    journal = tmp_path / "out" / JOURNAL
    assert journal.read_bytes().count(b"\n") == 1 + count
    journal.write_bytes(journal.read_bytes()[:-30])  # the last line was cut off

    assert run_command(f"{command} --resume", tmp_path)[0] == 0

    assert files(tmp_path / "out") == whole


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL], ids=lambda number: number.name)
def test_an_assignment_that_was_ended_by_a_signal_ends_with_the_same_bytes(
    whole: dict[str, bytes], tmp_path: Path, number: signal.Signals
) -> None:
    words = [sys.executable, "-m", "cellplan", "assign", str(OPEN), "-o", "out", "--effort", "1", "--quiet"]
    process = subprocess.Popen(
        words, cwd=tmp_path, stderr=subprocess.PIPE, text=True, env=os.environ | {"TERM": "dumb"}
    )
    journal = tmp_path / "out" / JOURNAL
    while process.poll() is None and not (journal.exists() and journal.read_bytes().count(b"\n") > 12):
        time.sleep(0.05)
    process.send_signal(number)
    _, err = process.communicate(timeout=30)

    assert process.returncode == (130 if number == signal.SIGTERM else -number)
    assert ("answers are recorded in out; --resume goes on" in err) == (number == signal.SIGTERM)
    assert run_command(f"cellplan assign {OPEN} -o out --effort 1 --quiet --resume", tmp_path)[0] == 0
    assert files(tmp_path / "out") == whole


@pytest.mark.slow
def test_an_interrupted_assignment_leaves_the_earlier_result(
    whole: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    command = f"cellplan assign {OPEN} -o out --effort 1 --quiet"
    assert run_command(command, tmp_path)[0] == 0
    with monkeypatch.context() as patched:
        interrupt_after(patched, 3)
        assert run_command(f"{command} --set checks.clearance_mm=6", tmp_path)[0] == 130

    assert {name for name, content in files(tmp_path / "out").items() if whole[name] != content} == {JOURNAL}
    assert run_command(command, tmp_path)[0] == 0
    assert files(tmp_path / "out") == whole


@pytest.mark.slow
def test_blocks_with_a_moving_part_are_not_planned_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    command = f"cellplan assign {EXAMPLES / 'drum.yaml'} --effort 1 --quiet"
    assert run_command(f"{command} -o whole", tmp_path)[0] == 0
    lines = (tmp_path / "whole" / JOURNAL).read_text().splitlines()
    count = max(number for number, line in enumerate(lines) if '"block with a moving part"' in line)
    with monkeypatch.context() as patched:
        interrupt_after(patched, count)
        assert run_command(f"{command} -o cut", tmp_path)[0] == 130
    with monkeypatch.context() as patched:
        patched.delattr("cellplan.jobs.assign.columns.plan_work")
        assert run_command(f"{command} -o cut --resume", tmp_path)[0] == 0

    assert files(tmp_path / "cut") == files(tmp_path / "whole")


@pytest.mark.slow
def test_programs_that_failed_are_not_solved_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """In rows as coarse as these torches leave their paths in every round: the first program, the shortest, stays."""
    draft = AssignmentDraft.load(OPEN, settings=[*FEW.replace("--set ", "").split(), "motion.step_s=0.05"])
    recorded = list[object]()

    def record(_question: str, _about: str, work: Callable[[], object]) -> object:
        recorded.append(work())
        return recorded[-1]

    first = assign(draft, effort=1, answers=record)
    assert (first.passed, first.rounds) == (False, ROUNDS)
    assert [*map(set, first.sequenced.schedule.blocks)] == [{"top_1", "top_2"}]
    solved, answers = list[Cell](), iter(recorded)

    def counted(cell: Cell, **options: Progress) -> Solution:
        solved.append(cell)
        return solve(cell, **options)

    monkeypatch.setattr("cellplan.jobs.assign.assign.solve", counted)
    again = assign(draft, effort=1, answers=lambda *_: next(answers))

    assert len(solved) == 1
    assert assign_record(again) == assign_record(first)
