"""``cellplan recover`` from the shell: what is said, what is written, how it ends."""

import json
import shutil
from pathlib import Path

import pytest

from cellplan.cli.main import run
from cellplan.cli.real_cell.recover import speed_limits
from cellplan.errors import InputError


def command(sound: Path, folder: Path, *more: str) -> list[str]:
    """The command on the small cell."""
    return ["recover", str(sound / "run"), "--cell", str(sound / "cell" / "small.yaml"), "-o", str(folder), "-q", *more]


def test_the_order_the_clearance_and_the_duration_are_said(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = run(command(sound, tmp_path / "out", "--at", "0.5"))

    out, err = capsys.readouterr()
    assert (status, err) == (0, "")
    record = json.loads((tmp_path / "out" / "recovery.json").read_text(encoding="utf-8"))
    lines = out.splitlines()
    assert lines[0] == f"small-pair: recovery from 0.5 s, {record['duration_s']:.3f} s"
    assert lines[1].endswith("back: back along the program to the beginning of 'all tasks' at 0 s")
    assert lines[2].startswith("  smallest clearance ")
    assert lines[-1] == f"tables: {tmp_path / 'out' / 'tables'}"
    tables = sorted(f"tables/{path.name}" for path in (tmp_path / "out" / "tables").iterdir())
    names = [f"tables/{name}.csv" for name in ("clock", "idle", "left", "right")]
    assert tables == sorted(record["files"]) == names


def test_a_recovery_that_is_not_found_ends_with_three_and_takes_the_place_of_an_older_one(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = command(sound, tmp_path / "out", "--at", "0.5")
    older = {"schema": "cellplan.recovery/1", "files": {"tables/clock.csv": "", "tables/left.csv": ""}}
    (tmp_path / "out" / "tables").mkdir(parents=True)
    for name in older["files"]:
        (tmp_path / "out" / name).write_text("time_s\n", encoding="utf-8")
    (tmp_path / "out" / "recovery.json").write_text(json.dumps(older, indent=2), encoding="utf-8")

    status = run([*arguments, "--frozen", "right@0.45", "--json"])

    reported = json.loads(capsys.readouterr().out)
    assert (status, reported["exit"], reported["status"]) == (3, 3, "not_found")
    assert reported["schema"] == "cellplan.recovery/1"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["recovery.json"]


@pytest.mark.parametrize("text", ["right", "right@", "@0.4", "right@soon", "right@nan"])
def test_a_frozen_robot_has_a_name_and_a_time(
    sound: Path, tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    status = run(command(sound, tmp_path / "out", "--at", "0.5", "--frozen", text))

    assert (status, capsys.readouterr().err) == (
        2,
        f"error: --frozen: expected ROBOT@S, such as kuka@1.30, got '{text}'\n",
    )
    assert not (tmp_path / "out").exists()


def test_what_cellplan_did_not_write_is_not_replaced(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")

    status = run(command(sound, tmp_path, "--at", "0.5"))

    assert status == 2
    assert "something else" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.slow
def test_the_run_may_hold_its_recovery(sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(sound / "run", tmp_path / "run")
    cell = ["--cell", str(sound / "cell" / "small.yaml")]

    assert run(["recover", str(tmp_path / "run"), "--at", "0.5", "-q", *cell]) == 0
    assert (tmp_path / "run" / "recover" / "recovery.json").is_file()
    assert run(["verify", str(tmp_path / "run"), "-q", *cell]) == 0
    capsys.readouterr()


def test_a_percentage_may_have_its_sign_and_what_is_not_given_is_left_to_the_cell() -> None:
    assert speed_limits("25%", None) == speed_limits("25", None) == {"speed_percent": 25.0}
    assert speed_limits(None, 250.0) == {"tcp_mm_s": 250.0}
    assert speed_limits(None, None) == {}


@pytest.mark.parametrize(
    ("speed", "tcp_speed", "message"),
    [
        ("fast", None, "--speed: expected 1 to 100 percent, such as 25%, got 'fast'"),
        ("0.25", None, "--speed: expected 1 to 100 percent, such as 25%, got '0.25'"),
        ("120%", None, "--speed: expected 1 to 100 percent, such as 25%, got '120%'"),
        ("nan", None, "--speed: expected 1 to 100 percent, such as 25%, got 'nan'"),
        (None, 0.0, "--tcp-speed: expected a speed above 0 up to 10000 mm/s, got 0"),
        (None, float("nan"), "--tcp-speed: expected a speed above 0 up to 10000 mm/s, got nan"),
    ],
)
def test_other_speeds_are_refused(speed: str | None, tcp_speed: float | None, message: str) -> None:
    with pytest.raises(InputError) as refused:
        speed_limits(speed, tcp_speed)

    assert str(refused.value) == message
