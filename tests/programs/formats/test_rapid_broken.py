"""Broken sets of RAPID modules are refused at the line that is wrong; rules of MultiMove hold over all tasks."""

import functools
import re
from dataclasses import replace

import pytest
from builders.export_jobs import NAMES
from builders.rapid_broken import BROKEN, A
from builders.rapid_jobs import multimove_job, part_job, sequence_job
from builders.rapid_rules import rules_broken

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportJob, Promise
from cellplan.programs.formats.rapid.writer import RAPID
from cellplan.programs.rows.part_targets import with_part_poses

TASK_OF = {NAMES[0]: "T_ROB1", NAMES[1]: "T_ROB2", NAMES[2]: "T_ROB3"}


@functools.cache
def job_named(name: str) -> ExportJob:
    if name == "pages":
        return multimove_job(rows=7, split=3, blend=0.25)
    if name == "signals":
        return sequence_job(rows=6, marks=(0, 3), blend=0.25)
    if name == "part":
        job = part_job(rows=8, process=False)
        return replace(job, programs=with_part_poses(job.frame, job.programs))
    return multimove_job(rows=6, blend=0.25)


@functools.cache
def files_of(name: str) -> dict[str, str]:
    return RAPID.render(job_named(name))


def line_of(text: str, place: int) -> int:
    return text.count("\n", 0, place) + 1


def refused(name: str, files: dict[str, str]) -> str:
    with pytest.raises(InputError) as caught:
        RAPID.read(job_named(name).frame, files)
    return str(caught.value)


def test_there_are_many_kinds() -> None:
    assert len(BROKEN) >= 80


@pytest.mark.parametrize("kind", BROKEN)
def test_a_broken_set_is_refused_at_its_line(kind: str) -> None:
    name, path, pattern, change, where, words = BROKEN[kind]
    files = dict(files_of(name))
    match = re.search(pattern, files[path])
    assert match is not None
    files[path] = re.sub(pattern, change, files[path], count=1)

    text = refused(name, files)

    assert words in text
    if isinstance(where, int):
        assert text.startswith(f"{path}:{line_of(files_of(name)[path], match.start()) + where}: "), text
    elif isinstance(where, str):
        at = re.search(where, files[path])
        assert at is not None
        assert text.startswith(f"{path}:{line_of(files[path], at.start())}: "), text


@pytest.mark.parametrize("name", ["sync", "pages", "signals", "part"])
def test_what_is_not_broken_is_read(name: str) -> None:
    assert RAPID.read(job_named(name).frame, files_of(name))[0].robots.keys() == set(job_named(name).frame.robots)


@pytest.mark.parametrize("cuts", [2, pytest.param(12, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["sync", "pages", "signals", "part"])
def test_a_file_that_is_cut_anywhere_is_refused(name: str, cuts: int) -> None:
    files = files_of(name)
    for path, text in files.items():
        for place in range(0, len(text) - 1, max(1, len(text) // cuts)):
            refused(name, {**files, path: text[:place]})


@pytest.mark.parametrize("name", ["sync", "pages", "signals"])
def test_files_that_are_missing_or_too_many_are_refused(name: str) -> None:
    files = files_of(name)
    for path in files:
        refused(name, {other: text for other, text in files.items() if other != path})
    assert refused(name, {**files, "more.mod": files[A]}) == (
        "more.mod: expected files of the programs only, got another one"
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("<Module>beta.mod</Module>", "expected module 'alpha' first, got 'beta'"),
        ("", "expected <Program>"),
        ("<Module>alpha.mod</Module><Module>alpha.mod</Module>", "once, got none"),
        ("<Module>../alpha.mod</Module>", "expected module '../alpha.mod'"),
    ],
)
def test_a_program_file_names_the_modules(change: str, words: str) -> None:
    files = files_of("sync")
    text = files["alpha.pgf"].replace("<Module>alpha.mod</Module>", change)

    assert words in refused("sync", {**files, "alpha.pgf": text})


def test_synchronised_files_are_none_of_robots_that_wait_for_signals() -> None:
    job = job_named("signals")

    with pytest.raises(InputError, match=r"alpha\.mod:"):
        RAPID.read(job.frame, {path: text for path, text in files_of("sync").items() if not path.startswith("gamma")})
    assert job.frame.promise is Promise.SEQUENCE_ONLY


@pytest.mark.parametrize(
    "kind",
    [
        "an ID is missing",
        "an ID before On",
        "an ID twice",
        "another ID in one task",
        "a move less in one task",
        "another duration",
        "no duration",
        "no On",
        "no Off",
        "a zone before Off",
        "a task less",
        "a syncident that is not declared",
        "a tool that is not declared",
    ],
)
def test_the_other_reading_of_the_rules_agrees(kind: str) -> None:
    name, path, pattern, change, _, _ = BROKEN[kind]
    files = dict(files_of(name))
    assert rules_broken(files, TASK_OF) == []

    files[path] = re.sub(pattern, change, files[path], count=1)

    assert rules_broken(files, TASK_OF) != []
