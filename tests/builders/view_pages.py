"""What a 3-D page holds, read back as a browser reads it."""

import json
import re
from base64 import b64decode
from collections.abc import Iterator
from typing import Any

import numpy as np

from cellplan.geometry.transforms import Array, rotation_about


def data_of(page: str) -> dict[str, Any]:
    """The record that a page carries."""
    data = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, flags=re.DOTALL)
    assert data is not None
    return json.loads(data[1])


def rows_of(motion: dict[str, Any]) -> tuple[Array, Array]:
    """Times of the rows of a page and its stacked joint positions."""
    times = np.frombuffer(b64decode(motion["times"]), dtype="<f8")
    q = np.frombuffer(b64decode(motion["q"]), dtype="<f4").reshape(len(times), -1)
    return times, q.astype(float)


def body_poses(scene: dict[str, Any], q: Array) -> Iterator[Array]:
    """Pose of each body at one configuration, from what the page holds, shape (4, 4)."""
    links = [_links(robot, q) for robot in scene["robots"]]
    for body in scene["bodies"]:
        pose = matrix(body["pose"])
        yield pose if body["robot"] < 0 else links[body["robot"]][body["link"] + 1] @ pose


def matrix(numbers: list[float]) -> Array:
    """The matrix of twelve numbers."""
    return np.vstack([np.array(numbers).reshape(3, 4), [0.0, 0.0, 0.0, 1.0]])


def _links(robot: dict[str, Any], q: Array) -> list[Array]:
    """Displacement of the base and of every link of a robot."""
    links = [matrix(robot["base"])]
    for axis in robot["axes"]:
        position = axis["ratio"] * q[robot["column"] + axis["joint"]] + axis["offset"]
        step = np.eye(4)
        if axis["turns"]:
            step[:3, :3] = rotation_about(np.array(axis["axis"]), position)
            step[:3, 3] = np.array(axis["point"]) - step[:3, :3] @ axis["point"]
        else:
            step[:3, 3] = position * np.array(axis["axis"])
        links.append(links[axis["parent"] + 1] @ step)
    return links
