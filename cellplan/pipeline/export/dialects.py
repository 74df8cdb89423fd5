"""All program formats by name: each stands in a file of its own in ``cellplan.export``."""

from collections.abc import Mapping
from typing import Final

from cellplan.export.csv import CSV
from cellplan.export.dialect import Dialect
from cellplan.export.json_tables import JSON
from cellplan.export.krl import KRL
from cellplan.export.rapid import RAPID
from cellplan.export.ros2 import ROS2
from cellplan.export.stream import STREAM
from cellplan.export.urscript import URSCRIPT
from cellplan.export.val3 import VAL3

DIALECTS: Final[Mapping[str, Dialect]] = {
    dialect.name: dialect for dialect in (CSV, JSON, KRL, RAPID, ROS2, STREAM, URSCRIPT, VAL3)
}
