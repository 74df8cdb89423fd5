"""Seams in FANUC programs: lines, arcs, process and corners, as they are written and as they are read."""

import re
from dataclasses import replace

import numpy as np
import pytest
from builders.export_jobs import read_back
from builders.fanuc_jobs import seam_job

from cellplan.errors import InputError, NotVerifiedError
from cellplan.geometry.transforms import rotation_vector
from cellplan.model.report.exported import ExportJob, Station
from cellplan.programs.elements.corners import row_shares
from cellplan.programs.formats.fanuc_ls.poses import configuration
from cellplan.programs.formats.fanuc_ls.writer import FANUC_LS

WELD: dict[str, object] = {"on": ("Weave Sine[1]", "Weld Start[1,1]"), "off": ("Weld End[1,1]", "Weave End")}
OUTPUT: dict[str, object] = {"on": "DO[7]=ON", "off": "DO[7]=OFF"}
SEAM = "ALPHA_WORK_OF_ALPHA.ls"


def instructions(text: str) -> list[str]:
    """What a program does, its numbers and its remarks left out."""
    lines = re.sub(r"\r\n +: +", " ", text).split("/MN")[1].split("/POS")[0].splitlines()
    said = [line.partition(":")[2].strip().removesuffix(" ;") for line in lines if line.strip()]
    return [line for line in said if not line.startswith("!")]


def test_a_seam_is_a_program_of_lines_and_arcs_in_the_frame_of_the_part() -> None:
    files = FANUC_LS.render(seam_job(process=WELD))

    assert set(files) == {"ALPHA.ls", SEAM}
    main = instructions(files["ALPHA.ls"])
    assert re.fullmatch(r"J P\[2\] \d+% FINE", main.pop())
    assert main == [
        *("UFRAME_NUM=0", "UTOOL_NUM=2", "J P[1] 10% FINE", "CALL ALPHA_WORK_OF_ALPHA"),
        *("UFRAME_NUM=0", "UTOOL_NUM=2"),
    ]
    seam = instructions(files[SEAM])
    assert re.fullmatch(r"J P\[1\] \d+% FINE", seam.pop(2))
    assert seam == [
        *("UFRAME_NUM=4", "UTOOL_NUM=2"),
        *("L P[2:work_of_alph_1] 12.5mm/sec FINE Weld Start[1,1]", "Weave Sine[1]"),
        *(
            "L P[3:work_of_alph_2] 8mm/sec CR3",
            "C P[4:work_of_alph_3] P[5:work_of_alph_4] 8mm/sec CR2",
            "L P[6:work_of_alph_5] 8mm/sec FINE Weld End[1,1]",
            "Weave End",
        ),
        "L P[7:work_of_alph_6] 12.5mm/sec FINE",
    ]
    assert re.findall(r"(?s)P\[4:.work_of_alph_3.\]\{.*?\};", files[SEAM])[0].count("UF : 4, UT : 2, CONFIG : '") == 1


def test_outputs_wait_for_the_delays_that_nothing_else_holds() -> None:
    seam = instructions(FANUC_LS.render(seam_job(process=OUTPUT))[SEAM])

    assert seam[3:6] == ["L P[2:work_of_alph_1] 12.5mm/sec FINE", "DO[7]=ON", "WAIT 0.30(sec)"]
    assert seam[-4:] == [
        "L P[6:work_of_alph_5] 8mm/sec FINE",
        "WAIT 0.20(sec)",
        "DO[7]=OFF",
        "L P[7:work_of_alph_6] 12.5mm/sec FINE",
    ]


def test_a_speed_in_the_weld_data_is_that_of_the_motions_in_process() -> None:
    job = seam_job(process={**WELD, "feed_in": "weld1"})

    seam = instructions(FANUC_LS.render(job)[SEAM])

    assert [line for line in seam if "12.5mm/sec" in line] == [seam[3], seam[-1]]
    assert sum("WELD_SPEED" in line for line in seam) == 3
    assert "! if weld1 holds 8 mm/s ;" in FANUC_LS.render(job)[SEAM]
    rows = read_back(FANUC_LS, job)[0].robots["alpha"]
    np.testing.assert_allclose(rows.feeds[3:7], 0.008)


@pytest.mark.parametrize("process", [None, WELD, OUTPUT])
@pytest.mark.parametrize("changes", [{}, {"passes": 3}, {"passes": 3, "split": 4}], ids=str)
def test_seams_come_back_as_they_were(process, changes) -> None:
    job = seam_job(process=process, **{key: value for key, value in changes.items() if key == "passes"})
    job = replace(job, frame=replace(job.frame, split=changes.get("split")))
    written = job.programs[0].robots["alpha"]

    read = read_back(FANUC_LS, job)[0].robots["alpha"]

    on_seam = written.on_seam
    assert read.seams == written.seams
    np.testing.assert_array_equal(read.on_seam, on_seam)
    np.testing.assert_allclose(read.q[~on_seam], written.q[~on_seam], atol=2e-6)
    assert np.all(np.isnan(read.q[on_seam]))
    np.testing.assert_allclose(read.X_PT[on_seam][:, :3, 3], written.X_PT[on_seam][:, :3, 3], atol=1e-7)
    turned = np.swapaxes(read.X_PT[on_seam], 1, 2)[:, :3, :3] @ written.X_PT[on_seam][:, :3, :3]
    assert np.abs(rotation_vector(turned)).max() < 5e-6
    np.testing.assert_array_equal(
        read.configuration[on_seam], configuration(job.frame.robot("alpha"), written.q)[on_seam]
    )
    np.testing.assert_array_equal(read.feeds, written.feeds)
    np.testing.assert_array_equal(read.middles, written.middles)
    if process is not None:
        np.testing.assert_array_equal(read.process, written.process)
    assert np.all(read.rounding <= row_shares(job, job.programs[0])["alpha"] + 1e-12)
    assert np.count_nonzero(read.rounding) == 2 * len(written.seams)


def test_a_second_pass_has_no_name_of_another_task() -> None:
    job = seam_job(passes=2)
    cell = job.frame.cell
    other = replace(cell.tasks[0], name=f"{cell.tasks[0].name}_2")
    job = replace(job, frame=replace(job.frame, cell=replace(cell, tasks=(*cell.tasks, other))))

    assert "ALPHA_WORK_OF_ALPHA_2.ls" not in FANUC_LS.render(job)
    assert read_back(FANUC_LS, job)[0].robots["alpha"].seams == job.programs[0].robots["alpha"].seams


def message(job: ExportJob, old: str, new: str, *, file: str = SEAM) -> str:
    """What is said of a program in which something is replaced."""
    files = FANUC_LS.render(job)
    assert old in files[file]
    with pytest.raises(InputError) as error:
        FANUC_LS.read(job.frame, {**files, file: files[file].replace(old, new, 1)})
    return str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("UFRAME_NUM=4", "UFRAME_NUM=3", "expected UFRAME_NUM=4 as the cell states it"),
        ("UF : 4, UT : 2, CONFIG", "UF : 3, UT : 2, CONFIG", "expected UF : 4, UT : 2 of GP1"),
        ("UF : 4, UT : 2, CONFIG", "UF : 4, UT : 1, CONFIG", "expected UF : 4, UT : 2 of GP1"),
        (" CONFIG : 'N U T, 0, 0, 0',", "", "expected CONFIG, X in mm"),
        ("'N U T, 0", "'N X T, 0", "expected GPn: UF"),
        ("X = 0.0000 mm", "X = 0.0000 deg", "expected CONFIG, X in mm"),
        ("Weld Start[1,1]", "Weld Start[1,2]", "expected no such ending of a motion here"),
        ("Weld Start[1,1]", "Weld End[1,1]", "expected after this move, statements of its process"),
        ("Weave Sine[1]", "Weave Sine[2]", "expected after this move, statements of its process"),
        ("   6:  Weave Sine[1] ;\r\n", "", "expected after this move, statements of its process"),
        ("\r\n    :  Weld End[1,1]", "", "expected after this move, statements of its process"),
        ("\r\n    :  Weld Start[1,1]", "", "expected after this move, statements of its process"),
        ("8mm/sec CR3", "8mm/sec CNT100", "expected a statement that these programs have"),
        ("8mm/sec CR3", "8mm/sec CR1001", "expected a speed up to 2000 mm/sec, and FINE or CR0 to CR1000"),
        ("8mm/sec CR3", "8mm/sec CR3 Wjnt", "expected no such ending of a motion here"),
        ("8mm/sec CR3", "WELD_SPEED CR3", "expected the speed of the tool in mm/sec, got 'WELD_SPEED'"),
        ("8mm/sec CR3", "0mm/sec CR3", "expected a speed up to 2000 mm/sec"),
        ("12.5mm/sec FINE ;\r\n/POS", "12.5mm/sec CR9 ;\r\n/POS", "expected FINE at the last point"),
        ("12.5mm/sec FINE\r\n", "12.5mm/sec CR9\r\n", "expected FINE before it, got 'Weave Sine[1] behind CNT or CR'"),
        ("L P[3:work_of_alph_2] 8mm/sec", "J P[3:work_of_alph_2] 8%", "expected a statement that these programs have"),
        (
            "L P[3:work_of_alph_2] 8mm/sec CR3",
            "J P[3:work_of_alph_2] 8% FINE",
            "expected J outside of seams and at their first point",
        ),
        ("C P[4:work_of_alph_3]", "L P[4:work_of_alph_3]", "expected a statement that these programs have"),
        (
            "C P[4:work_of_alph_3]\r\n    :  P[5:work_of_alph_4]",
            "L P[5:work_of_alph_4]",
            "expected points that are used, got 'P[4]'",
        ),
        ("   7:L P[3:work_of_alph_2] 8mm/sec CR3 ;\r\n", "", "expected points that are used, got 'P[3]'"),
        (
            "    :  P[5:work_of_alph_4] 8mm/sec CR2 ;",
            "    :  P[5:work_of_alph_4] 8mm/sec CR2",
            "expected one numbered instruction",
        ),
        (
            "P[7:work_of_alph_6] 12.5mm/sec FINE ;",
            "P[7:work_of_alph_6] 12.5mm/sec FINE ;\r\n  99:  WAIT 1.00(sec) ;",
            "expected after this move",
        ),
        (
            "P[7:work_of_alph_6] 12.5mm/sec FINE ;",
            "P[7:work_of_alph_6] 12.5mm/sec FINE ;\r\n  99:  CALL OTHER ;",
            "expected after this move",
        ),
    ],
)
def test_a_broken_seam_is_refused(old: str, new: str, said: str) -> None:
    assert f"{SEAM}:" in (got := message(seam_job(process=WELD), old, new))
    assert said in got


def test_points_of_a_seam_are_named_after_its_task() -> None:
    text = FANUC_LS.render(seam_job(passes=2))[SEAM]

    assert re.findall(r'^P\[(\d+)(?::"(.*)")?\]\{', text, re.M) == [
        ("1", ""),
        *((str(number), f"work_of_alph_{number - 1}") for number in range(2, 8)),
    ]
    assert "P[" not in re.sub(r"P\[1\]|P\[(\d):work_of_alph_\d\]|P\[\d:\"work_of_alph_\d\"\]", "", text)


@pytest.mark.parametrize(
    ("point", "motion", "said"),
    [
        ("P[3]", "P[3]", ""),
        ('P[3:"corner"]', "P[3]", ""),
        ('P[3 : "the 2nd corner"]', "P[3:the 2nd corner]", ""),
        ('P[3:""]', "P[3]", ""),
        ("P[3]", "P[3:corner]", "expected P[3] with the name of the point, '', or with none, got 'corner'"),
        ('P[3:"corner"]', "P[3:edge]", "expected P[3] with the name of the point, 'corner', or with none, got 'edge'"),
        ('P[3:"a corner of a long name"]', "P[3]", "expected P[n]{ .. };"),
        ("P[3:corner]", "P[3]", "expected P[n]{ .. };"),
    ],
)
def test_names_of_points_may_be_others_or_none(point: str, motion: str, said: str) -> None:
    """They are changed on the pendant; a motion with that of another point is a point exchanged."""
    job = seam_job(process=WELD)
    text = FANUC_LS.render(job)[SEAM]
    assert text.count("P[3:work_of_alph_2]") == text.count('P[3:"work_of_alph_2"]') == 1
    text = text.replace("P[3:work_of_alph_2]", motion).replace('P[3:"work_of_alph_2"]', point)
    files = {**FANUC_LS.render(job), SEAM: text}

    if not said:
        assert FANUC_LS.read(job.frame, files)[0].robots["alpha"].seams == job.programs[0].robots["alpha"].seams
        return
    with pytest.raises(InputError, match=re.escape(said)):
        FANUC_LS.read(job.frame, files)


@pytest.mark.parametrize(
    ("old", "new"), [("0.30(sec)", "0.20(sec)"), ("DO[7]=OFF", "DO[7]=ON"), ("DO[7]=ON", "DO[8]=ON")]
)
def test_outputs_and_waits_of_a_seam_are_those_of_the_cell(old: str, new: str) -> None:
    assert "expected after this move, statements of its process" in message(seam_job(process=OUTPUT), old, new)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("CALL ALPHA_WORK_OF_ALPHA", "CALL ALPHA_WORK", "expected motions, the selection of frames, and calls of"),
        ("UTOOL_NUM=2 ;\r\n  15:J", "UTOOL_NUM=1 ;\r\n  15:J", "expected UTOOL_NUM=2"),
        ("J P[1] 10% FINE", "J P[1] 10% CNT100", "expected FINE before a seam"),
        ("J P[1] 10% FINE", "J P[1] 10% FINE Weld Start[1,1]", "expected no such ending of a motion here"),
    ],
)
def test_a_broken_main_program_is_refused(old: str, new: str, said: str) -> None:
    assert said in message(seam_job(process=WELD), old, new, file="ALPHA.ls")


def test_a_corner_in_process_that_would_be_a_stop_is_refused() -> None:
    job = seam_job(process=WELD)
    rows = job.programs[0].robots["alpha"]
    program = replace(job.programs[0], robots={"alpha": replace(rows, rounding=0.3 * rows.rounding)})

    with pytest.raises(NotVerifiedError, match=r"row 6: a corner in process may be rounded 0.85 mm before"):
        FANUC_LS.render(replace(job, programs=(program,)))


def test_what_lines_need_of_the_cell_is_refused_at_its_key() -> None:
    job = seam_job()
    robot = job.frame.cell.robots[0]

    def said(stations: tuple[Station, ...] | None = None, **control: object) -> str:
        assert robot.control is not None
        changed = replace(robot, control=robot.control.model_copy(update=control))
        frame = replace(job.frame, cell=replace(job.frame.cell, robots=(changed,)))
        frame = frame if stations is None else replace(frame, stations={"alpha": stations})
        with pytest.raises(InputError) as error:
            FANUC_LS.render(replace(job, frame=frame))
        return str(error.value)

    key = "robots.alpha.controller"
    assert said(tool_number=None).startswith(f"{key}.tool_number: expected the number of its tool frame")
    held = (Station(tasks=("work_of_alpha",), number=4, holder="table", X=np.eye(4)),)
    assert said(held).startswith("--moves linear: expected a part that no group of 'r30' holds, got 'table'")


def test_a_feed_that_cannot_be_written_is_refused() -> None:
    job = seam_job()
    rows = job.programs[0].robots["alpha"]
    program = replace(job.programs[0], robots={"alpha": replace(rows, feeds=rows.feeds * 1.003)})

    with pytest.raises(InputError, match=r"expected a feed up to 2000 mm/s with one decimal, got 12.5375"):
        FANUC_LS.render(replace(job, programs=(program,)))
