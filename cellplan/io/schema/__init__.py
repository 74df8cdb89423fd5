"""What may stand in a cell file, a robot table and an errors file: keys, units, defaults and bounds."""

from cellplan.io.schema.cell import CellDocument
from cellplan.io.schema.json_schemas import errors_schema, json_schema, robot_table_schema
from cellplan.io.schema.robot_table import RobotTableDocument

__all__ = ["CellDocument", "RobotTableDocument", "errors_schema", "json_schema", "robot_table_schema"]
