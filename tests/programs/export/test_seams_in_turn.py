"""Lines and arcs of solved cells, on parts at rest and on one that a positioner turns: written, read back, judged."""

import json
import re
import shutil
from pathlib import Path

import pytest
from builders.commands import run_command

from cellplan import open_gate
from cellplan.errors import LineRefusedError
from cellplan.model.report.exported import Moves, Promise
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.export.choice import Choice
from cellplan.programs.export.prepare import prepare

CELL = Path(__file__).resolve().parents[3] / "cells" / "in_turn.yaml"
MOVES = {"krl": ("kuka.src", r"^(?:LIN|CIRC|PTP) "), "val3": ("staubli/rectangle.pgx", r"^  move[jlc]\(")}


@pytest.mark.slow
def test_seams_of_two_makers_are_written_and_verified(tmp_path: Path) -> None:
    """At most twelve motions to a seam; a point 0.2 mm off is found on disk."""
    shutil.copy(CELL, tmp_path / "cell.yaml")
    assert run_command("cellplan solve cell.yaml -o run -q", tmp_path)[0] == 0
    for form, (file, motion) in MOVES.items():
        words = f"run --cell cell.yaml --format {form} --moves linear -o {form}"
        status, out, _ = run_command(f"cellplan export {words}", tmp_path)
        assert status == 0
        assert "  promise: paced" in out
        text = (tmp_path / form / file).read_bytes().decode()
        seam = text.partition("DEF circle()")[2] if form == "krl" else text
        assert 6 <= len(re.findall(motion, seam.replace("\r\n", "\n"), re.M)) <= 12
        verify = f"cellplan verify {form} --run run --cell cell.yaml -q"
        assert run_command(verify, tmp_path)[0] == 0

    data = tmp_path / "krl" / "kuka.dat"
    data.write_bytes(re.sub(rb"(E6POS circle_3={X )150\.0", rb"\g<1>150.2", data.read_bytes()))
    status, out, error = run_command("cellplan verify krl --run run --cell cell.yaml -q", tmp_path)
    assert status != 0
    assert "0.2 mm" in out + error or "kuka.dat" in out + error


BEAD = Path(__file__).resolve().parents[3] / "examples" / "seams" / "bead.yaml"
ROBOTS = {  # model, home, what its controller counts from, and how it begins and ends a process
    "krl": (
        "kuka_kr16_2",
        "[0, -90, 90, 0, 60, 0]",
        "{id: box, tool_number: 2, base: {xyz_mm: [0, 0, 100], rpy_deg: [0, 0, 90]}}",
        "{kind: kuka, process: {on: '$OUT[7]=TRUE', off: '$OUT[7]=FALSE'}}",
    ),
    "urscript": (
        "ur10e",
        "[180, -90, 90, -90, -90, 0]",
        "{id: box, base: {rpy_deg: [0, 0, 180]}}",
        "{kind: ur, process: {on: 'glue({data})', off: 'glue(0)', data: {ring: '1', corner: '2'}}}",
    ),
}
CHANGES = {
    "krl": ("arm.src", [("$VEL.CP=0.04", "$VEL.CP=0.05"), ("TOOL_DATA[2]", "TOOL_DATA[1]"), ("7]=TRUE", "7]=FALSE")]),
    "urscript": ("arm.script", [("glue(1)", "glue(2)"), ("part_1 = p[-0.75", "part_1 = p[0.75"), ("v=0.04", "v=0.05")]),
}


@pytest.mark.slow
@pytest.mark.parametrize("form", ROBOTS)
def test_a_bead_is_written_for_other_makers(form: str, tmp_path: Path) -> None:
    """An arm without a spherical wrist, and controllers that count from a base of their own."""
    model, home, control, controller = ROBOTS[form]
    tool = "{mass_kg: 1, rod: {length_mm: 250, tilt_deg: 35, radius_mm: 10, stick_out_mm: 15}}"
    robot = f"robots: {{arm: {{model: {model}, tool: {tool}, home_deg: {home}, controller: {control}}}}}\n"
    head, _, rest = BEAD.read_text(encoding="utf-8").partition("robots:\n")
    part = (
        rest[rest.index("part:") :]
        .replace("[1000, 0, 300]", "[750, 0, 150]")
        .replace("[500, 400, 60]", "[300, 300, 60]")
    )
    for far, near in (("[-200, -150,", "[-100, -100,"), ("[200, -150,", "[100, -100,"), ("[200, 150,", "[100, 100,")):
        part = part.replace(far, near)
    (tmp_path / "cell.yaml").write_text(f"{head}{robot}controllers: {{box: {controller}}}\n{part}", encoding="utf-8")
    assert run_command("cellplan solve cell.yaml -o run -q", tmp_path)[0] == 0

    status, out, _ = run_command(f"cellplan export run --cell cell.yaml --format {form} --moves linear -o p", tmp_path)

    assert (status, "  promise: paced" in out) == (0, True)
    verify = "cellplan verify p --run run --cell cell.yaml -q"
    assert run_command(verify, tmp_path)[0] == 0
    name, changes = CHANGES[form]
    text = (tmp_path / "p" / name).read_bytes().decode()
    for old, new in changes:
        assert old in text
        (tmp_path / "p" / name).write_bytes(text.replace(old, new, 1).encode())
        assert run_command(verify, tmp_path)[0] != 0


TABLE = BEAD.with_name("ring_on_table.yaml")
OF_BOTH = {  # changes of the files of an arm and its positioner, each of them noticed on disk
    "arm.src": [("MACHINE_DEF[2].ROOT", "MACHINE_DEF[3].ROOT"), ("$VEL.CP=0.04", "$VEL.CP=0.05"), ("C_DIS", "")],
    "arm.dat": [
        ("PART_FRAME_1={X 0.0", "PART_FRAME_1={X 0.2"),
        ("E1 -1", "E1 -2"),
        ("ring_4={X -150.0", "ring_4={X -150.2"),
    ],
}


@pytest.mark.slow
def test_a_ring_is_welded_while_a_positioner_turns_the_block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The table moves in the seam, whose points are few; where its lines are refused, the same run moves by joints."""
    shutil.copy(TABLE, tmp_path / "cell.yaml")
    assert run_command("cellplan solve cell.yaml -o run -q", tmp_path)[0] == 0

    status, out, _ = run_command("cellplan export run --cell cell.yaml --format krl --moves linear -o p", tmp_path)

    assert (status, "  promise: synchronised" in out) == (0, True)
    source, data = ((tmp_path / "p" / f"arm.{ending}").read_bytes().decode() for ending in ("src", "dat"))
    seam = source.partition("DEF ring()")[2].split("\r\n")
    motions = [line.partition(" ")[0] for line in seam if re.match(r"PTP |LIN |CIRC ", line)]
    assert motions[0] == "PTP"
    assert motions.count("CIRC") >= 3
    assert len(motions) <= 12
    turned = [float(angle) for angle in re.findall(r"E6POS ring_.*?,E1 (\S+?),", data)]
    assert max(turned) - min(turned) > 3.0
    verify = "cellplan verify p --run run --cell cell.yaml -q"
    assert run_command(verify, tmp_path)[0] == 0
    for name, changes in OF_BOTH.items():
        text = (tmp_path / "p" / name).read_bytes().decode()
        for old, new in changes:
            assert old in text
            (tmp_path / "p" / name).write_bytes(text.replace(old, new, 1).encode())
            assert run_command(verify, tmp_path)[0] != 0
        (tmp_path / "p" / name).write_bytes(text.encode())

    def refused(*_: object) -> None:
        raise LineRefusedError("ring", ", 3 mm along its seam: it cannot")

    monkeypatch.setattr("cellplan.programs.export.prepare.executed_programs", refused)
    run = open_gate(tmp_path / "run", cell=tmp_path / "cell.yaml")
    by_joints = prepare(run, DIALECTS["krl"], Choice(moves=Moves.AUTO))
    assert by_joints.promised.promise is Promise.SYNCHRONISED
    assert by_joints.promised.reasons[-1] == "no lines: task 'ring': 3 mm along its seam: it cannot"
    assert not re.search("LIN|CIRC|EK", DIALECTS["krl"].render(by_joints.job)["arm.src"])


@pytest.mark.slow
def test_an_arm_and_its_positioner_wait_for_an_arm_of_another_controller(tmp_path: Path) -> None:
    """The table turns under the first seam and never waits by itself; any order of both controllers is certified."""
    shutil.copy(TABLE.with_name("ring_beside.yaml"), tmp_path / "cell.yaml")
    assert run_command("cellplan solve cell.yaml -o run -q", tmp_path)[0] == 0
    export = "cellplan export run --cell cell.yaml --format krl --format rapid --moves linear -o p"
    assert run_command(export, tmp_path)[0] == 0
    records = [json.loads((tmp_path / "p" / form / "export.json").read_text()) for form in ("krl", "rapid")]

    assert [record["promise"] for record in records] == ["paced", "paced"]
    assert records[0]["marks"][0]["certified"] == records[1]["marks"][0]["certified"]
    pairs = [pair for stretch in records[0]["marks"][0]["certified"] for pair in stretch["pairs"]]
    assert {tuple(pair) for pair in pairs} == {("table", "other"), ("arm", "other")}
    source, data = ((tmp_path / "p" / "krl" / f"arm.{ending}").read_bytes().decode() for ending in ("src", "dat"))
    turned = [float(angle) for angle in re.findall(r"E6POS ring_.*?,E1 (\S+?),", data)]
    assert max(turned) - min(turned) > 1.0
    assert source.count("WAIT FOR $IN[1]\r\n") == len(records[0]["marks"][0]["times_s"])
    verify = "cellplan verify p/krl --run run --cell cell.yaml -q"
    assert run_command(verify, tmp_path)[0] == 0
    (tmp_path / "p" / "krl" / "arm.src").write_bytes(source.replace("WAIT FOR $IN[1]\r\n", "", 1).encode())
    assert run_command(verify, tmp_path)[0] != 0


@pytest.mark.slow
def test_a_fanuc_arm_welds_a_ring_relative_to_its_positioner(tmp_path: Path) -> None:
    """At most twelve statements of motion and process, in step; three of the numbers are changed on disk."""
    text = TABLE.read_text(encoding="utf-8").replace("kind: kuka", "kind: fanuc")
    text = text.replace("'$OUT[5]=TRUE'", "'Arc Start[1]'").replace("'$OUT[5]=FALSE'", "'Arc End[1]'")
    text = text.replace("{id: krc, tool_number: 1,", "{id: krc, group: 1, tool_number: 1,")
    (tmp_path / "cell.yaml").write_text(text.replace("{id: krc, machine: 2,", "{id: krc, group: 2,"), encoding="utf-8")
    export = "cellplan export run --cell cell.yaml --format fanuc_ls --moves linear -o p"
    for command in ("cellplan solve cell.yaml -o run -q", export):
        assert run_command(command, tmp_path)[0] == 0

    path = tmp_path / "p" / "KRC_RING.ls"
    seam = path.read_bytes().decode()
    motions = re.findall(r"(?m)^ *\d+:([JLC]) P", seam)
    assert (motions[0], motions[1], motions[-1]) == ("J", "L", "L")
    assert len(motions) <= 10
    assert len(re.findall(r"\w COORD", seam)) == len(motions) - 1
    turned = [float(angle) for angle in re.findall(r"GP2:\s+UF : 0, UT : 1,\s+J1 = \S+ deg, J2 = (\S+) deg", seam)]
    assert max(turned) - min(turned) > 3.0
    verify = "cellplan verify p --run run --cell cell.yaml -q"
    assert run_command(verify, tmp_path)[0] == 0
    for old, new in (
        ("40mm/sec", "41mm/sec"),
        ("CR1 COORD", "CR1"),
        (f"J2 = {turned[3]:.4f}", f"J2 = {turned[3] + 1:.4f}"),
    ):
        assert old in seam
        path.write_bytes(seam.replace(old, new, 1).encode())
        assert run_command(verify, tmp_path)[0] != 0
