"""Studies on a Dask cluster of processes of this machine."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Future, wait
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from builders.study_trials import Killer, Wrong, halved, rounds

from cellplan.errors import InputError, StudyStoppedError
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.request import files_of as layout_files
from cellplan.jobs.repair.repair import repair
from cellplan.jobs.sweep.sweep import SweepJob, files_of, sweep
from cellplan.search.programs.objective import Objective
from cellplan.study.cluster import Cluster
from cellplan.study.folder import JOURNAL
from cellplan.study.study import Stop
from cellplan.study.variants import read_axis
from cellplan.study.workers import Workers

TRIALS = Stop(trials=14)
CELLS = Path(__file__).resolve().parents[2] / "cells"


class LocalCluster:
    """A scheduler and its workers, each a process."""

    def __init__(self) -> None:
        self.processes: list[subprocess.Popen[str]] = []
        self.address = ""

    def start_scheduler(self, port: str = "0") -> None:
        """Start it and read its address from its log."""
        scheduler = self._started("scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")
        assert scheduler.stderr is not None
        line = next(line for line in scheduler.stderr if "Scheduler at:" in line)
        self.address = line.split()[-1]

    def start_worker(self, folder: Path | None = None) -> None:
        """Start a worker of one thread and wait for it to be registered."""
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard")
        worker = self._started("worker", self.address, *options, folder=folder)
        assert worker.stderr is not None
        assert any("Registered to" in line for line in worker.stderr)

    def end(self, number: signal.Signals = signal.SIGKILL) -> None:
        """End all processes."""
        while self.processes:
            process = self.processes.pop()
            process.send_signal(number)
            process.communicate()

    def _started(self, kind: str, *arguments: str, folder: Path | None = None) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.dask_{kind}", *arguments],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            cwd=folder,
        )
        self.processes.append(process)
        return process


@pytest.fixture
def cluster() -> Iterator[LocalCluster]:
    """A scheduler with two workers."""
    pytest.importorskip("distributed")
    started = LocalCluster()
    try:
        started.start_scheduler()
        for _ in range(2):
            started.start_worker()
        yield started
    finally:
        started.end()


def on_cluster(cluster: LocalCluster, folder: Path, evaluate: Any = halved, **given: Any) -> bytes:
    """The journal of a study on the cluster."""
    with Cluster(cluster.address) as executor:
        rounds(folder).run(evaluate, workers=executor, stop=TRIALS, **given)
    return (folder / JOURNAL).read_bytes()


def here(folder: Path, evaluate: Any = halved) -> bytes:
    """The journal of a study in a worker process of this machine."""
    with Workers(1) as workers:
        rounds(folder).run(evaluate, workers=workers, stop=TRIALS)
    return (folder / JOURNAL).read_bytes()


@pytest.mark.slow
def test_a_cluster_gives_the_same_study_although_a_worker_is_killed(cluster: LocalCluster, tmp_path: Path) -> None:
    result = on_cluster(cluster, tmp_path / "cluster", Killer(tmp_path / "mark"))
    assert [process.poll() for process in cluster.processes].count(-signal.SIGKILL) == 1
    assert result == here(tmp_path / "here", Killer(tmp_path / "mark"))


@pytest.mark.slow
def test_workers_need_no_file_of_the_study_although_one_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The cell is named from the folder of this process; those of the workers are empty."""
    pytest.importorskip("distributed")
    shutil.copytree(CELLS, tmp_path / "job")
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "job")
    job = SweepJob(cell=Path("own_urdf.yaml"))
    axes = [read_axis("robots.own.model=robots/own_arm.urdf,robots/none.urdf"), read_axis("motion.duration_s=3,4,5")]
    started, killed = LocalCluster(), list[int]()

    def kill(_stage: str, share: float) -> None:
        if share > 0.1 and not killed:
            killed.append(started.processes[1].pid)
            started.processes[1].kill()

    try:
        started.start_scheduler()
        for _ in range(2):
            started.start_worker(tmp_path / "empty")
        with Cluster(started.address, files_of(job, axes)) as executor:
            record = sweep(job, axes, tmp_path / "there", workers=executor, progress=kill)
        with Cluster(started.address) as executor:
            blind = sweep(job, axes, tmp_path / "blind", workers=executor)
    finally:
        started.end()
    assert killed
    assert record["counts"]["passed"] == 3
    assert blind["counts"]["passed"] == 0  # the workers find nothing by themselves
    sweep(job, axes, tmp_path / "here", workers=1)
    for name in ("study.jsonl", "study.json", "study.csv", "study.html"):
        assert (tmp_path / "there" / name).read_bytes() == (tmp_path / "here" / name).read_bytes()


@pytest.mark.slow
def test_a_cluster_that_has_workers_is_never_given_up_for_having_none(cluster: LocalCluster) -> None:
    with Cluster(cluster.address) as executor:
        assert executor._workers() == 2


@pytest.mark.slow
def test_a_repair_on_workers_without_the_cell_is_the_one_that_is_made_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed")
    shutil.copytree(CELLS, tmp_path / "job")
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "job")
    settings = ("motion.duration_s=2", "motion.step_s=0.02", "tasks.circle.tolerance.position_mm=0.1")
    request = LayoutRequest(
        cell=Path("planar_pair.yaml"), objective=Objective.CHANGE, clearance=50.0, settings=settings
    )
    started = LocalCluster()
    try:
        started.start_scheduler()
        for _ in range(2):
            started.start_worker(tmp_path / "empty")
        with Cluster(started.address, layout_files(request)) as executor:
            there = repair(request, workers=executor).record
    finally:
        started.end()
    assert there == repair(request, workers=1).record
    assert there["status"] == "repaired"


@pytest.mark.slow
def test_results_that_count_are_worked_out_again_here(cluster: LocalCluster, tmp_path: Path) -> None:
    result = on_cluster(cluster, tmp_path / "cluster", Wrong(os.getpid()))
    assert result == here(tmp_path / "here", Wrong(os.getpid()))  # every wrong one would have been the best


@pytest.mark.slow
def test_a_lost_connection_is_made_again(cluster: LocalCluster, tmp_path: Path) -> None:
    port = cluster.address.rsplit(":", 1)[1]
    begun_again: list[str] = []

    def restart(stage: str, _share: float) -> None:
        if stage.startswith("trial 6 ") and not begun_again:
            begun_again.append(stage)
            cluster.end()
            cluster.start_scheduler(port)
            cluster.start_worker()

    assert on_cluster(cluster, tmp_path / "cluster", progress=restart) == here(tmp_path / "here")
    assert begun_again


@pytest.mark.slow
def test_a_scheduler_that_stays_away_ends_the_study_and_loses_nothing(
    cluster: LocalCluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cellplan.study.cluster.RECONNECT_S", 1.0)

    def end(stage: str, _share: float) -> None:
        if stage.startswith("trial 6 "):
            cluster.end(signal.SIGTERM)

    with pytest.raises(StudyStoppedError, match=r"--scheduler tcp://\S+: does not answer any more for 1 s; --resume"):
        on_cluster(cluster, tmp_path / "cluster", progress=end)
    whole = here(tmp_path / "here")
    assert len((tmp_path / "cluster" / JOURNAL).read_bytes().splitlines()) >= 7
    with Workers(1) as workers:
        rounds(tmp_path / "cluster").run(halved, workers=workers, stop=TRIALS, resume=True)
    assert (tmp_path / "cluster" / JOURNAL).read_bytes() == whole


class Dask:
    """A client and executor of Dask, as a cluster uses them, that answer jobs of the latest connection only."""

    def __init__(self, *, is_silent: bool) -> None:
        self.status, self.scheduler, self._is_silent = "running", SimpleNamespace(ncores=None), is_silent
        self._scheduler_identity = {"n_workers": 1}
        self.scheduler_comm = SimpleNamespace(closed=lambda: False)
        self.sent: list[Future[Any]] = []

    def get_executor(self, *, pure: bool) -> "Dask":
        return self

    def sync(self, function: Any, *, callback_timeout: float) -> dict[str, int]:
        return {"worker": 1}

    def submit(self, function: Any, *arguments: Any) -> Future[Any]:
        self.sent.append(Future())
        if len(self.sent) > 1:
            self.sent[-1].set_result(function(*arguments))
        return self.sent[-1]

    def connect_again(self) -> None:
        """A scheduler that has come back knows nothing of the jobs before, and may not say so."""
        self.scheduler_comm = SimpleNamespace(closed=lambda: False)
        if not self._is_silent:
            self.sent[0].cancel()
            self.sent[0].set_running_or_notify_cancel()

    def shutdown(self, *, wait: bool) -> None:
        """There is nothing to end."""

    def close(self, *, timeout: float) -> None:
        """There is nothing to end."""


@pytest.mark.parametrize("is_silent", [True, False])
def test_a_job_of_a_connection_that_is_gone_is_sent_again(is_silent: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    dask = Dask(is_silent=is_silent)
    monkeypatch.setattr("cellplan.study.cluster._connected", lambda _address: dask)
    with Cluster("tcp://127.0.0.1:1") as executor:
        answer = executor.submit(sum, (1, 2))
        assert wait([answer], timeout=0.5).not_done
        dask.connect_again()
        assert answer.result(timeout=30.0) == 3
        if is_silent:
            dask.sent[0].set_result(4)  # late: the first answer counts
        assert answer.result(timeout=0) == 3
    assert len(dask.sent) == 2


def test_without_dask_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError) as raised:
        Cluster("tcp://127.0.0.1:1")
    assert str(raised.value) == (
        '--scheduler: expected Dask, got no package distributed: pip install "cellplan[cluster]"'
    )


@pytest.mark.slow
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense:", "http://127.0.0.1:80"])
def test_an_address_where_nothing_answers_is_named(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("cellplan.study.cluster.CONNECT_S", 0.5)
    with pytest.raises(InputError, match="expected the address of a Dask scheduler that answers, got: "):
        Cluster(address)
