"""Corrected references: exact for errors that stay, silent on what a task leaves open, noisy as the measurement is."""

import numpy as np
from builders.random_cells import make_task

from cellplan.geometry.transforms import inverse, pose_from, rotation_exp, rotation_vector
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.planning.euler.measured_feedback import corrected_references, displaced

ROUNDING = 1e-12  # [m], [-]
N = 7


def poses(rng, size=1.0):
    return pose_from(rotation_exp(size * rng.normal(size=(N, 3))), size * rng.normal(size=(N, 3)))


def schedule_of(task, X_PT):
    scheduled = TaskSchedule(task=task, X_PT=X_PT, V_PT_P=np.zeros((N, 6)), travelled=np.zeros(N), length=1.0, end=1.0)
    return Schedule(times=0.1 * np.arange(N), tasks=(scheduled,))


def test_an_error_that_stays_with_the_tool_is_corrected_at_once():
    rng = np.random.default_rng(1)
    desired, E = poses(rng), poses(rng, 0.01)
    schedule = schedule_of(make_task("arm"), desired)

    corrected = corrected_references(schedule, schedule, [desired @ E])

    np.testing.assert_allclose(corrected.tasks[0].X_PT @ E, desired, atol=ROUNDING)


def test_an_error_that_stays_with_the_part_is_corrected_at_once():
    rng = np.random.default_rng(2)
    desired, D = poses(rng), poses(rng, 0.01)
    schedule = schedule_of(make_task("arm"), desired)

    corrected = corrected_references(schedule, schedule, [D @ desired])

    np.testing.assert_allclose(D @ corrected.tasks[0].X_PT, desired, atol=ROUNDING)


def test_references_of_a_later_pass_are_moved_on_from_those_of_the_last():
    rng = np.random.default_rng(3)
    desired, reported, seen = poses(rng), poses(rng), poses(rng)
    task = make_task("arm")

    corrected = corrected_references(schedule_of(task, desired), schedule_of(task, reported), [seen])

    np.testing.assert_allclose(corrected.tasks[0].X_PT, desired @ inverse(seen) @ reported, atol=10 * ROUNDING)


def test_twists_lead_from_each_reference_to_the_next():
    rng = np.random.default_rng(4)
    desired = poses(rng, 0.3)
    schedule = schedule_of(make_task("arm"), desired)

    (scheduled,) = corrected_references(schedule, schedule, [desired @ poses(rng, 0.01)]).tasks

    X, V, step = scheduled.X_PT, scheduled.V_PT_P, 0.1
    np.testing.assert_allclose(X[:-1, :3, 3] + step * V[:-1, :3], X[1:, :3, 3], atol=ROUNDING)
    np.testing.assert_allclose(rotation_exp(step * V[:-1, 3:]) @ X[:-1, :3, :3], X[1:, :3, :3], atol=ROUNDING)
    np.testing.assert_array_equal(V[-1], 0.0)


def test_components_that_a_planar_task_leaves_open_are_not_corrected():
    task, desired = make_task("arm", axes=(0, 1, 5)), np.repeat(np.eye(4)[None], N, axis=0)
    turn = np.array([0.0, 0.0, 0.02])
    seen = np.repeat(pose_from(rotation_exp(turn), np.array([1e-3, 2e-3, 0.4]))[None], N, axis=0)

    moved = displaced(task, desired, seen, nominal=desired)

    np.testing.assert_allclose(rotation_vector(moved[:, :3, :3]), np.tile(-turn, (N, 1)), atol=ROUNDING)
    np.testing.assert_allclose(moved[:, 2, 3], 0.0, atol=ROUNDING)  # the height is nobody's business


def test_a_task_of_position_alone_turns_no_reference():
    task, desired = make_task("arm", axes=(0, 1, 2)), np.repeat(np.eye(4)[None], N, axis=0)
    tip = np.array([1e-3, 2e-3, -3e-3])
    seen = np.repeat(pose_from(rotation_exp(np.array([0.3, -0.2, 0.5])), tip)[None], N, axis=0)

    moved = displaced(task, desired, seen, nominal=desired)

    np.testing.assert_allclose(moved[:, :3, 3], np.tile(-tip, (N, 1)), atol=ROUNDING)
    np.testing.assert_array_equal(moved[:, :3, :3], desired[:, :3, :3])


def test_a_free_spin_is_left_as_it_is():
    """The tool is tilted by a known turn and spun by anything: only the tilt is taken back."""
    task = make_task("arm", is_spin_free=True)
    tilt, spin = rotation_exp(np.array([0.01, -0.02, 0.0])), rotation_exp(np.array([0.0, 0.0, 1.3]))
    desired = np.repeat(np.eye(4)[None], N, axis=0)
    seen = np.repeat(pose_from(tilt @ spin, np.zeros(3))[None], N, axis=0)

    moved = displaced(task, desired, seen, nominal=seen)

    np.testing.assert_allclose(moved[:, :3, 2], desired[:, :3, 2], atol=ROUNDING)
    np.testing.assert_allclose(moved[:, :3, :3], np.tile(spin, (N, 1, 1)), atol=ROUNDING)
