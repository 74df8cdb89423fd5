"""What may stand in a cell file and in a robot table: keys, units, defaults and bounds."""

from cellplan.io.schema.cell import CellDocument
from cellplan.io.schema.export import json_schema, robot_table_schema
from cellplan.io.schema.robot_table import RobotTableDocument

__all__ = ["CellDocument", "RobotTableDocument", "json_schema", "robot_table_schema"]
