"""All program formats by name: each stands in a file or folder of its own in ``cellplan.programs.formats``."""

from collections.abc import Mapping
from typing import Final

from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.escapes import EscapeForm
from cellplan.programs.formats.csv import CSV
from cellplan.programs.formats.fanuc_ls.escape import TP_ESCAPE
from cellplan.programs.formats.fanuc_ls.writer import FANUC_LS
from cellplan.programs.formats.inform.writer import INFORM
from cellplan.programs.formats.json_tables import JSON
from cellplan.programs.formats.krl.escape import KRL_ESCAPE
from cellplan.programs.formats.krl.writer import KRL
from cellplan.programs.formats.rapid.escape import RAPID_ESCAPE
from cellplan.programs.formats.rapid.writer import RAPID
from cellplan.programs.formats.ros2.writer import ROS2
from cellplan.programs.formats.stream.writer import STREAM
from cellplan.programs.formats.urscript.escape import URSCRIPT_ESCAPE
from cellplan.programs.formats.urscript.writer import URSCRIPT
from cellplan.programs.formats.val3.escape import VAL3_ESCAPE
from cellplan.programs.formats.val3.writer import VAL3

DIALECTS: Final[Mapping[str, Dialect]] = {
    dialect.name: dialect for dialect in (CSV, FANUC_LS, INFORM, JSON, KRL, RAPID, ROS2, STREAM, URSCRIPT, VAL3)
}
ESCAPES: Final[Mapping[str, EscapeForm]] = {
    "fanuc_ls": TP_ESCAPE,
    "krl": KRL_ESCAPE,
    "rapid": RAPID_ESCAPE,
    "urscript": URSCRIPT_ESCAPE,
    "val3": VAL3_ESCAPE,
}
