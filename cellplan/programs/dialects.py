"""All program formats by name: each stands in a file or folder of its own in ``cellplan.programs.formats``."""

from collections import UserDict
from collections.abc import MutableMapping
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from cellplan.programs.elements.dialect import Dialect
    from cellplan.programs.elements.escapes import EscapeForm


class _Formats(UserDict[str, Any]):
    """Objects by the name of their format; one that is stated by its place in ``formats`` is imported for its use."""

    def __getitem__(self, name: str) -> Any:
        if isinstance(place := self.data[name], str):
            self.data[name] = resolve_name(f"cellplan.programs.formats.{place}")
        return self.data[name]


DIALECTS: Final["MutableMapping[str, Dialect]"] = _Formats(
    csv="csv:CSV",
    fanuc_ls="fanuc_ls.writer:FANUC_LS",
    inform="inform.writer:INFORM",
    json="json_tables:JSON",
    krl="krl.writer:KRL",
    rapid="rapid.writer:RAPID",
    ros2="ros2.writer:ROS2",
    stream="stream.writer:STREAM",
    urscript="urscript.writer:URSCRIPT",
    val3="val3.writer:VAL3",
)
ESCAPES: Final["MutableMapping[str, EscapeForm]"] = _Formats(
    fanuc_ls="fanuc_ls.escape:TP_ESCAPE",
    inform="inform.escape:INFORM_ESCAPE",
    krl="krl.escape:KRL_ESCAPE",
    rapid="rapid.escape:RAPID_ESCAPE",
    urscript="urscript.escape:URSCRIPT_ESCAPE",
    val3="val3.escape:VAL3_ESCAPE",
)
