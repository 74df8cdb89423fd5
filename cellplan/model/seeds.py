"""Seeds: random numbers that depend on a name and a seed, and on nothing else."""

import hashlib

import numpy as np


def generator(name: str, seed: int = 0) -> np.random.Generator:
    """A generator of random numbers for one named thing, such as a robot.

    The order in which things are named in a file, or what else is in it, changes nothing; neither does the process or
    the machine, as it would with Python's own ``hash``.

    Args:
        name: What the numbers are drawn for.
        seed: Seed of the cell.
    """
    digest = hashlib.sha256(f"{seed}:{name}".encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:16], "big"))
