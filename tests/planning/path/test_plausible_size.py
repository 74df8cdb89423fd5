"""Paths of an unlikely size or place are slips of the unit; the others pass."""

from dataclasses import replace

import pytest
from builders.roller_paths import ON_ROLLER, ROLLER, circle

from cellplan.errors import InputError
from cellplan.model.task import SpacePolylinePath, Task
from cellplan.planning.path.build import build_toolpath

ALONG_Y = ((0.3, 0.0, 0.0), (0.3, 0.2, 0.0))


def through(*points: tuple[float, float, float]) -> Task:
    path = SpacePolylinePath(points=points, is_closed=False)
    return replace(
        ON_ROLLER["circle"], path=path, project=None, tool_axis=ROLLER.X_PS[:3, 0], tool_x=ROLLER.X_PS[:3, 1]
    )


@pytest.mark.parametrize("radius", [0.000003, 0.00001])
def test_a_path_of_a_few_hundredths_of_a_millimetre_is_refused(radius: float) -> None:
    with pytest.raises(InputError, match=r"tasks\.ring\.path: expected a path of at least 0\.1 mm, got 0\.0\d+ mm"):
        build_toolpath(replace(ON_ROLLER["circle"], path=circle(radius)), ROLLER)


def test_a_short_path_passes() -> None:
    assert build_toolpath(replace(ON_ROLLER["circle"], path=circle(0.00003)), ROLLER).length > 1e-4


def test_a_point_far_from_the_part_is_refused_and_one_beside_it_passes() -> None:
    assert build_toolpath(through(*ALONG_Y, (9.0, 0.0, 0.0)), ROLLER).length > 8.0
    with pytest.raises(InputError) as caught:
        build_toolpath(through(*ALONG_Y, (0.3, 50.0, 0.0)), ROLLER)
    assert str(caught.value).endswith(
        "tasks.ring.path: expected a path within 10 m of the part, got the point (300, 50000, 0) mm, 49.8 m from it; "
        "is the unit right?"
    )
