"""Static forces as text: the joint with the largest torque, internal forces and the grip nearest to sliding."""

from collections.abc import Iterator

from cellplan.report.record.common import Record
from cellplan.report.record.numbers import percent, small
from cellplan.report.record.phases import instant_text
from cellplan.report.text.columns import Row


def force_rows(forces: Record | None) -> Iterator[Row]:
    """Rows about the forces of a run; none for a record without them."""
    if forces is None:
        return
    loads = [(robot, name, it) for robot, joints in forces["joints"].items() for name, it in joints.items()]
    for unit in ("Nm", "N"):
        of_unit = [load for load in loads if load[2]["unit"] == unit and load[2]["torque"]]
        if of_unit:
            robot, name, load = max(of_unit, key=lambda it: float(it[2]["torque"]))
            weights = "weights not stated" if load["by_weight"] is None else f"{small(load['by_weight'])} by weights"
            sizes = f"{small(load['by_process'])} by processes, {weights}"
            where = f"{robot} {name} {instant_text(load, 'torque_at_s')}; at most {sizes}; links not counted"
            yield (
                f"largest {'torque' if unit == 'Nm' else 'joint force'} by loads",
                f"{small(load['torque'])} {unit}",
                where,
            )
    internals = [(robot, it["internal"]) for robot, it in forces["holders"].items() if it["internal"] is not None]
    if internals:
        robot, internal = max(internals, key=lambda it: (it[1]["moment_at_error_nm"], it[1]["moment_nm"]))
        stated = internal["force_at_error_n"] or internal["moment_at_error_nm"]
        error = f"; {_wrench(internal, '_at_error')} at most by the stated errors" if stated else ""
        yield "internal force", _wrench(internal), f"{robot}, by the closure errors of the tables{error}"
    for robot, grip in forces["grips"].items():
        across = f", {small(grip['across_nm'])} Nm across its normal not judged" if grip["across_nm"] else ""
        yield (
            "friction of a grip",
            f"{percent(grip['share'], 1)} used",
            f"{robot} {instant_text(grip, 'share_at_s')}{across}",
        )


def _wrench(internal: Record, at: str = "") -> str:
    """A force and a moment."""
    return f"{small(internal[f'force{at}_n'])} N, {small(internal[f'moment{at}_nm'])} Nm"
