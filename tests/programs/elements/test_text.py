"""Names of routines and points: no two of a program are the same, in any case, whatever tasks are called."""

import re
from dataclasses import replace

import pytest
from builders.seam_jobs import KUKA_ZERO, ROBOT, TASK, UR_VALVE, VALVE, seam_job

from cellplan.model.report.exported import ExportJob
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.elements.text import point_stems, safe_names

DATA = r"(?:j|s)(?:_\d+)+"  # names of joints and speeds


@pytest.mark.parametrize(
    "tasks",
    [
        ("seam", "seam_2"),
        ("Ring-", "ring_", "ring"),
        ("a", "a_p", "a_1", "a_p_3"),
        ("j", "s_8", "J_5", "s"),
        ("x" * 24 + "_1", "x" * 24),
    ],
)
def test_routines_points_and_other_data_have_names_of_their_own(tasks: tuple[str, ...]) -> None:
    routines = safe_names(tasks, longest=20, data=DATA)
    stems = point_stems(routines, longest=20, data=DATA)

    points = [f"{stem}_{number}" for stem in stems.values() for number in range(1, 30)]
    names = [name.lower() for name in (*routines.values(), *points)]
    assert len(set(names)) == len(names)
    assert not any(re.fullmatch(DATA, name) for name in names)
    assert max(map(len, (*routines.values(), *stems.values()))) <= 20


def test_points_are_named_after_their_routine_where_they_can_be() -> None:
    assert point_stems({"ring": "ring", "corner": "corner"}, longest=20) == {"ring": "ring", "corner": "corner"}


def jobs(form: str) -> ExportJob:
    """The job of a seam beside another task whose routine has the name that its second point would have."""
    job = seam_job("kuka", controller=KUKA_ZERO, process=VALVE) if form == "krl" else seam_job("ur", process=UR_VALVE)
    cell = job.frame.cell
    other = replace(cell.tasks[0], name=f"{TASK}_2")
    return replace(job, frame=replace(job.frame, cell=replace(cell, tasks=(*cell.tasks, other))))


@pytest.mark.parametrize("form", ["krl", "urscript"])
def test_a_point_has_no_name_of_a_routine(form: str) -> None:
    job, dialect = jobs(form), DIALECTS[form]

    files = dialect.render(job)

    assert not any(re.search(rf"\b{TASK}_2\b", text) for text in files.values())
    assert dialect.read(job.frame, files)[0].robots[ROBOT].seams == job.programs[0].robots[ROBOT].seams
