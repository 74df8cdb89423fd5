"""The job as one robot description, for the libraries that read URDF: all arms on one base."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
from job import Arm, Array, Job

PART: Final = "part"  # name of the part's frame
UPRIGHT: Final = 1e-9  # [-] cosine of a pitch below which roll and yaw turn about the same axis
INERTIAL: Final = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
LIMIT: Final = '<limit lower="-100" upper="100" velocity="100" effort="100"/>'  # [rad], [rad/s]: never reached


def joint_name(arm: int, joint: int) -> str:
    """Name of one joint."""
    return f"arm{arm}_joint{joint}"


def joint_names(job: Job) -> list[str]:
    """Names of all joints in the order of the stacked joint vector."""
    return [joint_name(arm, joint) for arm, entry in enumerate(job.arms) for joint in range(len(entry.axes_B))]


def tool_name(arm: int) -> str:
    """Name of the frame at the tool tip of one arm."""
    return f"arm{arm}_tool"


def urdf(job: Job) -> str:
    """The description; every joint frame is parallel to its arm's base at the reference configuration."""
    lines = ['<robot name="cell">', '<link name="base_link"/>']
    for index, arm in enumerate(job.arms):
        lines += _arm(index, arm)
    lines += _fixed(PART, parent=tool_name(job.holder), X=job.X_HP)
    return "\n".join([*lines, "</robot>"])


def write_urdf(job: Job) -> str:
    """Path of the description as a file that stays until the process ends, for libraries that read only files."""
    folder = Path(tempfile.mkdtemp(prefix="cellplan-bench-"))
    (folder / "robot.urdf").write_text(urdf(job), encoding="utf-8")
    return str(folder / "robot.urdf")


def numbers(values: Array) -> str:
    """Numbers with all their digits."""
    return " ".join(repr(float(value)) for value in values)


def joint_frames(arm: Arm) -> list[Array]:
    """Each joint's frame in the one before it, the first in the world, shape (4, 4) each."""
    frames = [arm.X_WB @ at(arm.points_B[0])]
    return frames + [at(step) for step in np.diff(arm.points_B, axis=0)]


def tool_frame(arm: Arm) -> Array:
    """Tool tip in the last joint's frame, shape (4, 4)."""
    X_JT: Array = at(-arm.points_B[-1]) @ arm.X_BT
    return X_JT


def at(point: Array) -> Array:
    """Pose without rotation."""
    X = np.eye(4)
    X[:3, 3] = point
    return X


def _arm(index: int, arm: Arm) -> Iterator[str]:
    """Links and joints of one arm, and the frame at its tool tip."""
    parent = "base_link"
    for joint, (axis, X) in enumerate(zip(arm.axes_B, joint_frames(arm), strict=True)):
        link = f"arm{index}_link{joint}"
        yield f'<link name="{link}">{INERTIAL}</link>'
        yield f'<joint name="{joint_name(index, joint)}" type="revolute"><parent link="{parent}"/>'
        yield f'<child link="{link}"/>{_origin(X)}<axis xyz="{numbers(axis)}"/>{LIMIT}</joint>'
        parent = link
    yield from _fixed(tool_name(index), parent=parent, X=tool_frame(arm))


def _fixed(name: str, *, parent: str, X: Array) -> Iterator[str]:
    """A frame fixed to a link."""
    yield f'<link name="{name}">{INERTIAL}</link>'
    yield f'<joint name="{name}_joint" type="fixed"><parent link="{parent}"/><child link="{name}"/>{_origin(X)}</joint>'


def _origin(X: Array) -> str:
    """A pose as URDF writes it: roll, pitch and yaw about fixed axes."""
    R = X[:3, :3]
    level = np.hypot(R[0, 0], R[1, 0])
    roll, pitch, yaw = np.arctan2(R[2, 1], R[2, 2]), np.arctan2(-R[2, 0], level), np.arctan2(R[1, 0], R[0, 0])
    if level < UPRIGHT:
        roll, yaw = np.arctan2(-R[1, 2], R[1, 1]), 0.0
    return f'<origin xyz="{numbers(X[:3, 3])}" rpy="{numbers(np.array([roll, pitch, yaw]))}"/>'
