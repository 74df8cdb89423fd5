"""The scene of a run: idle tools have no business at the part."""

from dataclasses import replace

import numpy as np
from builders.scene_builders import (
    arm_model,
    body,
    fixed_part,
    floor,
    make_cell,
    placed,
    slide_model,
    stick,
    thing,
    work,
)

from cellplan.certify.run_pairs import rows_moved_by, scene_of_rows, scene_of_run
from cellplan.geometry.shapes import Box, Cylinder, Sphere
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Tool
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene


def scene() -> Scene:
    """Two drills over a plate, a task for each."""
    model = replace(slide_model(Sphere(0.01), axis=(0.0, 0.0, -1.0)), bodies=())
    down = pose((0.0, 0.0, 0.0), (np.pi, 0.0, 0.0))
    drills = [
        placed(
            name,
            model,
            base=pose((x, 0.0, -0.005)),
            tool=Tool(X_FT=down, bodies=(body("tool", 0, shape=Cylinder(0.01, 0.1), at=(0.0, 0.0, 0.05)),)),
        )
        for name, x in (("left", -0.1), ("right", 0.1))
    ]
    post = thing("post", Box((0.1, 0.1, 0.1)), pose((0.0, 2.0, 0.0)))
    part = fixed_part(Box((0.4, 0.3, 0.2)), pose((0.0, 0.0, -0.1)))
    return Scene.from_cell(make_cell(*drills, part=part, tasks=(work("left"), work("right")), things=(post,)))


def rules(of: Scene) -> dict[tuple[str, str], Rule]:
    return {of.names(pair): pair.rule for pair in of.pairs}


def test_only_tools_at_work_may_touch_the_part() -> None:
    whole = scene()
    alone = scene_of_run(whole, ["work_of_left"])

    assert {rules(whole)[name, "part"] for name in ("left/tool", "right/tool")} == {Rule.PROCESS}
    assert rules(alone)["left/tool", "part"] is Rule.PROCESS
    assert rules(alone)["right/tool", "part"] is Rule.CLEARANCE
    assert whole.touching(np.zeros(2)) is None
    assert alone.touching(np.zeros(2)) == ("right/tool", "part")


def test_the_scene_of_all_tasks_is_that_of_the_cell() -> None:
    whole = scene()

    assert rules(scene_of_run(whole, ["work_of_left", "work_of_right"])) == rules(whole)


def test_rows_can_be_picked_and_mean_the_same() -> None:
    whole = scene()
    rows = rows_moved_by(whole, "right")
    few = scene_of_rows(whole, rows)

    assert [few.names(pair) for pair in few.pairs] == [whole.names(whole.pairs[row]) for row in rows]
    assert all(any(name.startswith("right/") for name in few.names(pair)) for pair in few.pairs)
    deep = np.array([0.0, 0.1])
    assert few.touching(deep) is not None
    assert few.touching(np.array([1.0, -0.5])) is None


def test_a_foot_is_not_moved_by_its_robot() -> None:
    arm = Scene.from_cell(make_cell(placed("arm", arm_model(), tool=stick()), things=(floor(),)))

    names = {arm.names(arm.pairs[row]) for row in rows_moved_by(arm, "arm")}

    assert ("arm/foot", "part") not in names
    assert ("arm/hand", "part") in names
