"""A robot at rest among moving ones is refused where the certificate of that state refuses it, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest
from builders.moving_cells import cell_with_bodies

from cellplan.certify.certify import certify
from cellplan.certify.run_pairs import rows_moved_by, scene_of_rows
from cellplan.certify.still_robots import HomeTrials, RunSamples
from cellplan.geometry.transforms import Array
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

DEMAND = 0.03  # [m]
SAMPLES = 3


def moving_others(seed: int) -> tuple[Scene, Array, Array]:
    """The pairs of one robot, samples of a run of the others, and configurations of the robot."""
    cell = cell_with_bodies(seed, joints=3)
    scene = Scene.from_cell(replace(cell, checks=cell.checks.changed(clearance_mm=1e3 * DEMAND)))
    rng = np.random.default_rng(seed)
    samples = 0.5 * rng.uniform(-1.0, 1.0, size=(SAMPLES, cell.joint_count))
    trials = 2.0 * rng.uniform(-1.0, 1.0, size=(25, len(cell.robot("op0").model.joints)))
    return scene_of_rows(scene, rows_moved_by(scene, "op0")), samples, trials


def certified(scene: Scene, samples: Array, q: Array, extra: float) -> bool:
    """Whether the certificate of every sample, in which nothing moves, keeps all demands."""
    is_raised = [_is_raised(scene, row) for row in range(len(scene.pairs))]
    pairs = [
        replace(pair, demand=pair.demand + extra * raised) if pair.rule is Rule.CLEARANCE else pair
        for pair, raised in zip(scene.pairs, is_raised, strict=True)
    ]
    stacked = samples.copy()
    stacked[:, scene.cell.columns("op0")] = q
    whole = replace(scene, pairs=tuple(pairs))
    return all(certify(whole, np.stack([row, row]), with_minimum=False).is_met for row in stacked)


def _is_raised(scene: Scene, row: int) -> bool:
    """Whether the other body of a pair is the part or moves with another robot."""
    ends = (scene.bodies[scene.pairs[row].first], scene.bodies[scene.pairs[row].second])
    return any(end.name == "part" or (not end.is_at_rest and end.robot != "op0") for end in ends)


@pytest.mark.parametrize(("seed", "extra"), [(1, 0.0), (9, 0.2)])
def test_trials_are_refused_where_the_certificate_of_a_sample_is(seed: int, extra: float) -> None:
    scene, samples, trials = moving_others(seed)
    tried = HomeTrials("op0", [RunSamples(scene=scene, q=samples)])

    refused = [tried.is_refused(q, extra=extra) for q in trials]

    assert refused == [not certified(scene, samples, q, extra) for q in trials]
    assert 3 <= sum(refused) <= len(trials) - 3
    assert tried.refused.total() == sum(refused)


def test_samples_that_are_added_or_divided_among_runs_refuse_the_same() -> None:
    scene, samples, trials = moving_others(1)
    at_once = HomeTrials("op0", [RunSamples(scene=scene, q=samples)])
    later = HomeTrials("op0", [RunSamples(scene=scene, q=samples[:1])])
    divided = HomeTrials("op0", [RunSamples(scene=scene, q=samples[k : k + 1]) for k in range(SAMPLES)])
    first = [later.is_refused(q) for q in trials]
    for sample in samples[1:]:
        later.add(0, sample)

    refused = [at_once.is_refused(q) for q in trials]

    assert [later.is_refused(q) for q in trials] == refused
    assert [divided.is_refused(q) for q in trials] == refused
    assert sum(first) < sum(refused)
