"""A ring welded by a FANUC arm on lines and arcs: exported, read back, and every change of its programs noticed."""

import json
import re
import shutil
from pathlib import Path

import pytest
from builders.vendor_cells import CELL, solve_into

from cellplan import VerifiedRun, export_program, open_gate
from cellplan.errors import InputError, NotVerifiedError
from cellplan.files.input.files import digest
from cellplan.model.report.exported import Moves
from cellplan.programs.export.choice import Choice
from cellplan.programs.export.stored import read_stored_export
from cellplan.programs.export.verify_export import verify_export

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("stored_solutions")]

SEAM = "RIGHT_FRAME.ls"
STATEMENTS = "process: {on: ['Weave Sine[1]', 'Weld Start[1,1]'], off: ['Weld End[1,1]', 'Weave End']}"
WORK = """circle: {radius_mm: 40, plane: xz}, project: +y}
    approach_mm: 50
    approach_s: 1
    retract_mm: 50
    retract_s: 1
    process: {feed_mm_s: 20, on_delay_s: 0.3, off_delay_s: 0.2}"""
CHANGES = {
    "feed": ("P[4:frame_3] 20mm/sec", "P[4:frame_3] 21mm/sec"),
    "weld data": ("Weld Start[1,1]", "Weld Start[1,2]"),
    "user frame": ("UFRAME_NUM=3", "UFRAME_NUM=2"),
    "user frame of a point": ("UF : 3, UT : 1, CONFIG", "UF : 2, UT : 1, CONFIG"),
    "tool": ("UT : 1, CONFIG", "UT : 2, CONFIG"),
    "wrist": ("'N U T", "'F U T"),
    "elbow": ("'N U T", "'N D T"),
    "side": ("'N U T", "'N U B"),
    "turn": ("T, 0, 0, 0", "T, 0, 0, 1"),
    "on and off": ("Weld Start[1,1]", "Weld End[1,1]"),
    "no end of the weld": ("\r\n    :  Weld End[1,1]", ""),
    "no end of the weave": ("  Weave End ;", "   ;"),
    "other weave": ("Weave Sine[1]", "Weave Sine[2]"),
    "CNT at the end of the weld": ("P[8:frame_7] 20mm/sec FINE", "P[8:frame_7] 20mm/sec CNT100"),
    "corner at the end of the weld": ("P[8:frame_7] 20mm/sec FINE", "P[8:frame_7] 20mm/sec CR20"),
    "larger corner": ("P[4:frame_3] 20mm/sec CR2", "P[4:frame_3] 20mm/sec CR20"),
    "line for an arc": ("C P[3:frame_2]\r\n    :  P[4:frame_3]", "L P[4:frame_3]"),
    "joints for a line": ("L P[9:frame_8] 93.8mm/sec", "J P[9:frame_8] 10%"),
    "handshake": ("DO[1]=ON", "DO[1]=OFF"),
}


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, VerifiedRun]:
    """The folder of programs, and its run."""
    folder = tmp_path_factory.mktemp("ring")
    text = CELL.format(
        first="kuka",
        second="fanuc",
        decimals=5,
        tasks="",
        task=", tool_number: 1, frames: [3], base: {}, tool_frame: {}",
        output=1,
        entry=2,
    )
    text = text.replace("latency_ms: 40}", f"latency_ms: 40, {STATEMENTS}}}", 2).replace(
        f"kuka, latency_ms: 40, {STATEMENTS}", "kuka, latency_ms: 40"
    )
    text = text.replace("rectangle: {sides_mm: [200, 80], plane: xz}, project: +y}", WORK)
    text = text.replace("duration_s: 4, step_s: 0.04", "step_s: 0.02")
    text = text.replace("orientation_deg: 0.5}\n  frame", "orientation_deg: 0.5}\n    feed_mm_s: 30\n  frame")
    (folder / "cell.yaml").write_text(text, encoding="utf-8")
    solve_into(folder / "cell.yaml", folder / "run")
    run = open_gate(folder / "run", cell=folder / "cell.yaml")
    export_program(run, folder / "programs", form="fanuc_ls", choice=Choice(moves=Moves.LINEAR))
    return folder / "programs", run


def test_a_ring_is_welded_by_few_statements_at_its_feed(exported: tuple[Path, VerifiedRun]) -> None:
    folder, run = exported
    text = (folder / SEAM).read_bytes().decode().replace("\r\n    :  ", " ")
    said = re.findall(r"(?m)^ *\d+:\s*([^!;\r]*?) ;", text)
    moves = [line for line in said if not re.match(r"DO\[|WAIT DI", line)]

    assert json.loads((folder / "export.json").read_text(encoding="utf-8"))["promise"] == "paced"
    assert len(moves) <= 12
    assert sum(line.startswith("C ") for line in moves) == 3
    working = moves[moves.index("Weave Sine[1]") + 1 : moves.index("Weave End")]
    assert working
    assert all(" 20mm/sec " in line for line in working)
    assert verify_export(read_stored_export(folder), run).remarks == ()


def noticed(exported: tuple[Path, VerifiedRun], place: Path, text: str) -> str:
    """What is said of the program of the seam with another text, whose digest fits."""
    folder, run = exported
    copy = shutil.copytree(folder, place / "copy")
    record = json.loads((copy / "export.json").read_text(encoding="utf-8"))
    record["files"][SEAM] = digest(text.encode())
    (copy / "export.json").write_text(json.dumps(record), encoding="utf-8")
    (copy / SEAM).write_bytes(text.encode())
    with pytest.raises((InputError, NotVerifiedError)) as error:
        verify_export(read_stored_export(copy), run)
    return str(error.value)


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_of_a_seam_is_noticed(change: str, exported: tuple[Path, VerifiedRun], tmp_path: Path) -> None:
    old, new = CHANGES[change]
    text = (exported[0] / SEAM).read_bytes().decode()

    assert old in text
    assert noticed(exported, tmp_path, text.replace(old, new, 1))


@pytest.mark.parametrize("place", range(0, 24, 4))
def test_a_point_that_is_off_is_noticed(place: int, exported: tuple[Path, VerifiedRun], tmp_path: Path) -> None:
    text = (exported[0] / SEAM).read_bytes().decode()
    number = list(re.finditer(r"[XYZ] = (-?[\d.]+) mm", text))[place]
    moved = f"{text[: number.start(1)]}{float(number[1]) + 0.2:.4f}{text[number.end(1) :]}"

    assert "read a pose that is 0.2 mm" in noticed(exported, tmp_path, moved)
