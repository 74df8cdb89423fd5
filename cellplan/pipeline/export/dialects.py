"""All program formats by name: each stands in a file or folder of its own in ``cellplan.export``."""

from collections.abc import Mapping
from typing import Final

from cellplan.export.csv import CSV
from cellplan.export.dialect import Dialect
from cellplan.export.json_tables import JSON
from cellplan.export.krl.writer import KRL
from cellplan.export.rapid.writer import RAPID
from cellplan.export.ros2.writer import ROS2
from cellplan.export.stream.writer import STREAM
from cellplan.export.urscript.writer import URSCRIPT
from cellplan.export.val3.writer import VAL3

DIALECTS: Final[Mapping[str, Dialect]] = {
    dialect.name: dialect for dialect in (CSV, JSON, KRL, RAPID, ROS2, STREAM, URSCRIPT, VAL3)
}
