"""Outputs that motions switch ahead of the ends of a process: as they are written and read, and what cannot be kept."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from builders import fanuc_jobs
from builders.seam_jobs import KUKA_ZERO, run_of, seam_job

from cellplan.errors import InputError, LineRefusedError
from cellplan.model.report.exported import ExportJob, RobotRows
from cellplan.model.settings.task import ProcessEntry
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.formats.fanuc_ls.writer import FANUC_LS
from cellplan.programs.formats.krl.writer import KRL
from cellplan.programs.formats.rapid.writer import RAPID
from cellplan.programs.judgement.compare_rows import other_rows
from cellplan.programs.seams.executed import executed_programs

LEADS: Mapping[str, Any] = {"on_lead_s": 0.12, "off_lead_s": 0.05}
GAS_AND_ARC = {"on": ["SetDO doGas,1", "SetDO doArc, high;"], "off": ["SetDO doArc,low", "SetDO doGas,0"]}
VALVE = {"on": ["$OUT[6]=TRUE", "$OUT[7]=TRUE"], "off": ["$OUT[7]=FALSE", "$OUT[6]=FALSE"]}


def without_delays(job: ExportJob) -> ExportJob:
    """A job whose tool does not rest at the ends of its path."""
    cell = job.frame.cell
    tasks = tuple(replace(task, process=ProcessEntry(feed_mm_s=8.0)) for task in cell.tasks)
    return replace(job, frame=replace(job.frame, cell=replace(cell, tasks=tasks)))


def rapid_job(**leads: float) -> ExportJob:
    return without_delays(seam_job("abb", process=GAS_AND_ARC | (leads or LEADS)))


def krl_job(**leads: float) -> ExportJob:
    return without_delays(seam_job("kuka", controller=KUKA_ZERO, process=VALVE | (leads or LEADS)))


def tp_job(**leads: float) -> ExportJob:
    return without_delays(fanuc_jobs.seam_job(process={"on": "DO[7]=ON", "off": "DO[7]=OFF"} | dict(leads or LEADS)))


class Language(NamedTuple):
    dialect: Dialect
    job: ExportJob
    file: str  # that has the seam
    statements: list[str]  # of the seam, without speeds and zones


LANGUAGES = {
    "rapid": Language(
        RAPID,
        rapid_job(),
        "alpha.mod",
        [
            r"TriggL seam_1,s_50,trigg_1\T2:=trigg_2,fine,t_alpha\WObj:=w_part_1;",
            r"MoveL seam_2,s_8,z_10000,t_alpha\WObj:=w_part_1;",
            r"TriggC seam_3,seam_4,s_8,trigg_3\T2:=trigg_4,fine,t_alpha\WObj:=w_part_1;",
        ],
    ),
    "krl": Language(
        KRL,
        krl_job(),
        "alpha.src",
        [
            "TRIGGER WHEN DISTANCE=1 DELAY=-120 DO $OUT[6]=TRUE",
            "TRIGGER WHEN DISTANCE=1 DELAY=-120 DO $OUT[7]=TRUE",
            "LIN seam_1",
            "LIN seam_2 C_DIS",
            "TRIGGER WHEN DISTANCE=1 DELAY=-50 DO $OUT[7]=FALSE",
            "TRIGGER WHEN DISTANCE=1 DELAY=-50 DO $OUT[6]=FALSE",
            "CIRC seam_3,seam_4",
        ],
    ),
    "tp": Language(
        FANUC_LS,
        tp_job(),
        "ALPHA_WORK_OF_ALPHA.ls",
        [
            "P[2:work_of_alph_1] 12.5mm/sec FINE TB .12sec,DO[7]=ON ;",
            "P[3:work_of_alph_2] 8mm/sec CR3 ;",
            "P[5:work_of_alph_4] 8mm/sec CR2 ;",
            "P[6:work_of_alph_5] 8mm/sec FINE TB .05sec,DO[7]=OFF ;",
        ],
    ),
}


@pytest.mark.parametrize("name", LANGUAGES)
def test_outputs_stand_with_the_motions_to_the_ends_and_come_back(name: str) -> None:
    dialect, job, file, statements = LANGUAGES[name]
    ((robot, written),) = job.programs[0].robots.items()

    files = dialect.render(job)
    read = dialect.read(job.frame, files)

    places = [files[file].find(statement) for statement in statements]
    assert -1 not in places
    assert places == sorted(places)
    assert list(other_rows(dialect, job, read)) == []
    assert read[0].robots[robot].process is not None
    np.testing.assert_array_equal(read[0].robots[robot].process, written.process)
    assert not re.search(r"^\s*(SetDO|\$OUT|\d+:  DO\[)", files[file], re.M)


def test_data_of_triggers_are_declared_and_set_before_the_first_move() -> None:
    text = RAPID.render(rapid_job())["alpha.mod"]

    assert re.findall(r"VAR triggdata (\w+);", text) == [f"trigg_{number}" for number in range(1, 5)]
    main = text.partition("PROC main()")[2].split("\r\n")
    assert [line.strip() for line in main[1:5]] == [
        r"TriggIO trigg_1,0.120\Time\DOp:=doGas,1;",
        r"TriggIO trigg_2,0.120\Time\DOp:=doArc,high;",
        r"TriggIO trigg_3,0.050\Time\DOp:=doArc,low;",
        r"TriggIO trigg_4,0.050\Time\DOp:=doGas,0;",
    ]


AS_STATED = "switched ahead as the cell states them"
AFTER = "after this move, statements of its process"
CHANGES = [
    ("rapid", r"trigg_1,0.120\Time", r"trigg_1,0.100\Time", "before the first move"),
    ("rapid", r"trigg_1,0.120\Time", "trigg_1,0.120", "before the first move"),
    ("rapid", "DOp:=doGas,1", "DOp:=doGun,1", "before the first move"),
    ("rapid", "DOp:=doGas,1", "DOp:=doGas,0", "before the first move"),
    ("rapid", "    TriggIO trigg_4,0.050\\Time\\DOp:=doGas,0;\r\n", "", "before the first move"),
    ("rapid", "  VAR triggdata trigg_2;\r\n", "", "triggdata that is declared"),
    ("rapid", "VAR triggdata trigg_2", "CONST triggdata trigg_2:=1", "VAR triggdata"),
    ("rapid", r"trigg_1\T2:=trigg_2", "trigg_1", AFTER),
    ("rapid", r"trigg_1\T2:=trigg_2", r"trigg_2\T2:=trigg_1", AFTER),
    ("rapid", r"trigg_1\T2:=trigg_2", r"trigg_3\T2:=trigg_4", "a process that is on before"),
    ("rapid", r"TriggL seam_1,s_50,trigg_1\T2:=trigg_2", "MoveL seam_1,s_50", "a process that is on before"),
    ("rapid", r"TriggC seam_3,seam_4,s_8,trigg_3\T2:=trigg_4", "MoveC seam_3,seam_4,s_8", "a stop ends its process"),
    ("rapid", "MoveL seam_2,s_8", r"TriggL seam_2,s_8,trigg_1\T2:=trigg_2", "a process that is off before"),
    ("krl", "DELAY=-120 DO $OUT[6]", "DELAY=-100 DO $OUT[6]", AS_STATED),
    ("krl", "DELAY=-120 DO $OUT[6]", "DELAY=120 DO $OUT[6]", AS_STATED),
    ("krl", "DISTANCE=1 DELAY=-120", "DISTANCE=0 DELAY=-120", AS_STATED),
    ("krl", "DO $OUT[6]=TRUE", "DO $OUT[8]=TRUE", AS_STATED),
    ("krl", "DO $OUT[6]=TRUE", "DO $OUT[6]=FALSE", AS_STATED),
    ("krl", "TRIGGER WHEN DISTANCE=1 DELAY=-120 DO $OUT[6]=TRUE\r\n", "", AS_STATED),
    ("krl", "PTP XP2", "TRIGGER WHEN DISTANCE=1 DELAY=-120 DO $OUT[6]=TRUE\r\nPTP XP2", AS_STATED),
    ("krl", "LIN seam_5", "LIN seam_5\r\nTRIGGER WHEN DISTANCE=1 DELAY=-50 DO $OUT[7]=FALSE", AS_STATED),
    ("krl", "LIN seam_1\r\n", "LIN seam_1\r\n$OUT[6]=TRUE\r\n", "a statement that these programs have"),
    ("tp", "TB .12sec,DO[7]=ON", "TB .10sec,DO[7]=ON", AS_STATED),
    ("tp", "TB .12sec,DO[7]=ON", "TA .12sec,DO[7]=ON", "no such ending of a motion"),
    ("tp", "TB .12sec,DO[7]=ON", "TB .12sec,DO[8]=ON", AS_STATED),
    ("tp", "TB .12sec,DO[7]=ON", "TB .05sec,DO[7]=OFF", "a process that is on before"),
    ("tp", " TB .12sec,DO[7]=ON", "", "a process that is on before"),
    ("tp", " TB .05sec,DO[7]=OFF", "", "a stop ends its process"),
    ("tp", "7% FINE", "7% FINE TB .12sec,DO[7]=ON", AS_STATED),
    (
        "tp",
        "P[3:work_of_alph_2] 8mm/sec CR3",
        "P[3:work_of_alph_2] 8mm/sec CR3 TB .12sec,DO[7]=ON",
        "a process that is off before",
    ),
]


@pytest.mark.parametrize(("name", "old", "new", "words"), CHANGES)
def test_changes_of_triggers_are_refused(name: str, old: str, new: str, words: str) -> None:
    dialect, job, file, _ = LANGUAGES[name]
    files = dialect.render(job)
    assert old in files[file]

    with pytest.raises(InputError) as error:
        dialect.read(job.frame, files | {file: files[file].replace(old, new, 1)})

    assert re.match(rf"{file}:\d+: expected ", str(error.value))
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("rapid", r"TriggIO trigg_1,0.120\Time\DOp:=doGas,1;", r"TRIGGIO TRIGG_1 , 0.120 \Time \DOp := doGas , 1 ;"),
        ("krl", "TRIGGER WHEN DISTANCE=1 DELAY=-120 DO", "trigger when distance = 1 delay = -120 do"),
        ("tp", "TB .12sec,DO[7]=ON", "TB    .12sec,DO[7]=ON   "),
    ],
)
def test_spaces_and_letters_of_the_controllers_are_taken(name: str, old: str, new: str) -> None:
    dialect, job, file, _ = LANGUAGES[name]
    files = dialect.render(job)
    assert old in files[file]

    read = dialect.read(job.frame, files | {file: files[file].replace(old, new, 1)})

    assert list(other_rows(dialect, job, read)) == []


def changed(job: ExportJob, **values: Any) -> ExportJob:
    """A job whose rows have other values."""
    rows: RobotRows = replace(job.programs[0].robots["alpha"], **values)
    return replace(job, programs=(replace(job.programs[0], robots={"alpha": rows}),))


@pytest.mark.parametrize(("lead", "is_kept"), [(0.399, True), (0.401, False), (0.45, False)])
def test_an_output_is_switched_ahead_within_its_motion_only(lead: float, is_kept: bool) -> None:
    """The approach of 100 mm at 250 mm/s takes 0.4 s."""
    feeds = LANGUAGES["krl"].job.programs[0].robots["alpha"].feeds
    assert feeds is not None
    job = changed(krl_job(on_lead_s=lead), feeds=np.where(feeds == 0.05, 0.25, feeds))
    read = KRL.read(job.frame, KRL.render(job))

    if is_kept:
        executed_programs(job, KRL, [run_of(job)], read)
        return
    with pytest.raises(LineRefusedError) as error:
        executed_programs(job, KRL, [run_of(job)], read)
    assert str(error.value) == (
        "task 'seam': expected on_lead_s below 0.400, which the motion to that point takes, 100 mm at 250 mm/s, got "
        f"{lead:g}"
    )


def test_no_output_is_switched_ahead_where_robots_wait() -> None:
    """It would be on while they wait; off is switched before they do."""
    with pytest.raises(LineRefusedError, match=r"'seam': on_lead_s: .* as robots wait for one another there: leave"):
        KRL.render(changed(krl_job(), marks=(2,)))
    assert "DELAY=-50" in KRL.render(changed(krl_job(), marks=(5,)))["alpha.src"]


def test_no_motion_of_the_joints_switches_outputs_ahead() -> None:
    process = np.array([False, True, True, True, True, False, False, False])

    with pytest.raises(LineRefusedError, match=r"as no line or arc leads \(approach_mm\) there: leave it out"):
        KRL.render(changed(krl_job(), process=process, rounding=np.array([0, 0, 0.2, 0.2, 0, 0, 0, 0])))


@pytest.mark.parametrize("job", [rapid_job(off_lead_s=0.05), krl_job(off_lead_s=0.05), tp_job(off_lead_s=0.05)])
def test_one_end_may_lead_alone(job: ExportJob) -> None:
    dialect = {"abb": RAPID, "kuka": KRL, "fanuc": FANUC_LS}[next(iter(job.frame.cell.controllers.values())).kind]

    text = "".join(dialect.render(job).values())

    assert list(other_rows(dialect, job, dialect.read(job.frame, dialect.render(job)))) == []
    assert len(re.findall(r"(?m)^\s*(?:SetDO|\$OUT|\d+:  DO\[)", text)) == (1 if dialect is FANUC_LS else 2)
