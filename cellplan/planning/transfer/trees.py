"""Two trees that grow towards each other: a way of one robot through its joint space, straight from node to node.

As in RRT-Connect (Kuffner and LaValle 2000), one tree is extended towards a configuration that is drawn, the other one
then runs towards the new node as far as it comes; then they change places. Distances are those of the joints in shares
of their top speeds, in seconds. The search ends by the number of configurations drawn: the same on every machine.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.planning.transfer.move_check import MoveCheck

STEP: Final = 0.3  # [s] longest edge, as the time that the joints take at top speed
BOXES: Final = (0.1, 0.35, 1.0)  # shares of the joint ranges that are drawn from beside both ends, in turn
SAME: Final = 1e-9  # [s] nodes that are nearer to each other are one


@dataclass(slots=True, eq=False)
class Tree:
    """Configurations in seconds, each with the one it was reached from."""

    nodes: Array  # configurations divided by top speeds, shape (n,) each; the root first
    count: int = 1
    parents: list[int] = field(default_factory=lambda: [0])  # index of the node each one was reached from

    @classmethod
    def at(cls, root: Array, *, capacity: int) -> "Tree":
        """A tree of its root only, with room for so many nodes."""
        nodes = np.empty((capacity, len(root)))
        nodes[0] = root
        return cls(nodes)

    def nearest(self, x: Array) -> int:
        """Index of the node nearest to a configuration."""
        apart = self.nodes[: self.count] - x
        return int(np.argmin(np.einsum("ij,ij->i", apart, apart)))

    def add(self, x: Array, parent: int) -> int:
        """Add a node; its index."""
        if self.count == len(self.nodes):
            self.nodes = np.concatenate([self.nodes, np.empty_like(self.nodes)])
        self.nodes[self.count] = x
        self.parents.append(parent)
        self.count += 1
        return self.count - 1

    def path_to(self, index: int) -> list[Array]:
        """Nodes from the root to one of them."""
        path = [self.nodes[index]]
        while index:
            index = self.parents[index]
            path.append(self.nodes[index])
        return path[::-1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Connection:
    """What a search came to."""

    path: Array | None  # via points in [rad] or [m] from start to goal, shape (K, n); None where none was found
    reached: tuple[int, int]  # configurations reached from the start and from the goal
    over_gap: Array | None = None  # where none was found, the way along both trees and straight from one to the other


def connected(
    check: MoveCheck,
    ends: tuple[Array, Array],
    *,
    box: "JointBox",
    samples: int,
    rng: np.random.Generator,
    tick: Callable[[float], object],
) -> Connection:
    """A way between two configurations.

    Args:
        ends: Start and goal in [rad] or [m], shape (n,) each.
        samples: How many of them at most.
    """
    scale, (start, goal) = box.velocity, ends
    trees = [Tree.at(start / scale, capacity=256), Tree.at(goal / scale, capacity=256)]
    for number in range(samples):
        tick(number / samples)
        mine, other = trees[number % 2], trees[1 - number % 2]
        new = _extended(check, mine, box.draw(rng, number, start, goal) / scale, scale)
        if new is None:
            continue
        met = _run(check, other, mine.nodes[new], scale)
        if met is not None:
            ahead, back = (new, met) if number % 2 == 0 else (met, new)
            vertices = trees[0].path_to(ahead) + trees[1].path_to(back)[-2::-1]
            path = np.array(vertices) * scale
            path[0], path[-1] = start, goal
            return Connection(path=path, reached=(trees[0].count, trees[1].count))
    return Connection(path=None, reached=(trees[0].count, trees[1].count), over_gap=_over_gap(trees) * scale)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointBox:
    """Configurations that a robot may be in."""

    lower: Array  # lower limits in [rad] or [m], finite, shape (n,)
    upper: Array  # likewise
    velocity: Array  # top speeds in [rad/s] or [m/s], shape (n,)

    def draw(self, rng: np.random.Generator, number: int, start: Array, goal: Array) -> Array:
        """A configuration from the limits, more often from near the ends of the way."""
        margin = BOXES[number // 2 % len(BOXES)] * (self.upper - self.lower)
        low = np.maximum(self.lower, np.minimum(start, goal) - margin)
        high = np.minimum(self.upper, np.maximum(start, goal) + margin)
        return rng.uniform(low, high)


def _over_gap(trees: list[Tree]) -> Array:
    """The way along both trees to their nearest nodes and straight from the one to the other, shape (K, n)."""
    ahead, back = (tree.nodes[: tree.count] for tree in trees)
    nearest = [trees[1].nearest(x) for x in ahead]
    node = int(np.argmin(np.linalg.norm(ahead - back[nearest], axis=1)))
    return np.array(trees[0].path_to(node) + trees[1].path_to(nearest[node])[::-1])


def _extended(check: MoveCheck, tree: Tree, x: Array, scale: Array) -> int | None:
    """Index of a new node at most one step from the nearest one towards a configuration; None where that is blocked."""
    near = tree.nearest(x)
    apart = x - tree.nodes[near]
    length = float(np.linalg.norm(apart))
    if length < SAME:
        return near
    new = x if length <= STEP else tree.nodes[near] + apart * (STEP / length)
    return tree.add(new, near) if check.is_free(tree.nodes[near] * scale, new * scale) else None


def _run(check: MoveCheck, tree: Tree, x: Array, scale: Array) -> int | None:
    """Index of the node of a tree that is at a configuration, after steps towards it; None where one is blocked."""
    while True:
        new = _extended(check, tree, x, scale)
        if new is None or np.linalg.norm(tree.nodes[new] - x) < SAME:
            return new
