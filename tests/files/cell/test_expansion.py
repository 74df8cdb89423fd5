"""One task stands for passes, stitches or tacks: names, values, order, where they are named, and lines of findings."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cellplan.errors import InputError
from cellplan.files.cell.expansion import expanded
from cellplan.files.cell.load import load_cell, load_open_cell
from cellplan.files.cell.write import render_cell
from cellplan.files.yaml.edit import changed_text
from cellplan.files.yaml.reader import read_yaml
from cellplan.model.cell.cell import Cell
from cellplan.model.task.seam import Stretch

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]
RING = """\
  ring:
    robot: worker
    path: {circle: {radius_mm: 100, plane: xy}, project: +z}
    tool_axis: normal
motion: {duration_s: 4}
"""
SEAM = """\
  root:
    robot: worker
    path: {{polyline: {{points_mm: [[-100, 0, 250], [100, 0, 250]]}}, walls: {{floor: +z, web: -y}}, from: floor}}
    process: {{feed_mm_s: 8}}
{keys}
  cap:
    robot: worker
    after: root
    path: {{polyline: {{points_mm: [[-100, 0, 250], [100, 0, 250]]}}, walls: {{floor: +z}}}}
motion: {{}}
program: {program}
"""
PASSES = """\
    passes:
      - {work_deg: 45, push_deg: 10}
      - {side_mm: -3, out_mm: 4, work_deg: 50, feed_mm_s: 10, rest_s: 2}
      - {side_mm: 3, out_mm: 4, work_deg: 40, reverse: true, from_mm: 5, to_mm: 150}"""


def seam(keys: str, program: str = "{}") -> tuple[str, str]:
    return RING, SEAM.format(keys=keys, program=program)


def test_passes_become_tasks_one_after_the_other(load: Load) -> None:
    cell = load(seam(PASSES))
    one, two, three, cap = cell.tasks

    assert [task.name for task in cell.tasks] == ["root_1", "root_2", "root_3", "cap"]
    assert [task.after for task in cell.tasks] == [(), ("root_1",), ("root_2",), ("root_3",)]
    angles = [task.seam.angles for task in (one, two, three) if task.seam is not None]
    assert [it.work for it in angles] == pytest.approx([0.785398, 0.872665, 0.698132], abs=1e-6)
    assert [(it.side, it.out) for it in angles] == [(0.0, 0.0), (-0.003, 0.004), (0.003, 0.004)]
    assert [task.feed for task in (one, two, three, cap)] == [0.008, 0.01, 0.008, None]
    assert (two.dwell, three.dwell) == (2.0, 0.0)
    assert three.stretch == Stretch(begin=0.005, end=0.15, is_reversed=True)


def test_expanded_cell_is_written_as_its_parts_and_loads_again(load: Load, tmp_path: Path) -> None:
    text = render_cell(load(seam(PASSES)))
    (tmp_path / "again").write_text(text, encoding="utf-8")

    assert "root_2:" in text
    assert "passes" not in text
    assert render_cell(load_cell("again")) == text


def test_findings_about_a_pass_name_its_line_and_its_keys(refuse: Refuse) -> None:
    message = "c:23: tasks.root.passes[1].work_deg: expected a number of degrees of at most 90, got 120"
    assert refuse(seam(PASSES.replace("work_deg: 50", "work_deg: 120"))) == [message]

    with_process = "    process: {feed_mm_s: 8, on_delay_s: 0.1}\n"
    rule = "    passes:\n      - {weave: {side_mm: 3, wavelength_mm: 4, dwell_left_s: 2}}"
    (message,) = refuse(seam(with_process.replace("    process", "    dwell_s: 1\n    approach_s: 1\n#") + rule))
    assert message.startswith("c:25: tasks.root.passes[0].weave.dwell_left_s: expected dwells of at most 0.8 of the")


@pytest.mark.parametrize(
    ("keys", "spans"),
    [
        ("    stitch: {length_mm: 30, gap_mm: 50}", [(0, 0.03), (0.08, 0.11), (0.16, 0.19)]),
        ("    stitch: {length_mm: 30, gap_mm: 50, count: 2}", [(0, 0.03), (0.08, 0.11)]),
        ("    stitch: {length_mm: 40, gap_mm: 40}", [(0, 0.04), (0.08, 0.12), (0.16, 0.2)]),
    ],
)
def test_stitches_lie_along_the_path(load: Load, keys: str, spans: list[tuple[float, float]]) -> None:
    tasks = load(seam(keys)).tasks[:-1]

    assert [task.name for task in tasks] == [f"root_{k + 1}" for k in range(len(spans))]
    stretches = [task.stretch for task in tasks if task.stretch is not None]
    assert [(it.begin, it.end) for it in stretches] == [pytest.approx(it, abs=1e-12) for it in spans]


def test_tacks_come_before_their_seam_and_its_stitches_after_them(load: Load) -> None:
    cell = load(
        seam("    tacks: {length_mm: 10, pitch_mm: 95}\n    stitch: {length_mm: 90, gap_mm: 20}", "{tacks_first: true}")
    )

    assert [task.name for task in cell.tasks] == ["root_t1", "root_t2", "root_t3", "root_1", "root_2", "cap"]
    assert [task.is_tack for task in cell.tasks] == [True, True, True, False, False, False]
    assert [task.after for task in cell.tasks][1:5] == [("root_t1",), ("root_t2",), ("root_t3",), ("root_1",)]


def test_crater_is_a_way_back_and_a_delay_of_the_process(load: Load) -> None:
    root = load(seam("    crater: {back_mm: 5, time_s: 0.8}")).tasks[0]

    assert root.stretch == Stretch(back=0.005)
    assert root.off_delay == 0.8


def test_skipped_task_is_left_out_wherever_it_is_named(load: Load) -> None:
    cell = load(seam("    skip: true"))

    assert [(task.name, task.after) for task in cell.tasks] == [("cap", ())]


def test_orders_and_rules_name_the_parts(load: Load) -> None:
    order = ("    weights: [1, 1, 1, 1, 1, 1]\n", "    weights: [1, 1, 1, 1, 1, 1]\n    order: [root, cap]\n")
    cell = load(order, seam(PASSES, "{same_robot: [root, cap]}"))

    assert cell.robot("worker").order == ("root_1", "root_2", "root_3", "cap")
    assert cell.program.same_robot == (("root_1", "root_2", "root_3", "cap"),)


def test_parts_of_an_open_task_are_open(load: Load, tmp_path: Path) -> None:
    load(seam(PASSES))
    text = (tmp_path / "c").read_text(encoding="utf-8").replace("  root:\n    robot: worker", "  root:\n    robot: any")
    (tmp_path / "open").write_text(text, encoding="utf-8")

    assert load_open_cell("open")[1] == dict.fromkeys(("root_1", "root_2", "root_3"), ("worker",))


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            PASSES + "\n    stitch: {length_mm: 30, gap_mm: 50}",
            "c:25: tasks.root.stitch: expected either passes or stitch, got both",
        ),
        (
            "    stitch: {length_mm: 300, gap_mm: 50}",
            "c:21: tasks.root.stitch: expected 1 to 100 of them on the path; of a path from a file, write their count",
        ),
        (
            "    tacks: {length_mm: 80, pitch_mm: 56}",
            "c:21: tasks.root.tacks.pitch_mm: expected more than the length of a tack, 80, got 56",
        ),
        (
            "    crater: {back_mm: 5, time_s: 0.8}\n    tack: 1",
            "c:22: tasks.root.tack: expected true or false, got 1",
        ),
        (
            PASSES
            + "\n  root_2: {robot: worker, path: {polyline: {points_mm: [[0, 0, 250], [100, 0, 250]]}}, tool_axis: -z}",
            "c:17: tasks.root: expected a name whose parts have no names of other tasks, got 'root_2' for a part",
        ),
    ],
)
def test_keys_that_make_no_tasks_are_refused(refuse: Refuse, keys: str, message: str) -> None:
    assert message in refuse(seam(keys))


def test_crater_and_path_do_not_both_say_how_far_the_tool_goes_back(refuse: Refuse) -> None:
    both = seam("    crater: {back_mm: 5, time_s: 0.8}")

    assert refuse((both[0], both[1].replace("from: floor}", "from: floor, back_mm: 3}", 1))) == [
        "c:19: tasks.root.path.back_mm: unexpected key, crater.back_mm is this length: leave out one of them"
    ]


@pytest.mark.parametrize("keys", [PASSES, "    tacks: {length_mm: 10, pitch_mm: 95}"])
def test_file_with_other_values_has_the_parts_in_their_order(tmp_path: Path, load: Load, keys: str) -> None:
    load(seam(keys))
    text = (tmp_path / "c").read_text(encoding="utf-8")
    root = expanded(read_yaml(tmp_path / "c", file="c"), lambda *_: None).root
    (tmp_path / "c").write_text(changed_text(text, root, head="best"), encoding="utf-8")

    assert [task.name for task in load_cell("c").tasks] == list(root["tasks"])
    assert [task.after for task in load_cell("c").tasks][1] == (next(iter(root["tasks"])),)


def test_tacks_that_are_not_made_are_named_once(refuse: Refuse) -> None:
    tacks = "    tacks: {length_mm: 10, pitch_mm: 0}"

    assert [line.split(": expected")[0] for line in refuse(seam(tacks, "{tacks_first: true}"))] == [
        "c:21: tasks.root.tacks.pitch_mm"
    ]


@pytest.mark.parametrize(
    ("values", "names"),
    [
        ({"tasks.root.skip": True}, ["cap"]),
        ({"tasks.root.passes[1].work_deg": 30}, ["root_1", "root_2", "root_3", "cap"]),
        ({"tasks.root.passes": None}, ["root", "cap"]),
        (
            {"tasks.cap.tacks": {"length_mm": 10, "pitch_mm": 95}},
            ["root_1", "root_2", "root_3", "cap_t1", "cap_t2", "cap_t3", "cap"],
        ),
    ],
)
def test_values_of_an_entry_are_set_before_it_becomes_parts(
    load: Load, values: dict[str, object], names: list[str]
) -> None:
    cell = load(seam(PASSES), (": {}\nprogram", ": {duration_s: 9}\nprogram")).with_values(values)

    assert [task.name for task in cell.tasks][: len(names)] == names


def test_values_of_an_entry_and_of_one_of_its_parts_hold_together(load: Load) -> None:
    cell = (
        load(seam(PASSES)).with_values({"tasks.root_3.path.work_deg": 35}).with_values({"tasks.root.path.push_deg": 20})
    )
    angles = {task.name: task.seam.angles for task in cell.tasks if task.seam is not None}

    assert np.rad2deg([angles[f"root_{k}"].travel for k in (1, 2, 3)]) == pytest.approx([10.0, 20.0, 20.0])
    assert np.rad2deg([angles[f"root_{k}"].work for k in (1, 2, 3)]) == pytest.approx([45.0, 50.0, 35.0])


def test_skipped_entry_comes_back(load: Load) -> None:
    skipped = load(seam(PASSES)).with_values({"tasks.root.skip": True})

    assert len(skipped.with_values({"tasks.root.skip": False}).tasks) == 4


def test_value_of_an_entry_that_is_wrong_is_named(load: Load) -> None:
    with pytest.raises(InputError, match=r"with tasks\.root\.path\.from = roof: .*expected one of the walls"):
        load(seam(PASSES)).with_values({"tasks.root.path.from": "roof"})
