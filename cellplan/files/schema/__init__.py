"""What may stand in a cell file, a robot table and an errors file: keys, units, defaults and bounds."""

from cellplan.files.schema.cell import CellDocument
from cellplan.files.schema.robot_table import RobotTableDocument

__all__ = ["CellDocument", "RobotTableDocument"]
