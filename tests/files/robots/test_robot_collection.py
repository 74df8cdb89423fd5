"""Two public collections of robots are read, as far as their files are sound; needs a package index once."""

import re

import pytest
import robot_collection
from robot_collection import MAX_SECONDS, TOLERANCE, NoIndexError, Trial, try_collection

TRUE_FAULTS = (
    r"mimics the unknown joint",
    r"mesh 'file:Torso\.mesh'",  # a format that nobody reads, of a program of its own
)


def trials(name: str) -> list[Trial]:
    """The trials of a collection; skipped with a remark where there is no index."""
    try:
        return try_collection(name, robot_collection.FOLDER)
    except NoIndexError as error:
        pytest.skip(f"the collection '{name}' cannot be downloaded: {error}")


@pytest.fixture(scope="module")
def urdfs() -> list[Trial]:
    return trials("urdf")


@pytest.mark.slow
def test_at_least_sixty_of_sixty_six_urdfs_are_read_and_refusals_name_true_faults(urdfs: list[Trial]) -> None:
    assert len(urdfs) == 66
    assert sum(trial.is_read for trial in urdfs) >= 60
    for trial in urdfs:
        assert trial.is_read or any(re.search(fault, trial.reason) for fault in TRUE_FAULTS), trial


@pytest.mark.slow
def test_the_kinematics_is_that_of_another_reader(urdfs: list[Trial]) -> None:
    assert max(trial.error for trial in urdfs if trial.is_read) <= TOLERANCE


@pytest.mark.slow
def test_reading_the_slowest_takes_seconds(urdfs: list[Trial]) -> None:
    assert max(trial.seconds for trial in urdfs) <= MAX_SECONDS


@pytest.mark.slow
def test_ten_xacro_files_are_read_likewise() -> None:
    xacros = trials("xacro")
    assert sum(trial.is_read for trial in xacros) >= 10
    assert all(trial.is_read and trial.error <= TOLERANCE for trial in xacros), xacros
