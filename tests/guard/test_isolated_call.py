import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from builders import crashing_jobs

from cellplan.errors import CellplanError, InvalidFileError, OverrunError
from cellplan.files.cell.reader_process import begin_reading
from cellplan.guard import Guard, begin_child, in_child
from cellplan.guard.isolated_call import _end_child, _running

READER = Guard(file="arm.urdf", worker="the URDF reader", seconds=20.0)
needs_posix = pytest.mark.skipif(os.name == "nt", reason="signals and limits are those of Linux and macOS")


@needs_posix
@pytest.mark.parametrize(
    ("work", "how"),
    [("read_address_zero", "SIGSEGV"), pytest.param("abort", "SIGABRT", marks=pytest.mark.slow)],
)
def test_a_crash_is_one_line_that_names_the_signal(work: str, how: str) -> None:
    with pytest.raises(OverrunError) as caught:
        in_child(getattr(crashing_jobs, work), guard=READER)

    assert str(caught.value) == f"arm.urdf: the URDF reader crashed ({how})"


def test_an_end_without_an_answer_is_reported_with_its_status() -> None:
    with pytest.raises(OverrunError, match=r"^arm.urdf: the URDF reader crashed \(exit status 7\)$"):
        in_child(crashing_jobs.leave, guard=READER)


@pytest.mark.parametrize("work", [crashing_jobs.loop_forever, crashing_jobs.sleep_long])
def test_work_that_does_not_end_is_ended(work) -> None:
    began = time.monotonic()

    with pytest.raises(OverrunError, match=r"^arm.urdf: the URDF reader took longer than 0.5 s$"):
        in_child(work, guard=Guard(file="arm.urdf", worker="the URDF reader", seconds=0.5))

    assert time.monotonic() - began < 10.0


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux limits the address space")
def test_work_that_takes_all_memory_is_refused() -> None:
    with pytest.raises(OverrunError, match=r"^arm.urdf: the URDF reader needed more than 1000 MB$"):
        in_child(
            crashing_jobs.take_eight_gigabytes,
            guard=Guard(file="arm.urdf", worker="the URDF reader", megabytes=1000),
        )


def test_one_process_does_all_jobs_until_one_of_them_crashes() -> None:
    first = in_child(crashing_jobs.process, guard=READER)
    again = in_child(crashing_jobs.process, guard=READER)
    with pytest.raises(OverrunError):
        in_child(crashing_jobs.leave, guard=READER)
    after = in_child(crashing_jobs.process, guard=READER)

    assert first == again
    assert after not in {first, os.getpid()}


def test_findings_cross_whole() -> None:
    with pytest.raises(InvalidFileError) as caught:
        in_child(crashing_jobs.complain, guard=READER)

    assert [str(finding) for finding in caught.value.findings] == ["f:1: one", "f:2: two"]


def test_other_exceptions_are_internal_errors_that_name_the_file() -> None:
    with pytest.raises(CellplanError) as caught:
        in_child(crashing_jobs.stumble, guard=READER)

    assert str(caught.value) == "arm.urdf: the URDF reader failed: KeyError: 'word'"
    assert caught.value.status == 4


def test_what_libraries_print_disturbs_nothing() -> None:
    assert in_child(crashing_jobs.print_much, guard=READER) == "answer"


def test_numbers_cross_unchanged() -> None:
    numbers = np.random.default_rng(0).normal(size=(50, 3))

    assert np.array_equal(in_child(crashing_jobs.same, numbers, guard=READER), numbers)


def test_the_child_stands_where_its_parent_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_child(crashing_jobs.process, guard=READER)
    monkeypatch.chdir(tmp_path)

    assert Path(in_child(crashing_jobs.folder, guard=READER)) == tmp_path.resolve()


def test_ctrl_c_is_left_to_the_parent() -> None:
    assert in_child(crashing_jobs.ignores_interruption, guard=READER)


@needs_posix
def test_an_interruption_ends_the_child_and_the_next_job_gets_its_own_answer() -> None:
    import threading

    in_child(crashing_jobs.process, guard=READER)
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)  # jobs in the background inherit it as ignored
    threading.Timer(0.3, os.kill, [os.getpid(), signal.SIGINT]).start()

    try:
        with pytest.raises(KeyboardInterrupt):
            in_child(crashing_jobs.sleep_long, guard=READER)
    finally:
        signal.signal(signal.SIGINT, usual)

    assert in_child(crashing_jobs.same, 5, guard=READER) == 5


def test_a_file_named_as_a_module_in_the_working_folder_is_not_run(tmp_path: Path) -> None:
    (tmp_path / "pickle.py").write_text("open('was-run', 'w').close()", encoding="utf-8")
    code = (
        "import sys; sys.path.remove(''); from cellplan.guard import Guard, in_child; "
        "print(in_child(len, 'abc', guard=Guard(file='f', worker='w')))"
    )
    package = Path(__file__).resolve().parents[2]

    run = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(package)},
        capture_output=True,
        text=True,
        check=False,
    )

    assert run.stdout == "3\n", run.stderr
    assert not (tmp_path / "was-run").exists()


def test_a_process_that_was_begun_has_imported_modules_for_the_next_job_and_answers_it_alone() -> None:
    _end_child()

    begin_child("colorsys", "no.such.module")
    begin_child("chunk")  # it runs already

    assert in_child(crashing_jobs.loaded, ("colorsys", "chunk"), guard=READER) == ["colorsys"]
    assert in_child(crashing_jobs.same, 5, guard=READER) == 5


def test_a_begun_process_that_has_ended_is_replaced() -> None:
    first = in_child(crashing_jobs.process, guard=READER)
    os.kill(first, signal.SIGKILL)
    while _running[0].is_usable:
        time.sleep(0.01)
    begin_child("colorsys")

    assert in_child(crashing_jobs.process, guard=READER) not in {first, os.getpid()}


@pytest.mark.parametrize(
    ("text", "modules"), [("model: kuka_kr16_2", []), ("mesh: part.STL", ["mesh"]), ("m: a.urdf", ["urdf", "mesh"])]
)
def test_readers_are_begun_for_the_files_that_a_cell_seems_to_name(
    text: str, modules: list[str], tmp_path: Path
) -> None:
    _end_child()
    cell = tmp_path / "cell.yaml"
    cell.write_text(text, encoding="utf-8")
    names = {"urdf": "cellplan.files.robots.urdf.load", "mesh": "cellplan.geometry.mesh.load"}

    begin_reading(cell)

    assert bool(_running) is bool(modules)
    loaded = in_child(crashing_jobs.loaded, (*names.values(), "pydantic"), guard=READER)
    assert loaded == [names[name] for name in modules]


@pytest.mark.parametrize("cell", [None, Path("no/such/cell.yaml"), Path("/")])
def test_nothing_is_begun_for_a_cell_that_cannot_be_read(cell: Path | None) -> None:
    _end_child()

    begin_reading(cell)

    assert not _running


def test_a_cell_without_files_of_its_own_needs_no_child(cells: Path) -> None:
    code = (
        "import sys; from cellplan.files.cell.load import load_cell; from cellplan.guard import isolated_call; "
        "load_cell(sys.argv[1]); print(len(isolated_call._running))"
    )
    counts = [
        subprocess.run(
            [sys.executable, "-c", code, str(cells / name)],
            capture_output=True,
            text=True,
            check=True,
            cwd=cells.parent,
        ).stdout.strip()
        for name in ("four_robots.yaml", "mesh_part_csv.yaml")
    ]

    assert counts == ["0", "1"]
