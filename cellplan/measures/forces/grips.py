"""How much of its friction a grip needs: soft fingers, whose pads bear a force along them and a moment."""

import numpy as np

from cellplan.geometry.arrays import Array, first_peak
from cellplan.model.cell.cell import Grasp
from cellplan.model.report.forces import GripUse
from cellplan.model.settings.forces import GripEntry


def grip_use(
    grasp: Grasp, grip: GripEntry, tip: Array, times: Array, *, at_error: tuple[float, float] = (0.0, 0.0)
) -> GripUse:
    r"""Largest share of its friction that a grip needs.

    A disc that presses with N bears a tangential force t and a moment m about its normal where

    .. math:: \sqrt{t^2 + (m / \rho)^2} \le \mu N, \quad \rho = \tfrac23 r,

    the elliptic limit surface of a soft finger; rho is exact for an even pressure and m alone (Howe and Cutkosky 1996,
    Practical force-motion models for sliding manipulation). A force along the normal, either way, is taken from what
    all pads press with. Moments across the normal load pads unevenly and are not judged.

    Args:
        tip: What the tool exerts on the part at its tip, in P, shape (N, 6).
        times: Times in [s], shape (N,).
        at_error: Force in [N] and moment in [N m] that come in the worst direction.
    """
    R = grasp.X_PT[:3, :3]
    force, moment = tip[:, :3] @ R, tip[:, 3:] @ R
    across = [axis for axis in range(3) if axis != grip.axis]
    tangential = np.linalg.norm(force[:, across], axis=1) + at_error[0]
    torsion, normal = np.abs(moment[:, grip.axis]) + at_error[1], np.abs(force[:, grip.axis])
    shares = (np.hypot(tangential, torsion / grip.lever) / grip.friction + normal) / grip.pressure
    row = first_peak(shares)
    return GripUse(
        robot=grasp.robot,
        share=float(shares.max()),
        at_s=float(times[row]),
        tangential=float(tangential[row]),
        torsion=float(torsion[row]),
        normal=float(normal[row]),
        across=float(np.linalg.norm(moment[:, across], axis=1).max()),
    )
