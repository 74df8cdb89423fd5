"""Robots, meshes and toolpaths with injuries: read, or refused in one plain line; never a crash, a hang or a trace."""

import re
import time
from pathlib import Path
from random import Random

import pytest
from fuzz import hostile_files

from cellplan.cli.terminal.errors import error_lines
from cellplan.errors import InputError, OverrunError
from cellplan.files.cell.load import load_cell

LONGEST_S = 10.0
LINE = re.compile(r"[\w./-]+(:\d+)?: \S.*")


def outcome(folder: Path, file: str, seed: int) -> str:
    """What became of one injured file; all that must never happen is asserted."""
    injury, data = hostile_files.injured(hostile_files.SOUND[file](), Random(f"{file}/{seed}"))
    (folder / file).write_bytes(data)
    (folder / "c.yaml").write_text(hostile_files.cell_with(file), encoding="utf-8")
    where = f"{file}, seed {seed}, {injury}"
    began = time.monotonic()
    try:
        load_cell(folder / "c.yaml")
        reported = "read"
    except OverrunError as error:
        pytest.fail(f"{where}: {error}")
    except InputError as error:
        reported = "refused"
        for line in error_lines(error):
            plain = line.removeprefix("error: ").replace(f"{folder}/", "")
            assert LINE.fullmatch(plain), f"{where}: {line}"
            assert line.isprintable(), where
    assert time.monotonic() - began < LONGEST_S, where
    return reported


def outcomes(folder: Path, file: str, seeds: range) -> list[str]:
    result = [outcome(folder, file, seed) for seed in seeds]
    assert sorted(path.name for path in folder.iterdir()) == sorted([file, "c.yaml"])
    return result


@pytest.mark.parametrize("file", hostile_files.SOUND)
def test_a_sound_file_is_read(tmp_path: Path, file: str) -> None:
    (tmp_path / file).write_bytes(hostile_files.SOUND[file]())
    (tmp_path / "c.yaml").write_text(hostile_files.cell_with(file), encoding="utf-8")

    assert load_cell(tmp_path / "c.yaml").name == "hostile"


@pytest.mark.parametrize("file", hostile_files.SOUND)
def test_injured_files_are_read_or_refused(tmp_path: Path, file: str) -> None:
    assert "refused" in outcomes(tmp_path, file, range(12))


@pytest.mark.slow
@pytest.mark.parametrize("file", hostile_files.SOUND)
def test_very_many_injured_files_are_read_or_refused(tmp_path: Path, file: str) -> None:
    result = outcomes(tmp_path, file, range(1000, 1400))

    assert result.count("refused") > 0.7 * len(result)
