"""Figures of all joints at once: how near each is to its limits, and how fast it is, as shares of these limits."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.report import JointUse, Report
from cellplan.model.units import rounded_down
from cellplan.report.plots.figure import (
    Figure,
    Item,
    LegendKey,
    Limit,
    PlotAxis,
    PlotCurve,
    PlotMark,
    PlotPanel,
    time_axis,
    value_axis,
)
from cellplan.report.plots.palette import INK, LIMIT, ROBOTS
from cellplan.report.plots.placing import number_sign
from cellplan.report.record.common import shortened

MAX_ROBOTS: Final = 8  # with a panel each; more share one, with a curve for the worst joint of each robot
MAX_LETTERS: Final = 22  # [-] of joint names beside a title; longer ones are counted from the base
LONGEST_NAME: Final = 13  # [-] letters of a robot's name beside the names of its joints
PERCENT: Final = 100.0

Shares = Mapping[str, tuple[Sequence[JointUse], Array]]  # by robot: its joints and their shares in [%], shape (N, n)


def margins_figure(report: Report, robots: Sequence[str], colours: Mapping[str, str]) -> Figure | None:
    """Distance of every joint to its nearer limit; None where no joint has two."""
    shares = {robot: _margins(report, robot) for robot in robots}
    shares = {robot: share for robot, share in shares.items() if share[0]}
    return _figure(
        "joint margins: distance to the nearer limit, in % of half the range",
        shares,
        report.times,
        colours,
        is_margin=True,
    )


def speeds_figure(report: Report, robots: Sequence[str], colours: Mapping[str, str]) -> Figure | None:
    """Speed of every joint as a share of its limit; None without robots."""
    named = {robot: [use for use in report.joints if use.robot == robot] for robot in robots}
    shares = {
        robot: (uses, PERCENT * np.abs(report.qd[robot]) / np.array([use.velocity_limit for use in uses]))
        for robot, uses in named.items()
        if uses
    }
    middle = 0.5 * (report.times[1:] + report.times[:-1])
    return _figure("joint speeds, in % of their limits", shares, middle, colours, is_margin=False, ends=report.times)


def _margins(report: Report, robot: str) -> tuple[list[JointUse], Array]:
    """Joints with two limits, and their margins in [%]."""
    uses = [use for use in report.joints if use.robot == robot]
    limited = [i for i, use in enumerate(uses) if np.isfinite(use.upper - use.lower)]
    lower, upper = np.array([[uses[i].lower, uses[i].upper] for i in limited]).reshape(-1, 2).T
    q = report.q[robot][:, limited]
    return [uses[i] for i in limited], PERCENT * np.minimum(q - lower, upper - q) / (0.5 * (upper - lower))


def _figure(
    title: str, shares: Shares, times: Array, colours: Mapping[str, str], *, is_margin: bool, ends: Array | None = None
) -> Figure | None:
    """A panel for each robot with a curve for each joint, or one for all robots with the worst joint of each."""
    if not shares:
        return None
    if len(shares) > MAX_ROBOTS:
        panels = [_crowd(shares, times, colours, is_margin=is_margin)]
    else:
        panels = [_robot(robot, *share, times, is_margin=is_margin) for robot, share in shares.items()]
    x = time_axis(times if ends is None else ends)
    return Figure(title=title, x=x, panels=panels, columns=min(2, len(panels)))


def _robot(robot: str, uses: Sequence[JointUse], shares: Array, times: Array, *, is_margin: bool) -> PlotPanel:
    """The joints of one robot, with the worst instant of all."""
    names = [use.joint for use in uses]
    if sum(map(len, names)) > MAX_LETTERS:
        names = [str(place) for place in range(1, len(uses) + 1)]
    pens = [ROBOTS[i % len(ROBOTS)] for i in range(len(uses))]
    row, joint = np.unravel_index(int(shares.argmin() if is_margin else shares.argmax()), shares.shape)
    value = float(shares[row, joint])
    is_bad = value < 0.0 if is_margin else value > PERCENT
    items: list[Item] = [_limit(is_margin=is_margin)]
    items += [
        PlotCurve(use.joint, times, shares[:, i], pen, 1.1) for i, (use, pen) in enumerate(zip(uses, pens, strict=True))
    ]
    items.append(PlotMark(float(times[row]), value, LIMIT if is_bad else INK))
    return PlotPanel(
        title=shortened(robot, LONGEST_NAME),
        keys=[LegendKey(name, pen) for name, pen in zip(names, pens, strict=True)],
        note=f"{uses[int(joint)].joint}: {_worst_text(value, is_margin=is_margin)} at {times[row]:.3f} s",
        y=_axis(shares, is_margin=is_margin),
        items=items,
    )


def _crowd(shares: Shares, times: Array, colours: Mapping[str, str], *, is_margin: bool) -> PlotPanel:
    """The worst joint of every robot at each instant."""
    worst = {robot: values.min(axis=1) if is_margin else values.max(axis=1) for robot, (_, values) in shares.items()}
    stacked = np.stack(list(worst.values()))
    robot, row = np.unravel_index(int(stacked.argmin() if is_margin else stacked.argmax()), stacked.shape)
    value = float(stacked[robot, row])
    items: list[Item] = [_limit(is_margin=is_margin)]
    items += [PlotCurve(name, times, curve, colours[name], 1.0) for name, curve in worst.items()]
    items.append(PlotMark(float(times[row]), value))
    return PlotPanel(
        title="worst joint of each robot",
        note=f"{list(worst)[int(robot)]}: {_worst_text(value, is_margin=is_margin)} at {times[row]:.3f} s",
        y=_axis(stacked, is_margin=is_margin),
        items=items,
    )


def _limit(*, is_margin: bool) -> Limit:
    """The limit of all shares."""
    return Limit(0.0, is_upper=False) if is_margin else Limit(PERCENT)


def _axis(shares: Array, *, is_margin: bool) -> PlotAxis:
    """The axis of shares: the whole range for margins, up to the limit at least for speeds."""
    if is_margin:
        return value_axis(min(0.0, float(shares.min())), PERCENT, unit="%")
    return value_axis(0.0, max(PERCENT, float(shares.max())), unit="%", is_floored=True)


def _worst_text(value: float, *, is_margin: bool) -> str:
    """The worst share in words."""
    return f"{number_sign(f'{rounded_down(value) if is_margin else value:.1f}')} %"
