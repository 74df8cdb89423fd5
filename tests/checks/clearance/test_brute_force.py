"""Certified distances are never above what another engine finds, and at most 0.1 mm below, in cells of real arms."""

from pathlib import Path

import certified
import pytest


def agrees(folder: Path, seed: int) -> None:
    comparison = certified.compare(*certified.random_cell(folder, seed))

    assert len(comparison) >= 3
    assert [one for one in comparison if not one.is_right] == []


def test_certified_distances_agree_with_brute_force(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certified, "STEPS", 6)
    agrees(tmp_path, 2)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_ten_random_cells_of_real_arms_agree_with_brute_force(tmp_path: Path, seed: int) -> None:
    agrees(tmp_path, seed)
