r"""How several holders share what acts on the part, and what errors of closure make them exert on it.

With the grasp matrix ``G = [G_1 .. G_h]``, which takes what the tools exert at their tips to the origin of the part,
and ``w`` on the part, rest demands ``G f + w = 0``. What solves ``G f = 0`` is internal: it loads part and robots only.
"""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import skew
from cellplan.model.cell.cell import Grasp, Part

SHORTEST: Final = 1e-3  # [m] of the length where all grasps are at one place


def grasp_matrix(grasp: Grasp) -> Array:
    """Wrench at the origin of the part by unit components of what a tool exerts at its tip, in P, shape (6, k).

    The components are those that the grasp keeps: it transmits no others.
    """
    G = np.eye(6)
    G[3:, :3] = skew(grasp.X_PT[:3, 3])
    return G[:, list(grasp.axes)]


def sharing_length(part: Part) -> float:
    """Length in [m] that a moment is divided by to count as a force: root mean square distance of the grasps' tips.

    The distance is that from their mean.
    """
    tips = np.array([grasp.X_PT[:3, 3] for grasp in part.held_by])
    return max(SHORTEST, float(np.sqrt(np.mean(np.sum((tips - tips.mean(axis=0)) ** 2, axis=1)))))


def load_shares(part: Part) -> Array:
    r"""Share of each of h holders in what acts on the part, at its origin and in P, shape (h, 6, 6); the sum is one.

    .. math:: f = -W^{-1} G^T (G W^{-1} G^T)^{-1} w, \quad W = diag(1, 1, 1, l^{-2}, l^{-2}, l^{-2})

    This is the f of least weighted norm, so its internal part is zero in that metric: the load is distributed as masses
    of radius of gyration l at the tips would have it (Erhart and Hirche 2015); l is that of ``sharing_length``. With
    the plain pseudo-inverse, l = 1 m, it would depend on the unit of length (Walker, Freeman and Marcus 1991).
    """
    if len(part.held_by) == 1:
        return np.eye(6)[None]
    inverse_weights = np.repeat([1.0, sharing_length(part) ** 2], 3)
    parts = [(G := grasp_matrix(it)) @ (inverse_weights[list(it.axes), None] * G.T) for it in part.held_by]
    return np.stack(parts) @ np.linalg.inv(np.sum(parts, axis=0))


def closure_stiffness(part: Part) -> Array | None:
    r"""What errors of closure make each of h holders exert on the part, shape (h, h, 6, 6).

    Entry (i, j) is the wrench of holder i, at the origin of the part, by the error of holder j: by how much its tool is
    off its grasp, at its tip; all in P, per [m] and [rad]. With springs :math:`K_j` at the tips the rigid part moves by

    .. math:: \xi = (\sum G_j K_j G_j^T)^{-1} \sum G_j K_j e_j, \quad f_i = K_i (e_i - G_i^T \xi) .

    For two holders these are springs in series. None for one holder, or unless the stiffness of all is stated.
    """
    if len(part.held_by) < 2:
        return None
    springs, stiffnesses = [], []
    for grasp in part.held_by:
        if grasp.stiffness is None:
            return None
        G, axes = grasp_matrix(grasp), list(grasp.axes)
        K = np.repeat(grasp.stiffness, 3)[axes]
        spring = np.zeros((6, 6))
        spring[:, axes] = G * K
        springs.append(spring)
        stiffnesses.append(G @ (K[:, None] * G.T))
    motions = np.linalg.solve(np.sum(stiffnesses, axis=0), np.stack(springs))
    wrenches = -np.stack(stiffnesses)[:, None] @ motions
    wrenches[np.arange(len(springs)), np.arange(len(springs))] += springs
    return wrenches


def at_tip(grasp: Grasp, wrench_P: Array) -> Array:
    """Wrenches at the tip of a holder's tool in P, shape (..., 6), from those at the origin of the part."""
    force, p = wrench_P[..., :3], grasp.X_PT[:3, 3]
    return np.concatenate([force, wrench_P[..., 3:] - np.cross(p, force)], axis=-1)
