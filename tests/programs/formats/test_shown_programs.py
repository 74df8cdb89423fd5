"""The programs that the hand-over pages show are those that are written, file by file and in full."""

import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from builders.seam_jobs import KUKA_ZERO, STAUBLI_VALVE, UR_VALVE, VALVE, inform_job, seam_job
from builders.shown_jobs import (
    NAMES,
    NUMBERS,
    STANDARD,
    arm_and_positioner,
    motion_groups,
    servoed_arm,
    streamed_table,
    timed_table,
    waiting_arms,
    waiting_fanucs,
    welded_seam,
)

from cellplan.model.report.exported import ExportJob
from cellplan.programs.dialects import DIALECTS

GUIDES = Path(__file__).resolve().parent.parent.parent.parent / "docs" / "guides"
SHOWN = re.compile(r"^`(?P<path>[\w./]+)`[^\n]*:\n\n<!-- not run -->\n```\w+\n(?P<text>.*?)^```$", re.M | re.S)

Shown = Sequence[tuple[ExportJob, Sequence[str]]]
PAGES: dict[str, Shown] = {
    "fanuc_ls": [
        (motion_groups(), ["R30.ls"]),
        (waiting_fanucs(), ["WELD.ls"]),
        (welded_seam(), ["ALPHA_WORK_OF_ALPHA.ls"]),
    ],
    "inform": [(inform_job(), ["SEAM.JBI"])],
    "json": [(timed_table(), ["program.json"])],
    "krl": [
        (waiting_arms("kuka", NUMBERS), ["weld.src", "weld.dat"]),
        (seam_job("kuka", controller=KUKA_ZERO, process=VALVE), ["alpha.src", "alpha.dat"]),
    ],
    "rapid": [
        (arm_and_positioner(), ["weld.mod", "weld.pgf", "table.mod"]),
        (waiting_arms("abb", NAMES), ["weld.mod"]),
    ],
    "ros2": [(timed_table(), ["table.yaml"])],
    "stream": [(streamed_table(), ["table.csv", "table.json"])],
    "urscript": [
        (servoed_arm(), ["weld.script"]),
        (waiting_arms("ur", STANDARD), ["weld.script"]),
        (seam_job("ur", process=UR_VALVE), ["alpha.script"]),
    ],
    "val3": [
        (waiting_arms("staubli", NUMBERS), ["weld/weld.pjx", "weld/weld.dtx", "weld/start.pgx"]),
        (seam_job("staubli", process=STAUBLI_VALVE), ["alpha/seam.pgx", "alpha/alpha.dtx"]),
    ],
}


@pytest.mark.parametrize("form", PAGES)
def test_shown_programs_are_what_is_written(form: str) -> None:
    page = (GUIDES / f"programs-{form}.md").read_text(encoding="utf-8")
    written = [
        (path, files[path]) for job, paths in PAGES[form] for files in [DIALECTS[form].render(job)] for path in paths
    ]

    shown = SHOWN.findall(page)

    assert shown == [(path, text.replace("\r\n", "\n")) for path, text in written]


@pytest.mark.parametrize("form", PAGES)
def test_shown_programs_can_be_read_back(form: str) -> None:
    for job, _ in PAGES[form]:
        read = DIALECTS[form].read(job.frame, DIALECTS[form].render(job))

        assert [len(rows) for rows in read[0].robots.values()] == [
            len(job.programs[0].robots[n]) for n in job.frame.robots
        ]


def test_each_format_with_controllers_has_a_page_and_a_program_on_it() -> None:
    assert {*PAGES, "csv"} == set(DIALECTS)
