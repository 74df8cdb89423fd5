"""Arms of two makers that work in turn on a part at rest: lines and arcs are written, read back and judged."""

import re
import shutil
from pathlib import Path

import pytest
from builders.commands import run_command

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
