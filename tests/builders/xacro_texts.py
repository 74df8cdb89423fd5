"""A small arm in xacro: a file, a package with a macro and a YAML file of lengths."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from cellplan.errors import InputError
from cellplan.files.input.files import AllowedFolders
from cellplan.files.robots.urdf.document.document import UrdfDocument, read_document
from cellplan.files.robots.urdf.document.xacro import XacroSettings

HEAD = '<robot name="rig" xmlns:xacro="http://www.ros.org/wiki/xacro">'
ARM = f"""\
{HEAD}
<xacro:arg name="prefix" default="left_"/>
<xacro:arg name="length" default="0.4"/>
<xacro:include filename="$(find arm_support)/urdf/segment.xacro"/>
<xacro:property name="sizes" value="${{xacro.load_yaml('sizes.yaml')}}"/>
<link name="base"/>
<xacro:segment name="$(arg prefix)upper" parent="base" length="$(arg length)" turn="${{pi / 5}}"/>
<xacro:segment name="$(arg prefix)lower" parent="$(arg prefix)upper" length="${{sizes.lower}}" turn="${{sizes.turn}}"/>
</robot>
"""
SEGMENT = f"""\
{HEAD}
<xacro:macro name="segment" params="name parent length turn">
  <joint name="${{name}}_joint" type="revolute">
    <parent link="${{parent}}"/><child link="${{name}}"/>
    <origin xyz="${{length}} 0 0.1" rpy="0 ${{turn}} 0.3"/><axis xyz="0 0 ${{2 * 0.5}}"/>
    <limit lower="-1" upper="2" velocity="3" effort="1" damping="1"/>
  </joint>
  <link name="${{name}}"><collision><geometry><box size="0.1 0.1 ${{length}}"/></geometry></collision></link>
</xacro:macro>
</robot>
"""
SIZES = "lower: 0.25\nturn: !degrees 30\n"


def write_arm(folder: Path) -> Path:
    """Path of ``arm.urdf.xacro`` in ``folder``; the package ``arm_support`` lies in ``folder/packages``."""
    package = folder / "packages" / "arm_support" / "urdf"
    package.mkdir(parents=True)
    (package / "segment.xacro").write_text(SEGMENT, encoding="utf-8")
    (folder / "sizes.yaml").write_text(SIZES, encoding="utf-8")
    path = folder / "arm.urdf.xacro"
    path.write_text(ARM, encoding="utf-8")
    return path


def expanded(folder: Path, *lines: str, args: Mapping[str, str] | None = None) -> UrdfDocument:
    """A file of a robot whose elements stand in lines 2, 3, …, allowed to read its own folder."""
    path = folder / "r.xacro"
    path.write_text("\n".join([HEAD, *lines, "</robot>"]), encoding="utf-8")
    return read_document(path, XacroSettings(arguments=args or {}, within=AllowedFolders(folder=folder)))


def refused(folder: Path, *lines: str, args: Mapping[str, str] | None = None) -> str:
    with pytest.raises(InputError) as caught:
        expanded(folder, *lines, args=args)
    assert "\n" not in str(caught.value)
    return str(caught.value)
