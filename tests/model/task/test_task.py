"""A task names the place of its keys in the file that it was read from."""

import pytest
from builders.roller_paths import circle, task_on

from cellplan.model.origin import Origin

SOURCE = {"tasks.ring": 9, "tasks.ring.corners": 12}


@pytest.mark.parametrize(
    ("lines", "place"),
    [
        (SOURCE | {"motion.corners": 30}, "cell.yaml:12: tasks.ring.corners"),
        ({"tasks.ring": 9, "motion.corners": 30}, "cell.yaml:30: motion.corners"),
        ({"tasks.ring": 9}, "cell.yaml:9: tasks.ring.corners"),
        ({}, "cell.yaml: tasks.ring.corners"),
    ],
)
def test_a_key_of_the_task_comes_before_the_one_that_all_tasks_share(lines: dict[str, int], place: str) -> None:
    task = task_on(circle(), origin=Origin(file="cell.yaml", lines=lines))

    assert task.where("corners", shared="motion.corners") == place


def test_a_task_made_in_python_has_a_place_without_a_line() -> None:
    task = task_on(circle(), origin=Origin())

    assert (task.where(), task.where("path")) == ("<cell>: tasks.ring", "<cell>: tasks.ring.path")
