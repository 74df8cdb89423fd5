"""Rough paths, as a scan lists them, and how far smoothed ones are from them."""

from dataclasses import replace
from typing import Any

import numpy as np

from builders.roller_paths import EZ, part_of, sampled, task_on
from cellplan.files.schema.path import SmoothEntry
from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import Box
from cellplan.model.task.task import SampledPath
from cellplan.model.task.toolpath import Toolpath
from cellplan.planning.path.build import build_toolpath

PLATE = part_of(Box((0.6, 0.6, 0.1)))


def entry(**values: float) -> SmoothEntry:
    return SmoothEntry.model_validate(values)


def scan(count: int = 40, *, is_closed: bool = False, **words: Any) -> SampledPath:
    """Points of a bow or a circle over a plate with noise of up to 0.15 mm, and axes of up to 1.5 deg."""
    generator = np.random.default_rng(count)
    s = np.linspace(-0.1, 0.1, count)
    points = np.stack([s, 2.0 * s**2, np.full(count, 0.05)], axis=1) + generator.uniform(-85e-6, 85e-6, (count, 3))
    axes = generator.uniform(-0.015, 0.015, (count, 3)) - EZ
    path = sampled(points, **{"axes": axes / np.linalg.norm(axes, axis=1, keepdims=True), "is_smooth": True, **words})
    if not is_closed:
        return path
    angles = 2.0 * np.pi * np.arange(count) / count
    circle = 0.08 * np.stack([np.cos(angles), np.sin(angles), np.zeros(count)], axis=1)
    return replace(path, is_closed=True, points=circle + path.points * [0.0, 0.0, 1.0])


def off_file(path: SampledPath, **words: Any) -> tuple[Array, Array, Array, Toolpath]:
    """Distances, angles and depths of a smoothed path from that of its file, densely along both, and its toolpath."""
    toolpath = build_toolpath(task_on(path, **words), PLATE)
    listed = toolpath.listed
    assert listed is not None
    s = np.linspace(0.0, toolpath.length, 3001)
    X, X_listed = toolpath.poses(s), listed.poses(s)
    off = X[:, :3, 3] - X_listed[:, :3, 3]
    z, z_listed = X[:, :3, 2], X_listed[:, :3, 2]
    angles = 2.0 * np.arcsin(0.5 * np.linalg.norm(z - z_listed, axis=1))
    return np.linalg.norm(off, axis=1), angles, np.sum(off * z_listed, axis=1), toolpath
