"""What the benchmarks judge by is right: the job, and the joints between the samples."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from engines import ENGINES
from engines.urdf import joint_names, urdf
from job import Job, load, save
from page import SCRIPTS
from peer_setup import requirements
from reference_job import BETWEEN, filled, reference_job
from sections import digits

from cellplan import load_cell
from cellplan.scene.kinematics.pinocchio_model import CombinedModel


@pytest.fixture(scope="module")
def job() -> Job:
    return reference_job()


def test_a_job_reads_back_as_it_was_saved(job: Job, tmp_path: Path) -> None:
    save(job, tmp_path / "job.npz")

    again = load(tmp_path / "job.npz")

    assert (again.cell, again.holder, len(again.arms)) == (job.cell, job.holder, len(job.arms))
    for name in ("X_HP", "operators", "times", "X_PT", "start"):
        np.testing.assert_array_equal(getattr(again, name), getattr(job, name))
    for arm, other in zip(job.arms, again.arms, strict=True):
        for name in ("X_WB", "points_B", "axes_B", "X_BT"):
            np.testing.assert_array_equal(getattr(other, name), getattr(arm, name))


def test_the_description_for_peers_puts_all_tools_where_the_planner_does(job: Job) -> None:
    q = job.start + 0.1 * np.sin(np.arange(len(job.start)))
    state = CombinedModel(load_cell(Path(job.cell))).state(q)

    frames = poses(urdf(job), dict(zip(joint_names(job), q, strict=True)))

    # an independent reader of a dozen frames: rounding only
    for arm, X_WT in enumerate(state.X_WT):
        np.testing.assert_allclose(frames[f"arm{arm}_tool"], X_WT, atol=1e-12)
    np.testing.assert_allclose(frames["part"], state.X_WP, atol=1e-12)


def poses(description: str, q: dict[str, float]) -> dict[str, np.ndarray]:
    """Every link of a robot description in the world."""
    results = {"base_link": np.eye(4)}
    for joint in ElementTree.fromstring(description).findall("joint"):  # noqa: S314 - written a line ago
        origin = joint.find("origin").attrib
        X = pose(numbers(origin["xyz"]), *numbers(origin["rpy"]))
        if joint.get("type") == "revolute":
            X = X @ about(numbers(joint.find("axis").get("xyz")), q[joint.get("name")])
        results[joint.find("child").get("link")] = results[joint.find("parent").get("link")] @ X
    return results


def numbers(text: str) -> list[float]:
    return [float(word) for word in text.split()]


def pose(place: list[float], roll: float, pitch: float, yaw: float) -> np.ndarray:
    X = about([0, 0, 1], yaw) @ about([0, 1, 0], pitch) @ about([1, 0, 0], roll)
    X[:3, 3] = place
    return X


def about(axis: list[float], angle: float) -> np.ndarray:
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    X = np.eye(4)
    X[:3, :3] += np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K
    return X


@pytest.mark.parametrize("degree", [1, 3])
def test_joints_between_samples_lie_on_the_polynomial_through_the_nearest(degree: int) -> None:
    samples, all_places = np.arange(7.0), np.arange(6 * (BETWEEN + 1) + 1) / (BETWEEN + 1)
    of = np.polynomial.Polynomial([0.3, -1.0, 0.7, 0.2][: degree + 1])

    result = filled(of(samples)[:, None] * [1.0, -2.0], degree=degree)

    np.testing.assert_allclose(result, of(all_places)[:, None] * [1.0, -2.0], atol=1e-13)  # of values up to 100


def test_every_peer_has_its_requirements_and_every_script_is_there(repository: Path) -> None:
    for engine in ENGINES:
        assert (repository / "benchmarks" / "engines" / f"{engine.module}.py").is_file()
        assert not engine.group or engine.package in " ".join(requirements(engine.group))
    for name in SCRIPTS:
        assert (repository / "benchmarks" / f"{name}.py").is_file()


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (1234.0, "1200"), (0.00084368, "0.00084"), (14.96, "15"), (3.4e-7, "0.00000034")]
)
def test_figures_have_as_many_digits_as_count(value: float, text: str) -> None:
    assert digits(value) == text
