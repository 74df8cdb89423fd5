"""Programs of lines and arcs of all makers in which something is changed: by each change they mean something else."""

from collections import Counter

import pytest
from builders.mutations import LANGUAGES, Mutation, mutations
from builders.paced_pairs import MAKERS, pair_job

from cellplan.errors import InputError, NotVerifiedError
from cellplan.model.report.exported import ExportJob, ProgramRows
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.judgement.compare_rows import other_rows
from cellplan.programs.seams.executed import executed_programs

SAMPLE = 4  # changes of each language in the quick test
KINDS = {"row left out", "row twice", "rows exchanged", "whole number", "number with decimals", "word"}
LEAST = 150  # changes of each language, more than 500 of all


def finding(dialect: Dialect, job: ExportJob, run: ProgramRows, files: dict[str, str]) -> str:
    """What is said of files: by the reader, in the comparison of rows, or where seams are executed."""
    try:
        read = dialect.read(job.frame, files)
        said = next(other_rows(dialect, job, read), "")
        if not said:
            executed_programs(job, dialect, [run], read)
    except (InputError, NotVerifiedError) as error:
        return str(error)
    return said


def of_alpha(files: dict[str, str]) -> dict[str, str]:
    """Files of one of the two arms; those of the other one are alike."""
    return {file: text for file, text in files.items() if "beta" not in file.lower()}


@pytest.mark.parametrize("form", MAKERS)
def test_two_arms_that_wait_for_one_another_come_back_as_they_were(form: str) -> None:
    dialect, job, run = pair_job(form)
    files = dialect.render(job)

    assert finding(dialect, job, run, files) == ""
    every = list(mutations(of_alpha(files), LANGUAGES[form]))
    for change in every[:: len(every) // SAMPLE]:
        assert finding(dialect, job, run, files | {change.file: change.text}), change[:5]


@pytest.mark.slow
@pytest.mark.parametrize("form", MAKERS)
def test_every_change_of_a_program_is_noticed(form: str) -> None:
    dialect, job, run = pair_job(form)
    files, counted, passed = dialect.render(job), Counter[str](), list[Mutation]()

    for change in mutations(of_alpha(files), LANGUAGES[form]):
        counted[change.kind] += 1
        if not finding(dialect, job, run, files | {change.file: change.text}):
            passed.append(change)

    assert [change[:5] for change in passed] == []
    assert set(counted) == KINDS
    assert counted.total() >= LEAST
