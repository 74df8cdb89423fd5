"""A promise may be asked for: programs of controllers that cannot keep times wait at the same marks as all others."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from builders.commands import run_command
from builders.vendor_cells import solve_into, write_cell

from cellplan import VerifiedRun, open_gate
from cellplan.errors import InputError
from cellplan.model.report.exported import Promise
from cellplan.model.report.verified_run import ACCESS_TOKEN
from cellplan.model.settings.controllers import ControllerEntry
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.export.choice import Choice
from cellplan.programs.promises.promises import choose_promise

pytestmark = pytest.mark.usefixtures("stored_solutions")

URSCRIPT, VAL3 = DIALECTS["urscript"], DIALECTS["val3"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mixed")
    solve_into(write_cell(folder / "cell.yaml", first="staubli", second="ur"), folder / "run")
    return folder


@pytest.fixture(scope="module")
def run(folder: Path) -> VerifiedRun:
    return open_gate(folder / "run", cell=folder / "cell.yaml")


def export(folder: Path, *options: str) -> tuple[int, str, str]:
    return run_command(f"cellplan export run --cell cell.yaml {' '.join(options)}", folder)


@pytest.mark.slow
def test_a_timed_program_is_not_for_robots_that_wait(run: VerifiedRun) -> None:
    promise = choose_promise(run, URSCRIPT, ("right",))

    assert promise.promise is Promise.TIMED
    assert (
        "not to be played with programs that wait at marks: --promise sequence writes those that do" in promise.remarks
    )


@pytest.mark.slow
def test_the_programs_of_two_makers_wait_at_the_same_marks(folder: Path) -> None:
    status, _, error = export(folder, "--format val3", "--format urscript", "--promise sequence")

    assert (status, error) == (0, "")
    records = [
        json.loads((folder / "run" / "programs" / form / "export.json").read_text(encoding="utf-8"))
        for form in ("val3", "urscript")
    ]
    times = [[marks["times_s"] for marks in record["marks"]] for record in records]
    assert times[0] == times[1]
    assert sum(map(len, times[0])) > 0
    assert [record["promise"] for record in records] == ["sequence only", "sequence only"]
    assert "not timed: 'sequence only' was asked for" in records[1]["reasons"]
    assert run_command("cellplan verify run/programs/urscript --cell cell.yaml", folder)[0] == 0


@pytest.mark.slow
def test_a_promise_that_is_not_kept_is_not_replaced_by_a_lesser_one(folder: Path) -> None:
    status, _, error = export(folder, "--format urscript", "--promise timed", "--robot right", "-o timed")
    assert (status, error) == (0, "")
    status, _, error = export(folder, "--format val3", "--promise timed")
    assert (status, error) == (2, "error: --promise: expected paced, sequence only with val3, got timed\n")
    status, _, error = export(folder, "--format val3", "--promise best")
    assert (status, error) == (
        2,
        "error: --promise: expected one of timed, synchronised, paced, sequence, got 'best'\n",
    )


def test_a_latency_that_is_not_stated_is_asked_for_where_times_are(run: VerifiedRun) -> None:
    unstated = {name: controller.changed(latency_ms=None) for name, controller in run.cell.controllers.items()}
    bare = replace(run, cell=replace(run.cell, controllers=unstated), token=ACCESS_TOKEN)

    assert choose_promise(bare, URSCRIPT, ("right",)).promise is Promise.SEQUENCE_ONLY
    with pytest.raises(InputError, match=r"controllers\.other\.latency_ms: expected the time"):
        choose_promise(bare, URSCRIPT, ("right",), requested=Promise.TIMED)


def test_robots_whose_waits_no_format_writes_are_named(run: VerifiedRun) -> None:
    assert not any("no format writes" in remark for remark in choose_promise(run, VAL3, ("left",)).remarks)
    other = ControllerEntry(kind="reis")
    mixed = replace(run.cell, controllers={**run.cell.controllers, "other": other})

    promise = choose_promise(replace(run, cell=mixed, token=ACCESS_TOKEN), VAL3, ("left",))

    assert "no format writes the waits of right: program the marks of export.json there by hand" in promise.remarks


def test_a_promise_that_a_format_cannot_state_is_refused() -> None:
    with pytest.raises(InputError, match="--promise: expected timed with csv, got sequence only"):
        Choice(promise=Promise.SEQUENCE_ONLY).refuse_for(DIALECTS["csv"])
