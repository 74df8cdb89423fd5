"""Outputs of handshakes are low before the first motion, whatever an aborted program left behind."""

import re
from collections.abc import Mapping

import numpy as np
import pytest
from builders.export_jobs import NAMES, two_arms
from builders.fanuc_jobs import waiting_job
from builders.rapid_jobs import sequence_job

from cellplan.model.report.exported import ExportJob
from cellplan.programs.dialects import DIALECTS

MARKS = (0, 7, 19)
EVENTS = {  # motion, output with its state, wait for a state
    "fanuc_ls": (
        r"\d+:J P",
        r"\d+:  DO\[\d+\]=(ON)|\d+:  DO\[\d+\]=OFF",
        r"\d+:  WAIT DI\S+=ON|\d+:  WAIT DI\S+=(OFF)",
    ),
    "krl": (r"PTP XP", r"\$OUT\[\d+\]=(TRUE)|\$OUT\[\d+\]=FALSE", r"WAIT FOR \$IN|WAIT FOR (NOT)"),
    "rapid": (r"MoveAbsJ", r"SetDO \w+,(1)|SetDO \w+,0", r"WaitDI \w+,1|WaitDI \w+,(0)"),
    "val3": (r"movej\(", r"doMark=(true)|doMark=false", r"wait\(\w+==true|wait\(\w+==(false)"),
}


def job_in(form: str, split: int | None, marks: tuple[int, ...]) -> ExportJob:
    if form == "rapid":
        return sequence_job(marks=marks, split=split)
    if form == "fanuc_ls":
        return waiting_job(marks=marks, split=split)
    kind = {"krl": "kuka", "val3": "staubli"}[form]
    return two_arms(kind, marks=marks, split=split)


def events(form: str, robot: str, files: Mapping[str, str]) -> list[tuple[str, bool]]:
    """Motions, outputs and waits of a robot in the order of its program, its pages in the place of their calls."""
    main = {
        "fanuc_ls": f"{robot.upper()}.ls",
        "krl": f"{robot}.src",
        "rapid": f"{robot}.mod",
        "val3": f"{robot}/start.pgx",
    }
    text = files[main[form]]
    pages = [path for path in files if re.fullmatch(rf"(?i)(?:{robot}/)?{robot}_[0-9]{{3}}\.(?:ls|src|mod|pgx)", path)]
    text += "".join(files[path] for path in sorted(pages))
    motion, output, wait = EVENTS[form]
    marks = []
    for match in re.finditer(rf"^\s*(?:(?P<m>{motion})|(?P<o>{output})|(?P<w>{wait}))", text, re.M):
        kind = "m" if match["m"] else "o" if match["o"] else "w"
        words = [entry for entry in match.groups() if entry is not None]
        marks.append((kind, (len(words) > 1) == (kind == "o")))
    return marks


@pytest.mark.parametrize("split", [None, 8])
@pytest.mark.parametrize("form", EVENTS)
def test_a_program_that_is_started_again_waits_again(form: str, split: int | None) -> None:
    """All outputs were left raised; once all programs are started, none passes a mark before both have come."""
    job = job_in(form, split, MARKS)
    programs = {name: events(form, name, DIALECTS[form].render(job)) for name in NAMES[:2]}
    for name, program in programs.items():
        assert program[0] == ("o", False)
        assert [kind for kind, _ in program].count("m") == len(job.programs[0].robots[name])
    for seed in range(5):
        rng = np.random.default_rng(seed)
        outputs, place, moved = dict.fromkeys(programs, True), dict.fromkeys(programs, 0), dict.fromkeys(programs, 0)
        turns = [*NAMES[:2], *(NAMES[int(turn)] for turn in rng.random(3000) < rng.random(3000))]
        for name in turns:
            other = next(program for program in programs if program != name)
            if place[name] == len(programs[name]):
                continue
            kind, state = programs[name][place[name]]
            if kind == "o":
                outputs[name] = state
            moved[name] += kind == "m"
            place[name] += kind != "w" or outputs[other] == state
            assert all(moved[other] > mark for mark in MARKS if moved[name] > mark + 1)
        assert place == {name: len(program) for name, program in programs.items()}


@pytest.mark.parametrize("form", EVENTS)
def test_a_program_without_marks_sets_no_signal(form: str) -> None:
    files = DIALECTS[form].render(job_in(form, None, ()))

    assert {kind for kind, _ in events(form, NAMES[0], files)} == {"m"}
