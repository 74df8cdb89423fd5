"""Accuracy and repeatability of poses and paths, in the figures of ISO 9283:1998.

The standard repeats the runs of one robot. Here the runs are trials: real cells drawn from stated distributions. The
figures have the standard's names and formulae, and are to be called AP-, RP-, AT- and RT-style.
"""

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array
from cellplan.model.rehearsal import PathFigures, PoseFigures


def pose_figures(errors: Array, at_s: float) -> PoseFigures:
    r"""Pose accuracy AP and pose repeatability RP at one programmed pose (ISO 9283:1998, clause 7.2).

    With the attained positions ``p_j`` of n trials, their barycentre ``m`` and the commanded position ``p_c``

    .. math:: AP_p = |m - p_c|, \quad AP_a = \bar a - a_c, \quad l_j = |p_j - m|, \quad RP_l = \bar l + 3 S_l,
              \quad RP_a = \pm 3 S_a

    with the standard deviations ``S`` over ``n - 1``; likewise b and c. The angles a, b and c are the components of the
    small turn between attained and commanded orientation about x, y and z of the part.

    Args:
        errors: Commanded less attained pose of each trial in P: position in [m], then turn in [rad], shape (T, 6).
        at_s: Instant of the pose in [s].
    """
    accuracy = np.abs(errors.mean(axis=0))
    distance = float(np.linalg.norm(errors[:, :3].mean(axis=0)))
    if len(errors) < 2:
        return PoseFigures(at_s=at_s, AP_p=distance, AP_abc=_three(accuracy[3:]), RP_l=None, RP_abc=None)
    spread, turns = _repeatability(errors[:, None, :])
    return PoseFigures(
        at_s=at_s, AP_p=distance, AP_abc=_three(accuracy[3:]), RP_l=float(spread[0]), RP_abc=_three(turns[0])
    )


def path_figures(errors: Array, times: Array) -> PathFigures:
    r"""Path accuracy AT and path repeatability RT of one task (ISO 9283:1998, clauses 8.2 and 8.3).

    .. math:: AT_p = \max_i |m_i - p_{ci}|, \quad AT_a = \max_i |\bar a_i - a_{ci}|, \quad
              RT_p = \max_i (\bar l_i + 3 S_{l i}), \quad RT_a = \max_i 3 S_{a i}

    with the symbols of `pose_figures` at each point i of the path; likewise b and c. The standard compares points in
    planes across the path. Here they are compared at the same instant, so that an error along the path counts too: the
    figures are never smaller than those of the standard.

    Args:
        errors: Commanded less attained pose in P: position in [m], then turn in [rad], shape (T, N, 6).
        times: Times in [s], shape (N,).
    """
    mean = errors.mean(axis=0)
    distances = np.linalg.norm(mean[:, :3], axis=1)
    worst = int(np.argmax(distances))
    turns = np.abs(mean[:, 3:]).max(axis=0)
    AT_p, AT_at_s = float(distances[worst]), float(times[worst])
    if len(errors) < 2:
        return PathFigures(AT_p=AT_p, AT_p_at_s=AT_at_s, AT_abc=_three(turns), RT_p=None, RT_p_at_s=None, RT_abc=None)
    spread, turn_spread = _repeatability(errors)
    widest = int(np.argmax(spread))
    return PathFigures(
        AT_p=AT_p,
        AT_p_at_s=AT_at_s,
        AT_abc=_three(turns),
        RT_p=float(spread[widest]),
        RT_p_at_s=float(times[widest]),
        RT_abc=_three(turn_spread.max(axis=0)),
    )


def _repeatability(errors: Array) -> tuple[Array, Array]:
    """``l + 3 S_l`` in [m], shape (N,), and three standard deviations of the turns in [rad], shape (N, 3)."""
    spread = errors - errors.mean(axis=0)
    lengths = np.linalg.norm(spread[..., :3], axis=2)
    radii: Array = lengths.mean(axis=0) + 3.0 * lengths.std(axis=0, ddof=1)
    turns: Array = 3.0 * spread[..., 3:].std(axis=0, ddof=1)
    return radii, turns


def _three(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """Three plain numbers."""
    a, b, c = (float(value) for value in values)
    return a, b, c
