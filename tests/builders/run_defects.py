"""Defects that a run folder may come to have: each edits a copy of a sound run in place, by chance.

A plain defect leaves the manifest as it was. A sealed one makes the manifest anew, and where it says so the digests of
the tables too, as somebody would who wants the run to pass: only what is recomputed can find it.
"""

import json
import re
from collections.abc import Callable
from typing import Any

import numpy as np

from builders.added_words import counts_beside_the_truth, misshapen_series, more_header_lines, words_in_a_picture
from builders.run_edits import ROBOTS, Copy, edit_field, edit_json, edit_rows, first_row, pick, replace_in, seal, sign
from cellplan.files.input.files import digest

Defect = Callable[[np.random.Generator, Copy], None]


def other_digit(rng: np.random.Generator, field: str) -> str:
    places = [i for i, character in enumerate(field) if character.isdigit()]
    i = pick(rng, places)
    return field[:i] + str((int(field[i]) + int(rng.integers(1, 10))) % 10) + field[i + 1 :]


def digit_of_a_table(rng, copy):
    edit_field(rng, copy.any_table(rng), lambda field: other_digit(rng, field))


def swapped_tables(rng, copy):
    first, second = (copy.table(str(name)) for name in rng.permutation(ROBOTS)[:2])
    one, two = first.read_bytes(), second.read_bytes()
    first.write_bytes(two)
    second.write_bytes(one)


def swapped_columns(rng, copy):
    i, j = sorted(rng.permutation([1, 2, 3])[:2])
    edit_rows(copy.table(pick(rng, ("left", "right"))), lambda _, f: [*f[:i], f[j], *f[i + 1 : j], f[i], *f[j + 1 :]])


def truncated_file(rng, copy):
    path = copy.any_file(rng)
    data = path.read_bytes()
    path.write_bytes(data[: int(rng.integers(len(data)))])


def no_number(rng, copy):
    word = pick(rng, ("nan", "inf", "-inf", "1e999", "", "1e3", "0x1", "1,5", "--1"))
    edit_field(rng, copy.any_table(rng), lambda _: word)


def header_edit(rng, copy):
    old, new = pick(
        rng,
        (
            ("# verdict: passed", "# verdict: REJECTED: joint left/A"),
            ("# verdict: passed\n", ""),
            ("# cell: small-pair", "# cell: large-pair"),
            ("# mode: simultaneous", "# mode: pairwise"),
            ("the model's zero", "the maker's zero"),
            ("table v1", "table v2"),
            ("_deg", "_mm"),
            ("run first at reduced speed", "run at full speed"),
        ),
    )
    replace_in(copy.any_table(rng), old, new)


def report_edit(rng, copy):
    old, new = pick(
        rng,
        (
            ('"status": "passed"', '"status": "failed"'),
            ('"seed": 0', '"seed": 1'),
            ("cellplan.report/1", "cellplan.report/2"),
            ('"step_s": 0.', '"step_s": 0.0'),
            ('"pair_count": ', '"pair_count": 1'),
        ),
    )
    replace_in(copy.run / "report.json", old, new)


def resolved_cell_edit(rng, copy):
    old, new = pick(
        rng, (("z_mm: 0", "z_mm: 1"), ("1900", "1901"), ("[x, y, rz]", "[x, y]"), ("position_mm: 1", "position_mm: 2"))
    )
    replace_in(copy.run / "cell.yaml", old, new)


def cell_edit(rng, copy):
    old, new = pick(
        rng, (("1900", "1901"), ("900, -900", "900, -901"), ("quintic", "trapezoid"), ("pair\n", "pair \n"))
    )
    replace_in(copy.cell, old, new)


def stale(name: str, old: str, new: str) -> Defect:
    return lambda _, copy: replace_in(copy.cell.parent / name, old, new)


def stale_mesh(rng, copy):
    path = copy.cell.parent / pick(rng, ("meshes/block.stl", "robots/elbow.stl"))
    data = bytearray(path.read_bytes())
    data[int(rng.integers(80))] ^= 1  # in the title of the file: the shape stays
    path.write_bytes(bytes(data))


def missing_input(rng, copy):
    (
        copy.cell.parent / pick(rng, ("meshes/block.stl", "robots/right.urdf", "paths/bow.csv", "robots/left.yaml"))
    ).unlink()


def deleted_file(rng, copy):
    copy.any_file(rng).unlink()


def extra_file(rng, copy):
    name = pick(rng, ("tables/fourth.csv", "notes.txt", "rejected/left.csv", "tables/left.csv.bak", "plots/new.svg"))
    (copy.run / name).parent.mkdir(exist_ok=True)
    (copy.run / name).write_bytes(copy.table("left").read_bytes())


def linked_file(rng, copy):
    path = copy.any_file(rng)
    lateral = copy.run.parent / "aside"
    path.rename(lateral)
    path.symlink_to(lateral)


def linked_folder(rng, copy):
    path, lateral = copy.run / pick(rng, ("tables", "plots")), copy.run.parent / "aside"
    path.rename(lateral)
    path.symlink_to(lateral, target_is_directory=True)


def other_line_ends(rng, copy):
    path = pick(
        rng, [copy.any_table(rng), copy.run / "cell.yaml", copy.run / "report.json", copy.run / "manifest.json"]
    )
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))


def byte_order_mark(rng, copy):
    path = pick(rng, [copy.any_table(rng), copy.run / "cell.yaml", copy.run / "manifest.json"])
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())


def flipped_bit(rng, copy):
    path = copy.any_file(rng)
    data = bytearray(path.read_bytes())
    data[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(7))
    path.write_bytes(bytes(data))


def shifted_clock(rng, copy):
    by = pick(rng, (0.001, 0.025, 1e-9))
    edit_rows(copy.any_table(rng), lambda _, f: [repr(float(f[0]) + by), *f[1:]])


def row_gone(rng, copy):
    path = copy.any_table(rng)
    lines = path.read_text().splitlines()
    del lines[int(rng.integers(first_row(lines), len(lines)))]
    path.write_text("\n".join(lines) + "\n")


def manifest_edit(rng, copy):
    old, new = pick(
        rng,
        (
            ("cellplan.manifest/1", "cellplan.manifest/2"),
            ('"status": "passed"', '"status": "failed"'),
            ('"pin": "', '"pin": "9.'),
            ('"cell": "small-pair"', '"cell": "other"'),
            ('"report.json"', '"../report.json"'),
            ('"bytes": ', '"bytes": 1'),
            ('"schema"', '"schema": "a",\n  "schema"'),
        ),
    )
    replace_in(copy.run / "manifest.json", old, new)


def table_of_another_run(rng, copy):
    name = pick(rng, ("left", "right"))
    copy.table(name).write_bytes((copy.other / "tables" / f"{name}.csv").read_bytes())


def then(defect: Defect, seal_or_sign: Callable[[Copy], None]) -> Defect:
    def both(rng, copy):
        defect(rng, copy)
        seal_or_sign(copy)

    return both


def sealed(defect: Defect) -> Defect:
    return then(defect, seal)


def signed(defect: Defect) -> Defect:
    return then(defect, sign)


def just_over_its_limit(rng, copy):
    column, limit = pick(rng, ((1, 170.0), (2, -150.0), (3, 150.0)))
    over = repr(limit + (1e-6 if limit > 0 else -1e-6))
    edit_rows(copy.table("idle"), lambda _, f: [*f[:column], over, *f[column + 1 :]])


def a_jump(rng, copy):
    edit_field(rng, copy.table(pick(rng, ("left", "right"))), lambda field: repr(float(field) + 3.0))


def idle_robot_in_the_way(rng, copy):
    """The cell file and its copy both bring the idle robot to where the others work."""
    for path in (copy.cell, copy.run / "cell.yaml"):
        text = path.read_text()
        path.write_text(
            text.replace("[0, 4000, 500]", "[900, 300, 520]").replace("[0.0, 4000.0, 500.0]", "[900, 300, 520]")
        )
    moved = digest(copy.cell.read_bytes())
    old = json.loads((copy.run / "report.json").read_text())["inputs"]["small.yaml"]
    for robot in ROBOTS:
        replace_in(copy.table(robot), old, moved)
    replace_in(copy.run / "report.json", old, moved)
    seal(copy)


def idle_robot_elsewhere(rng, copy):
    """The idle robot stands still, but not where the cell says."""
    angle = str(pick(rng, (0.001, 7.0, -20.0)))
    edit_rows(copy.table("idle"), lambda _, f: [f[0], angle, *f[2:]])


def found_start_edited(rng, copy):
    """The start that was found is another one in the resolved cell."""
    replace_in(copy.run / "cell.yaml", "start_deg: [45.", "start_deg: [4" + str(int(rng.integers(6, 9))) + ".")
    seal(copy)


def block_moved_in_the_copy(rng, copy):
    text = (copy.run / "cell.yaml").read_text()
    (copy.run / "cell.yaml").write_text(text.replace("-900", str(-900 - int(rng.integers(1, 400)))))
    seal(copy)


def robot_missing(rng, copy):
    copy.any_table(rng).unlink()
    seal(copy)


def other_words(rng, copy):
    """A report that says something else in words: a message, a pair, an instant, a verdict."""

    def change(record: dict[str, Any]) -> None:
        which = int(rng.integers(5))
        check = record["checks"][int(rng.integers(len(record["checks"])))]
        if which == 0:
            check["message"] = "all is well"
        elif which == 1:
            check["message"] = (
                "".join("9" if character.isdigit() else character for character in check["message"]) + "!"
            )
        elif which == 2:
            record["clearance"]["whole"]["pair"] = ["left/A", "right/A"]
        elif which == 3:
            record["tasks"]["path"]["max_position_error_at_s"] = 0.123
        else:
            record["caution"] = "safe to run at full speed"

    edit_json(copy.run / "report.json", change)
    seal(copy)


def other_page(rng, copy):
    """A page that says something else: words, a figure, a mark, a script, or another picture of the same run."""
    page = copy.run / "report.html"
    text = page.read_text(encoding="utf-8")
    figures = list(re.finditer(r">(\d+\.\d+)<", text))
    figure = figures[int(rng.integers(len(figures)))]
    forged = (
        text.replace("passed", "excellent", 1),
        text[: figure.start(1)] + other_digit(rng, figure[1]) + text[figure.end(1) :],
        text.replace("</body>", "<script>document.title = 'safe'</script></body>"),
        text.replace("Clearance", "Certified clearance", 1),
        text.replace("<path", "<path hidden", 1),
    )[int(rng.integers(5))]
    assert forged != text
    page.write_text(forged, encoding="utf-8")
    seal(copy)


def picture_missing(rng, copy):
    pick(rng, sorted((copy.run / "plots").glob("*.svg"))).unlink()
    seal(copy)


def pretty_report(rng, copy):
    """A report that tells of other figures than there are, or of fewer."""

    def change(record: dict[str, Any]) -> None:
        which = int(rng.integers(6))
        if which == 0:
            record["tasks"]["path"]["max_position_error_mm"] += 1e-5  # what is there is less than that
        elif which == 1:
            record["clearance"]["whole"]["minimum_mm"] += 0.01
        elif which == 2:
            del record["clearance"]["part"]
        elif which == 3:
            record["joints"]["left"]["A"]["margin"] += 1e-3
        elif which == 4:
            record["checks"].pop(int(rng.integers(len(record["checks"]))))
        else:
            record["exclusions"].append({"pair": ["left/A", "right/A"], "reason": "none"})

    edit_json(copy.run / "report.json", change)
    seal(copy)


def other_series(rng, copy):
    """Series that differ from the tables in one value, have one value less, or are missing."""

    def change(record: dict[str, Any]) -> None:
        which = int(rng.integers(4))
        if which == 0:
            record["joints"]["left"]["A"]["position_deg"][int(rng.integers(40))] += 0.01
        elif which == 1:
            record["times_s"].pop()
        elif which == 2:
            del record["conditioning"]["manipulability"]
        else:
            record["tasks"]["path"]["position_error_mm"][int(rng.integers(40))] += 0.001

    edit_json(copy.run / "series.json", change)
    seal(copy)


def series_missing(rng, copy):
    (copy.run / "series.json").unlink()
    seal(copy)


DEFECTS: dict[str, Defect] = {
    "a digit of a table": digit_of_a_table,
    "swapped tables": swapped_tables,
    "swapped columns": swapped_columns,
    "a truncated file": truncated_file,
    "no number": no_number,
    "a header edit": header_edit,
    "a report edit": report_edit,
    "an edit of the resolved cell": resolved_cell_edit,
    "an edit of the cell": cell_edit,
    "a stale robot description": stale("robots/right.urdf", 'velocity="3"', 'velocity="4"'),
    "a stale robot table": stale("robots/left.yaml", "upper_deg: 170", "upper_deg: 171"),
    "a stale toolpath": stale("paths/bow.csv", "40.000", "40.001"),
    "a stale mesh": stale_mesh,
    "a missing input": missing_input,
    "a deleted file": deleted_file,
    "an extra file": extra_file,
    "a linked file": linked_file,
    "a linked folder": linked_folder,
    "other line ends": other_line_ends,
    "a byte order mark": byte_order_mark,
    "a flipped bit": flipped_bit,
    "a shifted clock": shifted_clock,
    "a row gone": row_gone,
    "an edit of the manifest": manifest_edit,
    "a table of another run": table_of_another_run,
    "swapped tables, sealed": sealed(swapped_tables),
    "swapped columns, signed": signed(swapped_columns),
    "no number, sealed": sealed(no_number),
    "a header edit, sealed": sealed(header_edit),
    "a report edit, sealed": sealed(report_edit),
    "an edit of the resolved cell, sealed": sealed(resolved_cell_edit),
    "a shifted clock, signed": signed(shifted_clock),
    "a row gone, signed": signed(row_gone),
    "a table of another run, sealed": sealed(table_of_another_run),
    "a table of another run, signed": signed(table_of_another_run),
    "just over a limit, signed": signed(just_over_its_limit),
    "a jump, signed": signed(a_jump),
    "a contact, signed": idle_robot_in_the_way,
    "an idle robot elsewhere, signed": signed(idle_robot_elsewhere),
    "another start in the copy, sealed": found_start_edited,
    "a block moved in the copy, sealed": block_moved_in_the_copy,
    "a robot missing, sealed": robot_missing,
    "a pretty report, sealed": pretty_report,
    "other words in the report, sealed": other_words,
    "another page, sealed": other_page,
    "a picture missing, sealed": picture_missing,
    "words in a picture, sealed": words_in_a_picture,
    "more header lines, sealed": more_header_lines,
    "a misshapen series, sealed": misshapen_series,
    "other series, sealed": other_series,
    "no series, sealed": series_missing,
    "counts beside the truth, sealed": counts_beside_the_truth,
}
