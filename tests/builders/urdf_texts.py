"""Small URDF texts and what their refusal says, for tests of the reader."""

from pathlib import Path

import pytest

from cellplan.errors import InputError
from cellplan.io.robots.urdf.load import UrdfOptions, load_urdf

LIMIT = '<limit lower="-1" upper="2" velocity="3"/>'


def joint(name: str, parent: str, child: str, inside: str = LIMIT, *, kind: str = "revolute") -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


def refusal(path: Path, options: UrdfOptions | None = None) -> str:
    with pytest.raises(InputError) as caught:
        load_urdf(path, options)
    message = str(caught.value)
    assert "\n" not in message
    return message


def refused(folder: Path, *lines: str, options: UrdfOptions | None = None) -> str:
    """Message for a robot whose elements stand in lines 2, 3, …"""
    path = folder / "r.urdf"
    path.write_text("\n".join(['<robot name="rig">', *lines, "</robot>"]), encoding="utf-8")
    return refusal(path, options)


ARM = ('<link name="base"/>', '<link name="tip"/>', joint("a1", "base", "tip"))
