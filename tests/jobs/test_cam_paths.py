"""Paths of CAM from the file to programs: feeds and rapids in rows, checks, reports and exports."""

import json
import re
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.cam_files import GCODE_HEAD, as_gcode, dome, dome_apt, milling_cell
from builders.commands import run_command

from cellplan import load_cell, solve
from cellplan.errors import InputError
from cellplan.files.run.clock_table import parse_clock
from cellplan.model.task.task import Task
from cellplan.planning.path.build import build_toolpath
from cellplan.runs.plan.start import depths_on_paths

# two cuts on the ball, 30 and 15 mm/s, with rapids over it between them
CUTS = f"""{GCODE_HEAD}S8000 M3
G0 X-10 Y0 Z220
G1 Z199.7498 F1800
G1 X10
G0 Z220
G0 Y10
G0 Z199.4994
G1 X-10 F900
G0 Z250
M30
"""
MORE = """    tool_axis: -z
    process: {on_delay_s: 0.1, off_delay_s: 0.05, ramp_s: 0.05}
    off_part: [run_in]
    standoff_mm: [0, 3]
"""
CONTROLLER = "controllers:\n  krc: {kind: kuka, process: {on: '$OUT[5]=TRUE', off: '$OUT[5]=FALSE'}}\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the cell, with its run."""
    folder = tmp_path_factory.mktemp("cam")
    (folder / "cuts.nc").write_text(CUTS)
    text = milling_cell("{gcode: {file: cuts.nc, transfer_mm_s: 100}}", more=MORE)
    text = text.replace("robots:\n  arm:\n", f"{CONTROLLER}robots:\n  arm:\n    controller: {{id: krc}}\n")
    (folder / "cell.yaml").write_text(text)
    status, out, err = run_command("cellplan solve cell.yaml -o run", folder)
    assert status == 0, f"{out}\n{err}"
    return folder


def test_the_rows_have_the_feed_of_each_cut_and_the_speed_of_rapids(folder: Path) -> None:
    table = parse_clock((folder / "run/tables/clock.csv").read_text(), "clock.csv").table
    speeds = 1e3 * np.diff(table.lengths["mill"]) / np.diff(table.times)

    on = table.process["mill"][:-1] & table.process["mill"][1:]
    assert speeds[on].max() == pytest.approx(30.0, rel=1e-9)
    assert speeds[~on].max() == pytest.approx(100.0, rel=1e-9)
    ends = np.flatnonzero(np.diff(on.astype(int)))
    assert len(ends) in {2, 3}  # off at the rapids, and at the end where a row is left over
    assert speeds[ends[1] + 1 : len(speeds) - 1].max() == pytest.approx(15.0, rel=1e-9)


def test_the_distance_from_the_part_is_judged_where_the_process_is_on_before_there_is_a_motion(folder: Path) -> None:
    cell = load_cell(folder / "cell.yaml")
    (task,) = cell.tasks
    lifted = replace(task, path=replace(task.path, is_rapid=np.zeros(len(task.path.speeds), dtype=bool)))

    def failures(task: Task) -> list[str]:
        part = replace(cell, tasks=(task,))
        return [check.name for check in depths_on_paths(part, {task.name: build_toolpath(task, cell.part)})]

    assert failures(task) == []
    assert failures(lifted) == ["standoff"]  # 20 mm above the ball with the process on


@pytest.mark.slow
def test_the_report_says_what_is_not_part_of_the_path_and_when_the_process_is_off(folder: Path) -> None:
    report = json.loads((folder / "run/report.json").read_text())

    task = report["tasks"]["mill"]
    ((begin, end),) = task["process_off_s"]
    assert begin == pytest.approx(0.1 + 40.2502 / 30 + 2 * 0.05 + 0.05, abs=1e-3)
    assert end < task["end_s"]
    checks = {check["name"]: check for check in report["checks"]}
    assert checks["process_feed"]["passed"]
    out = run_command("cellplan check cell.yaml", folder)[1]
    assert "not part of the path: M3 (1), S (1), moves before the first feed and after the last (1)" in out
    assert run_command("cellplan verify run --cell cell.yaml", folder)[0] == 0


def test_the_cell_of_the_run_solves_to_the_same_tables(folder: Path) -> None:
    (folder / "again.yaml").write_text((folder / "run/cell.yaml").read_text())
    again = solve(load_cell(folder / "again.yaml"))

    written = (folder / "run/tables/arm.csv").read_text().splitlines()
    assert again.program.tables["arm"].splitlines()[-100:] == written[-100:]


def test_programs_of_rows_hold_the_process(folder: Path) -> None:
    status, _, err = run_command("cellplan export run --format json --cell cell.yaml -o rows", folder)
    assert status == 0, err
    (arm,) = json.loads((folder / "rows/program.json").read_text())["robots"]
    flags = np.array(arm["process"])
    assert np.count_nonzero(np.diff(flags) == 1) == 1  # on again behind the rapids
    assert 0.3 < flags.mean() < 0.9


# two feeds on one straight cut, between which the tool does not stop, and a rapid to another cut
TWO_FEEDS = f"""{GCODE_HEAD}S8000 M3
G0 X-10 Y0 Z200.5
G1 X0 F1800
G1 X10 F900
G0 Z220
G0 Y10
G0 Z200.5
G1 X-10 F1200
G0 Z250
M30
"""


@pytest.mark.slow
def test_each_feed_is_a_line_of_its_own_speed_and_rapids_are_out_of_process(folder: Path, tmp_path: Path) -> None:
    cell = (folder / "cell.yaml").read_text().replace("    off_part:", "    approach_mm: 20\n    off_part:")
    for name, text in {"cuts.nc": TWO_FEEDS, "cell.yaml": cell}.items():
        (tmp_path / name).write_text(text)
    for command in (
        "cellplan solve cell.yaml -o run",
        "cellplan export run --format krl --moves linear --cell cell.yaml -o lines",
    ):
        status, out, err = run_command(command, tmp_path)
        assert status == 0, f"{out}\n{err}"
    program, points = ((tmp_path / "lines" / f"arm.{suffix}").read_text() for suffix in ("src", "dat"))
    at = {name: float(x) for name, x in re.findall(r"E6POS (\w+)=\{X ([-.\d]+)", points)}

    state: dict[str, float] = {"on": 0.0, "feed": 0.0, "x": -10.0}
    cuts, rapids = [], []
    for line in program.splitlines():
        if match := re.search(r"\$OUT\[5\]=(TRUE|FALSE)", line):
            state["on"] = float(match[1] == "TRUE")
        elif match := re.match(r"\s*\$VEL\.CP=([.\d]+)", line):
            state["feed"] = 1e3 * float(match[1])
        elif match := re.match(r"\s*S?LIN (\w+)", line):
            (cuts if state["on"] else rapids).append((round(state["x"]), round(at[match[1]]), state["feed"]))
            state["x"] = at[match[1]]
    assert cuts == [(-10, 0, 30.0), (0, 10, 15.0), (10, -10, 20.0)]
    assert max(feed for _, _, feed in rapids) == pytest.approx(100.0, abs=0.2)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("    feed_mm_s: 5\n", "tasks.mill.feed_mm_s: unexpected key, the file of the path states the feeds, and the"),
        ("    duration_s: 5\n", "tasks.mill.duration_s: unexpected key, the file of the path states the feeds"),
        ("    corners: stop\n", "tasks.mill.corners: unexpected key"),
        ("    repeat: 2\n", "tasks.mill.repeat: expected 1 for a path with rapids and stops of its own, got 2"),
        ("    process: {feed_mm_s: 5}\n", "tasks.mill.process.feed_mm_s: unexpected key, the file of the path states"),
        ("    tool_axis: normal\n", "tool_axis: normal requires tool axes in the file: have CAM write them"),
    ],
)
def test_keys_that_contradict_the_file_are_refused_by_line(tmp_path: Path, more: str, words: str) -> None:
    (tmp_path / "cuts.nc").write_text(CUTS)
    (tmp_path / "cell.yaml").write_text(milling_cell("{gcode: cuts.nc}", more=more))

    with pytest.raises(InputError) as caught:
        load_cell(tmp_path / "cell.yaml")
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"{tmp_path / 'cell.yaml'}:")


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("{apt: nowhere.apt}", "tasks.mill.path.apt: expected an existing file, got 'nowhere.apt'"),
        ("{gcode: {file: nowhere.nc}}", "tasks.mill.path.gcode.file: expected an existing file, got 'nowhere.nc'"),
        ("{apt: cuts.nc, project: +z}", "tasks.mill.path.project: unexpected key, a path of CAM is used as it stands"),
        ("{apt: cuts.nc, from_mm: 3}", "tasks.mill.path.from_mm: unexpected key, a path of CAM is used as it stands"),
        ("{apt: {file: cuts.nc, chord_mm: 1}}", "tasks.mill.path.apt.chord_mm: unknown key"),
        ("{apt: cuts.nc}", "cuts.nc:1: expected a statement of APT, got '%'"),
    ],
)
def test_wrong_paths_are_refused_by_key_or_by_line_of_their_file(tmp_path: Path, path: str, words: str) -> None:
    (tmp_path / "cuts.nc").write_text(CUTS)
    (tmp_path / "cell.yaml").write_text(milling_cell(path, more="    tool_axis: -z\n"))

    status, _, err = run_command("cellplan check cell.yaml", tmp_path)
    assert status == 2
    assert words in err


@pytest.mark.slow
@pytest.mark.parametrize("form", ["apt", "gcode"])
def test_a_dome_of_ten_thousand_points_with_three_feeds_is_solved_in_thirty_seconds(tmp_path: Path, form: str) -> None:
    points = dome(200.0, 50.0, 100)
    text = dome_apt(points, (6000.0, 4800.0, 3000.0), rapid_every=10, lift=20.0)
    if form == "gcode":
        text = as_gcode(text)
    (tmp_path / "dome.cam").write_text(text)
    (tmp_path / "cell.yaml").write_text(milling_cell(f"{{{form}: dome.cam}}", more="    standoff_mm: [0, 1]\n"))

    begun = time.process_time()
    solution = solve(load_cell(tmp_path / "cell.yaml"))
    took = time.process_time() - begun

    assert solution.passed
    assert len(solution.runs[0].schedule.paths[0].task.path.points) > 10_000
    assert took < 30.0
