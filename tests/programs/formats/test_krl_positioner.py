"""KUKA programs of an arm on a rail and of a positioner on its controller: one module, all axes in each point."""

import re
from dataclasses import replace

import numpy as np
import pytest
from builders.export_jobs import (
    cell_of,
    controlled,
    job_of,
    largest_deviation,
    positioner_model,
    rail_model,
    random_program,
    zero_of,
)

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportJob, Promise
from cellplan.programs.elements.joints import from_numbers
from cellplan.programs.formats.krl.writer import KRL
from cellplan.programs.judgement.compare_rows import other_rows

QUANTUM = np.deg2rad(1e-5)


def in_step(*, rows: int = 20, **changes: object) -> ExportJob:
    """A job of a table and of an arm on a rail, which one controller moves; the table comes first in the cell."""
    arm = replace(rail_model(), controller=zero_of(7))
    cell = cell_of(controlled("table", positioner_model(), id="krc"), controlled("alpha", arm, id="krc"), kind="kuka")
    return job_of(cell, random_program(cell, rows=rows), promise=Promise.SYNCHRONISED, **changes)


@pytest.mark.parametrize("changes", [{}, {"split": 6}, {"blend": 0.3, "split": 7}], ids=str)
def test_rows_of_both_come_back_to_the_rounding(changes: dict[str, object]) -> None:
    job = in_step(**changes)

    files = KRL.render(job)
    (read,) = KRL.read(job.frame, files)

    assert all(path.startswith("alpha") for path in files)
    assert set(read.robots) == {"alpha", "table"}
    for robot in read.robots:
        assert largest_deviation(job, (read,), robot) <= 2.0 * QUANTUM
    assert np.array_equal(read.robots["alpha"].rounding, read.robots["table"].rounding)
    assert not any(word in "".join(files.values()) for word in ("$OUT", "WAIT"))


def test_a_point_has_the_arm_then_its_rail_then_the_table() -> None:
    """The numbers of the text, taken without the reader."""
    job = in_step()
    rows = job.programs[0].robots

    data = KRL.render(job)["alpha.dat"]

    points = np.array(
        [
            [float(number) for number in re.findall(r"[AE]\d (-?[\d.]+)", line)]
            for line in data.splitlines()
            if line.startswith("DECL E6AXIS")
        ]
    )
    assert points.shape == (20, 12)
    arm = from_numbers(job.frame.robot("alpha"), points[:, [6, 0, 1, 2, 3, 4, 5]])
    np.testing.assert_allclose(arm, rows["alpha"].q, rtol=0.0, atol=2.0 * QUANTUM)
    np.testing.assert_allclose(np.deg2rad(points[:, 7:9]), rows["table"].q, rtol=0.0, atol=QUANTUM)
    assert not np.any(points[:, 9:])


def test_the_arm_is_rounded_while_the_table_stands_and_neither_where_one_stops() -> None:
    job = in_step(blend=0.3)
    program = job.programs[0]
    table = replace(program.robots["table"], q=np.repeat(program.robots["table"].q[:1], 20, axis=0))
    stopping = replace(program.robots["table"], q=program.robots["table"].q.copy())
    stopping.q[12:] = stopping.q[12]

    def rounding(rows) -> np.ndarray:
        changed = replace(program, robots={**program.robots, "table": rows})
        (read,) = KRL.read(job.frame, KRL.render(replace(job, programs=(changed,))))
        assert read.robots["alpha"].rounding is not None
        return read.robots["alpha"].rounding

    passed = rounding(table)
    assert np.count_nonzero(passed) > 10
    assert set(np.unique(passed)) == {0.0, 0.3}
    assert rounding(stopping)[12] == 0.0
    assert passed[12] == 0.3


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (("E2 ", "E6 "), "expected each axis once with a plain decimal number"),
        (("E5 0.00000", "E5 0.10000"), "expected values for the 9 axes of the robot and for no other"),
        (("E3 ", "A3 "), "expected each axis once with a plain decimal number"),
    ],
)
def test_other_external_axes_are_refused(wrong: tuple[str, str], words: str) -> None:
    job = in_step()
    files = KRL.render(job)

    with pytest.raises(InputError, match=words):
        KRL.read(job.frame, files | {"alpha.dat": files["alpha.dat"].replace(*wrong, 1)})


def test_signals_are_refused_in_step() -> None:
    job = in_step()
    files = KRL.render(job)

    for line in ("$OUT[1]=FALSE\r\n", "WAIT FOR $IN[1]\r\n"):
        text = files["alpha.src"].replace("PTP XP3\r\n", f"PTP XP3\r\n{line}")
        with pytest.raises(InputError, match="expected signals only once after an exact stop at a mark"):
            KRL.read(job.frame, files | {"alpha.src": text})


def test_more_axes_than_a_point_holds_are_refused() -> None:
    tables = [controlled(f"table{number}", positioner_model(), id="krc") for number in range(3)]
    cell = cell_of(controlled("alpha", rail_model(), id="krc"), *tables, kind="kuka")

    with pytest.raises(InputError, match=r"robots.alpha: expected at most 6 external axes with it .*, got 7"):
        KRL.render(job_of(cell, random_program(cell), promise=Promise.SYNCHRONISED))


def test_beside_another_arm_both_are_rounded_alike_and_the_arm_alone_waits() -> None:
    """The table stands first in the cell, and has no signals: the arm that moves it leads."""
    arm = replace(rail_model(), controller=zero_of(7))
    table, alpha = controlled("table", positioner_model(), id="krc"), controlled("alpha", arm, id="krc")
    cell = cell_of(table, alpha, controlled("beta", rail_model(), id="another"), kind="kuka")
    job = job_of(cell, random_program(cell, marks=(0, 7, 19)), blend=0.3)

    files = KRL.render(job)
    (read,) = KRL.read(job.frame, files)

    assert sorted(files) == ["alpha.dat", "alpha.src", "beta.dat", "beta.src"]
    for robot, rows in read.robots.items():
        assert rows.marks == (0, 7, 19)
        assert largest_deviation(job, (read,), robot) <= 2.0 * QUANTUM
    assert np.array_equal(read.robots["alpha"].rounding, read.robots["table"].rounding)
    assert list(other_rows(KRL, job, (read,))) == []
    assert [re.findall(r"\$(?:OUT|IN)\[\d+\]", files[f"{name}.src"])[1:5] for name in ("alpha", "beta")] == [
        ["$IN[112]", "$OUT[11]", "$IN[112]", "$OUT[11]"],
        ["$OUT[12]", "$IN[121]", "$OUT[12]", "$IN[121]"],
    ]
    files["alpha.dat"] = re.sub(r"(XP9=.*E2) \S+,", r"\1 0.00000,", files["alpha.dat"])
    assert "robot 'table': row 9: expected joint tilt" in "".join(other_rows(KRL, job, KRL.read(job.frame, files)))
