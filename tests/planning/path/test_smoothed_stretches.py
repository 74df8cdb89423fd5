"""Stretches, weaves and runs of smoothed paths: the whole path is smoothed, and each tip is held against its file."""

import numpy as np
import pytest
from builders.roller_paths import task_on
from builders.scans import PLATE, entry, off_file, scan

from cellplan.files.cell.build.smoothed_path import smoothed
from cellplan.geometry.arrays import Array
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.task.seam import Stretch, Weave, WeaveForm
from cellplan.model.task.task import SampledPath
from cellplan.planning.path.build import build_toolpath

TUBE = {"position_mm": 0.2, "direction_deg": 2.0, "into_mm": 0.05}
WEAVES = {
    "sine": Weave(form=WeaveForm.SINE, side=0.002, wavelength=0.006),
    "standing": Weave(form=WeaveForm.SINE, side=0.002, wavelength=0.006, dwells=(0.001, 0.001), stands=True),
}


def from_curve(points: Array, path: SampledPath) -> Array:
    """Distances of points from the curve by the file, which is drawn without a stretch, shape (N,)."""
    whole = build_toolpath(task_on(path.listed), PLATE)
    curve = whole.poses(np.linspace(0.0, whole.length, 40_001))[:, :3, 3]
    return np.array([np.linalg.norm(curve - point, axis=1).min() for point in points])


@pytest.mark.parametrize(
    ("stretch", "is_closed", "length"),
    [
        (Stretch(begin=0.02, end=0.15), False, 0.13),
        (Stretch(is_reversed=True), False, None),
        (Stretch(begin=0.03, is_reversed=True, back=0.01), False, None),
        (Stretch(overlap=0.02), True, None),
    ],
)
def test_stretches_are_those_of_the_smoothed_path_and_held_against_the_file(
    stretch: Stretch, is_closed: bool, length: float | None
) -> None:
    path = smoothed(scan(is_closed=is_closed), entry(**TUBE), None)

    distances, angles, depths, toolpath = off_file(path, stretch=stretch)

    assert toolpath.listed is not None
    if length is not None:
        assert toolpath.length == pytest.approx(length, abs=1e-9)
    assert 1e-4 < distances.max() <= 2.01e-4
    assert np.deg2rad(0.3) < angles.max() <= np.deg2rad(2.01)
    assert depths.max() <= 0.051e-3
    places = toolpath.listed.poses(np.linspace(0.0, toolpath.length, 50))[:, :3, 3]
    assert from_curve(places, path).max() <= 7e-6  # samples of the curve are up to 13 um apart


def test_a_path_run_backwards_is_the_same_path() -> None:
    path = smoothed(scan(), entry(**TUBE), None)
    there, back = (off_file(path, stretch=it)[3] for it in (None, Stretch(is_reversed=True)))
    s = np.linspace(0.0, there.length, 200)

    for one, other in ((there, back), (there.listed, back.listed)):
        assert one is not None
        assert other is not None
        assert other.poses(there.length - s) == pytest.approx(one.poses(s), abs=1e-9)


@pytest.mark.parametrize("form", WEAVES)
def test_tips_that_weave_are_as_far_from_the_file_as_the_lines_are(form: str) -> None:
    path = smoothed(scan(), entry(**TUBE), None)
    woven = off_file(path, weave=WEAVES[form])[3]
    plain = off_file(path)
    listed = woven.listed
    assert listed is not None
    assert listed.tip.knots == pytest.approx(woven.tip.knots)

    u = np.linspace(woven.tip.knots[0], woven.tip.knots[-1], 2001)[1:-1]
    whole = (float(u[0]), float(woven.tip.knots[-1]))
    h = 1e-7
    off = woven.tip.evaluate(u, whole)[0] - listed.tip.evaluate(u, whole)[0]
    ahead, behind = (listed.tip.evaluate(u + side, whole)[0] for side in (h, -h))

    assert np.linalg.norm(off, axis=1).max() <= 2.01e-4
    assert np.linalg.norm(off, axis=1).max() == pytest.approx(plain[0].max(), rel=1e-3)
    sideways = woven.tip.evaluate(u, whole)[0] - woven.without_weave.tip.evaluate(u, whole)[0]
    assert np.linalg.norm(sideways, axis=1).max() > 1.9e-3
    assert (ahead - behind) / (2.0 * h) == pytest.approx(listed.tip.evaluate(u, whole)[1], abs=1e-3)


def test_runs_go_on_from_the_smoothed_path_which_is_held_against_the_file_between_them() -> None:
    path = smoothed(scan(), entry(**TUBE), None)
    process = ProcessEntry.model_validate({"feed_mm_s": 50, "run_in_mm": 20, "run_out_mm": 10})
    stretch = Stretch(begin=0.02, end=0.15)
    plain = off_file(path, stretch=stretch)[3]

    toolpath = build_toolpath(task_on(path, stretch=stretch, process=process), PLATE)

    assert toolpath.length == pytest.approx(0.16, abs=1e-9)
    s = np.linspace(0.0, plain.length, 100)
    assert toolpath.poses(0.02 + s) == pytest.approx(plain.poses(s), abs=1e-9)
    assert toolpath.listed is not None
    assert plain.listed is not None
    assert toolpath.listed.poses(0.02 + s) == pytest.approx(plain.listed.poses(s), abs=1e-9)
