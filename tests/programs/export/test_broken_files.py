"""Hundreds of broken programs of every format are shown to the verification of exported folders: none passes.

Each mutation is tried with the digest of the record as it was, and with one that fits the broken file.
"""

import json
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from builders.text_mutations import MUTATIONS
from builders.vendor_cells import solve_into, write_cell

from cellplan import VerifiedRun, export_program, open_gate
from cellplan.errors import InputError, NotVerifiedError
from cellplan.files.input.files import digest
from cellplan.programs.export.exporters import EXPORTERS
from cellplan.programs.export.stored import read_stored_export
from cellplan.programs.export.verify_export import verify_export

pytestmark = pytest.mark.usefixtures("stored_solutions")

FORMATS = ("csv", "json", "ros2", "stream", "wide")  # those that the small cell can be exported in
MAKERS = {
    "fanuc_ls": ("kuka", "fanuc"),
    "inform": ("kuka", "yaskawa"),
    "krl": ("kuka", "abb"),
    "rapid": ("kuka", "abb"),
    "val3": ("staubli", "ur"),
    "urscript": ("staubli", "ur"),
}
QUICK = ("val3", "urscript")  # of one cell
ROUNDS, SEALED_ROUNDS, ALL_ROUNDS = 1, 1, 8


@pytest.fixture(scope="module")
def run(sound: Path) -> VerifiedRun:
    return open_gate(sound / "run", cell=sound / "cell" / "small.yaml")


@pytest.fixture(scope="module")
def exports(run: VerifiedRun, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A folder of programs of each format."""
    folder = tmp_path_factory.mktemp("exports")
    for form in FORMATS:
        export_program(run, folder / form, form=form)
    return {form: folder / form for form in FORMATS}


Programs = Callable[[str], tuple[Path, VerifiedRun]]


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Programs:
    """A folder of programs in the language of a maker's controller, and its run."""
    folder = tmp_path_factory.mktemp("makers")

    @cache
    def run_of(pair: tuple[str, str]) -> VerifiedRun:
        place = folder / "-".join(pair)
        place.mkdir()
        cell = write_cell(place / "cell.yaml", first=pair[0], second=pair[1])
        solve_into(cell, place / "run")
        return open_gate(place / "run", cell=cell)

    @cache
    def programs_of(form: str) -> tuple[Path, VerifiedRun]:
        run = run_of(MAKERS[form])
        export_program(run, folder / form, form=form)
        return folder / form, run

    return programs_of


def refusals(kind: str, source: Path, run: VerifiedRun, place: Path, *, seeds: range, seals: bool) -> list[str]:
    """What is said of broken copies; fails where one passes."""
    messages = []
    for seed in seeds:
        rng = np.random.default_rng([seed, *kind.encode()])
        copy = place / f"{kind}-{seed}-{seals}"
        shutil.copytree(source, copy)
        record = json.loads((copy / "export.json").read_text(encoding="utf-8"))
        name = str(rng.choice(list(record["files"])))
        text = (copy / name).read_bytes().decode()
        broken = MUTATIONS[kind](text, rng)
        if broken is None or broken == text:
            continue
        (copy / name).write_bytes(broken.encode())
        if seals:
            record["files"][name] = digest(broken.encode())
            (copy / "export.json").write_text(json.dumps(record, indent=2), encoding="utf-8")
        with pytest.raises((InputError, NotVerifiedError)) as refusal:
            verify_export(read_stored_export(copy), run)
        messages.append(str(refusal.value))
    return messages


@pytest.mark.parametrize(
    "form", ["csv", "ros2", *(pytest.param(form, marks=pytest.mark.slow) for form in ("json", "stream", "wide"))]
)  # the digest refuses it, whatever the format
@pytest.mark.parametrize("kind", MUTATIONS)
def test_no_broken_file_is_verified(
    form: str, kind: str, exports: dict[str, Path], run: VerifiedRun, tmp_path: Path
) -> None:
    for said in refusals(kind, exports[form], run, tmp_path, seeds=range(ROUNDS), seals=False):
        assert str(tmp_path) in said


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("kind", MUTATIONS)
def test_no_broken_file_is_verified_whose_digest_fits(
    form: str, kind: str, exports: dict[str, Path], run: VerifiedRun, tmp_path: Path
) -> None:
    for said in refusals(kind, exports[form], run, tmp_path, seeds=range(SEALED_ROUNDS), seals=True):
        assert str(tmp_path) in said


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("kind", MUTATIONS)
def test_none_of_many_broken_files_is_verified(
    form: str, kind: str, exports: dict[str, Path], run: VerifiedRun, tmp_path: Path
) -> None:
    said = refusals(kind, exports[form], run, tmp_path, seeds=range(SEALED_ROUNDS, ALL_ROUNDS), seals=True)
    assert all(said)


@pytest.mark.parametrize("form", ["urscript"])  # the digest refuses it; the slow tests show all makers' readers more
@pytest.mark.parametrize("kind", MUTATIONS)
def test_no_broken_program_of_a_maker_is_verified(form: str, kind: str, programs: Programs, tmp_path: Path) -> None:
    folder, run = programs(form)
    for said in refusals(kind, folder, run, tmp_path, seeds=range(1), seals=False):
        assert str(tmp_path) in said


@pytest.mark.slow
@pytest.mark.parametrize("form", MAKERS)
@pytest.mark.parametrize("kind", MUTATIONS)
def test_no_broken_program_of_a_maker_is_verified_whose_digest_fits(
    form: str, kind: str, programs: Programs, tmp_path: Path
) -> None:
    folder, run = programs(form)
    said = refusals(kind, folder, run, tmp_path, seeds=range(SEALED_ROUNDS + 1), seals=True)
    said += refusals(kind, folder, run, tmp_path, seeds=range(ROUNDS), seals=False)
    assert all(str(tmp_path) in entry for entry in said)


@pytest.mark.parametrize(
    "form", [*QUICK, *(pytest.param(form, marks=pytest.mark.slow) for form in ("fanuc_ls", "inform", "krl", "rapid"))]
)
def test_untouched_programs_of_a_maker_are_verified(form: str, programs: Programs) -> None:
    folder, run = programs(form)
    assert verify_export(read_stored_export(folder), run).remarks == ()


def test_there_are_hundreds_of_kinds_and_no_format_is_left_out() -> None:
    assert len(MUTATIONS) * (len(FORMATS) + len(MAKERS)) >= 200
    assert {*FORMATS, *MAKERS} == set(EXPORTERS)


def test_untouched_programs_are_verified(exports: dict[str, Path], run: VerifiedRun) -> None:
    for folder in exports.values():
        verified = verify_export(read_stored_export(folder), run)
        assert verified.remarks == ()


@pytest.mark.parametrize(
    ("key", "value", "finding"),
    [
        (
            "schema",
            "cellplan.export/1",
            "schema: expected 'cellplan.export/2', got 'cellplan.export/1'",
        ),
        ("run", 64 * "0", "the programs were made from another run"),
        ("promise", "sequence only", "promise: expected 'timed', got 'sequence only'"),
        ("robots", ["right", "left"], "robots: expected robots of the cell in its order"),
        ("robots", [], "robots: expected robots of the cell in its order"),
        ("split", "all", "split: expected a whole number"),
        ("moves", "tools", "moves: expected one of joints, linear, auto, got 'tools'"),
        ("format", "apt", "expected one of csv, "),
        ("decimals", 6, "decimals: expected 9, got 6"),
        ("cell", "other", "cell: expected 'small-pair', got 'other'"),
        ("files", {"left.csv": "0"}, "not part of the export"),
        ("files", {"../left.csv": "0"}, "files: expected paths inside the folder"),
    ],
)
def test_a_record_that_says_something_else_is_refused(
    key: str, value: object, finding: str, exports: dict[str, Path], run: VerifiedRun, tmp_path: Path
) -> None:
    shutil.copytree(exports["csv"], tmp_path / "copy")
    record = json.loads((tmp_path / "copy" / "export.json").read_text(encoding="utf-8"))
    record[key] = value
    (tmp_path / "copy" / "export.json").write_text(json.dumps(record), encoding="utf-8")

    with pytest.raises((InputError, NotVerifiedError)) as refusal:
        verify_export(read_stored_export(tmp_path / "copy"), run)

    assert finding in str(refusal.value)


def test_a_missing_file_a_further_one_and_a_link_are_refused(exports: dict[str, Path], tmp_path: Path) -> None:
    shutil.copytree(exports["csv"], tmp_path / "copy")
    (tmp_path / "copy" / "left.csv").rename(tmp_path / "copy" / "lost.csv")
    (tmp_path / "copy" / "idle.csv").unlink()
    (tmp_path / "copy" / "idle.csv").symlink_to(exports["csv"] / "idle.csv")

    with pytest.raises(InputError) as refusal:
        read_stored_export(tmp_path / "copy")

    said = str(refusal.value)
    assert f"{tmp_path / 'copy' / 'left.csv'}: missing" in said
    assert f"{tmp_path / 'copy' / 'lost.csv'}: not part of the export" in said
    assert f"{tmp_path / 'copy' / 'idle.csv'}: expected a file or folder of the export, got a symbolic link" in said
