"""The manifest names every file of a run, and tells every way in which a folder differs from it."""

import json
import os
from pathlib import Path
from typing import Any

import pytest

from cellplan.errors import InputError
from cellplan.files.run.folder import RunFolder
from cellplan.files.run.manifest import Manifest, file_findings, parse_manifest, render_manifest

SHA = "0" * 64


@pytest.fixture
def run(tmp_path: Path, load: Any) -> tuple[Path, Manifest]:
    """A folder with three files and its manifest."""
    folder = tmp_path / "run"
    with RunFolder(folder) as target:
        for name in ("report.json", "tables/a.csv", "tables/b.csv"):
            target.write_text(name, f'{{"schema": "cellplan.report/1"}} {name}\n')
        text = render_manifest(load(), passed=True, versions={"cellplan": "1"}, files=target.written)
        target.write_text("manifest.json", text)
    return folder, parse_manifest(text.encode(), "manifest.json")


def reported(folder: Path, manifest: Manifest) -> list[str]:
    return [str(error).removeprefix(f"{folder}/") for error in file_findings(folder, manifest).values()]


def test_an_untouched_folder_gives_no_finding(run: tuple[Path, Manifest]) -> None:
    folder, manifest = run

    assert reported(folder, manifest) == []
    assert list(manifest.files) == ["report.json", "tables/a.csv", "tables/b.csv"]
    assert (manifest.status, manifest.cell_file, manifest.user_files) == ("passed", "c", ())


def test_what_is_made_from_a_run_later_is_no_part_of_it(run: tuple[Path, Manifest]) -> None:
    folder, manifest = run
    for name in ("programs/csv/a.csv", "rehearsal/rehearsal.json", "view.html", ".DS_Store", "tables/.DS_Store"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("later")

    assert reported(folder, manifest) == []


def test_every_difference_is_reported_by_name(run: tuple[Path, Manifest]) -> None:
    folder, manifest = run
    (folder / "report.json").unlink()
    (folder / "tables" / "a.csv").write_bytes((folder / "tables" / "b.csv").read_bytes())
    (folder / "tables" / "b.csv").write_bytes(b"other")
    (folder / "more").mkdir()
    (folder / "more" / "c.csv").write_text("new")

    size = manifest.files["tables/b.csv"].size
    assert reported(folder, manifest) == [
        "more/c.csv: not part of the run; remove it, or solve the cell again",
        "report.json: missing; the run was written with it",
        "tables/a.csv: holds what was written as 'tables/b.csv'; solve the cell again",
        f"tables/b.csv: changed since the run was written (5 bytes, written were {size}); solve the cell again",
    ]


def test_links_and_pipes_are_never_followed(run: tuple[Path, Manifest], tmp_path: Path) -> None:
    folder, manifest = run
    (folder / "report.json").rename(tmp_path / "aside")
    (folder / "report.json").symlink_to(tmp_path / "aside")
    (folder / "tables" / "a.csv").unlink()
    os.mkfifo(folder / "tables" / "a.csv")

    assert reported(folder, manifest) == [
        "report.json: expected a file or folder of the run, got a symbolic link",
        "tables/a.csv: expected a regular file, got a pipe or a device",
    ]


def test_a_folder_that_became_a_link_is_reported_once(run: tuple[Path, Manifest], tmp_path: Path) -> None:
    folder, manifest = run
    (folder / "tables").rename(tmp_path / "aside")
    (folder / "tables").symlink_to(tmp_path / "aside")

    assert reported(folder, manifest) == ["tables: expected a file or folder of the run, got a symbolic link"]


@pytest.mark.parametrize(
    ("change", "finding"),
    [
        ({"schema": "cellplan.manifest/9"}, "m: schema: expected 'cellplan.manifest/1', got 'cellplan.manifest/9'"),
        ({"status": "good"}, "m: status: expected passed or failed, got 'good'"),
        ({"more": 1}, "m: more: unexpected key; allowed are "),
        ({"cell_file": "d"}, "m: inputs: expected the cell file 'd' among them"),
        ({"inputs": {"c": "abc"}}, "m: inputs.c: expected a SHA-256 in hexadecimal, got 'abc'"),
        (
            {"files": {"../x": {"bytes": 1, "sha256": SHA}}},
            "m: files: expected paths inside the run folder, got '../x'",
        ),
        ({"files": {"/x": {"bytes": 1, "sha256": SHA}}}, "m: files: expected paths inside the run folder, got '/x'"),
        ({"files": {"x": {"bytes": -1, "sha256": SHA}}}, "m: files.x: bytes: expected a size, got -1"),
        ({"files": {"x": {"sha256": SHA}}}, "m: files.x: expected the keys bytes and sha256, got a mapping"),
        ({"files": []}, "m: files: expected an object, got a list of 0"),
    ],
)
def test_a_manifest_of_another_form_is_refused(run: tuple[Path, Manifest], change: Any, finding: str) -> None:
    record = json.loads((run[0] / "manifest.json").read_text()) | change

    with pytest.raises(InputError) as refusal:
        parse_manifest((json.dumps(record, indent=2) + "\n").encode(), "m")

    assert str(refusal.value).startswith(finding)


def test_a_manifest_in_another_layout_is_refused(run: tuple[Path, Manifest]) -> None:
    data = (run[0] / "manifest.json").read_bytes()

    with pytest.raises(InputError, match="its layout is not that of cellplan"):
        parse_manifest(data.replace(b"\n", b"\r\n"), "m")


def test_what_was_set_of_the_cell_is_listed_and_read_back(load: Any) -> None:
    changes = {"motion.duration_s": 5, "robots.worker.start_deg": [0.1, 0, 0, 0, 90, 0], "solver.integrator": None}
    changed = load().with_values(changes)

    text = render_manifest(changed, passed=True, versions={}, files={})

    assert parse_manifest(text.encode(), "m").changes == changes


def test_a_manifest_that_lists_no_changes_is_read_as_one_without_any(run: tuple[Path, Manifest]) -> None:
    record = json.loads((run[0] / "manifest.json").read_text())
    assert record.pop("changes") == {}

    older = (json.dumps(record, indent=2, ensure_ascii=False) + "\n").encode()

    assert parse_manifest(older, "m").changes == {}
