"""Figures of ISO 9283 against scatter that is known by hand."""

import numpy as np
import pytest

from cellplan.checks.real_cell.iso9283 import path_figures, pose_figures

ROUNDING = 1e-12  # [m], [rad]


def test_a_constant_error_is_accuracy_and_no_repeatability():
    errors = np.tile([3e-4, -4e-4, 0.0, 1e-3, -2e-3, 3e-3], (5, 1))

    figures = pose_figures(errors, 1.5)

    assert (figures.at_s, figures.AP_p) == (1.5, pytest.approx(5e-4))
    assert figures.AP_abc == pytest.approx((1e-3, 2e-3, 3e-3))
    assert figures.RP_l == pytest.approx(0.0, abs=ROUNDING)
    assert figures.RP_abc == pytest.approx((0.0, 0.0, 0.0), abs=ROUNDING)


def test_two_runs_apart_scatter_about_their_middle():
    """Both are 1 mm from the middle, so the mean distance is 1 mm and its deviation nil; S of +-1 is sqrt(2)."""
    errors = np.zeros((2, 6))
    errors[:, 1], errors[:, 5] = (1e-3, -1e-3), (1e-2, -1e-2)

    figures = pose_figures(errors, 0.0)

    assert figures.AP_p == pytest.approx(0.0, abs=ROUNDING)
    assert figures.RP_l == pytest.approx(1e-3)
    assert figures.RP_abc == pytest.approx((0.0, 0.0, 3 * np.sqrt(2) * 1e-2), abs=ROUNDING)


def test_normal_scatter_along_a_line_repeats_as_the_folded_normal_distribution_says():
    """Mean of |x| is sigma sqrt(2/pi) and its deviation sigma sqrt(1 - 2/pi)."""
    sigma, n = 2e-4, 20_000
    errors = np.zeros((n, 6))
    errors[:, 0] = sigma * np.random.default_rng(8).standard_normal(n)

    expected = sigma * (np.sqrt(2 / np.pi) + 3 * np.sqrt(1 - 2 / np.pi))
    assert pose_figures(errors, 0.0).RP_l == pytest.approx(expected, rel=0.03)  # four standard errors of n draws


def test_a_path_is_judged_at_its_worst_instants():
    times = np.array([0.0, 0.1, 0.2])
    errors = np.zeros((2, 3, 6))
    errors[:, 1, 2] = 7e-4  # both runs are off here: accuracy
    errors[:, 2, 2] = (-2e-4, 2e-4)  # here they are off in opposite ways: repeatability

    figures = path_figures(errors, times)

    assert (figures.AT_p, figures.AT_p_at_s) == (pytest.approx(7e-4), 0.1)
    assert (figures.RT_p, figures.RT_p_at_s) == (pytest.approx(2e-4), 0.2)


def test_one_run_repeats_nothing():
    figures, pose = path_figures(np.ones((1, 2, 6)), np.array([0.0, 1.0])), pose_figures(np.ones((1, 6)), 0.0)

    assert figures.RT_p is figures.RT_p_at_s is figures.RT_abc is None
    assert pose.RP_l is pose.RP_abc is None
    assert figures.AT_p == pose.AP_p == pytest.approx(np.sqrt(3.0))
