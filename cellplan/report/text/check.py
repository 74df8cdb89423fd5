"""A cell that was checked as text: verdict, what failed, start postures, paths, and what was not checked in full."""

from cellplan.report.record.common import Record
from cellplan.report.record.tasks import direction_text
from cellplan.report.text.columns import Row, aligned
from cellplan.report.text.failures import count_text, failure_lines
from cellplan.report.text.method import moved_start_lines
from cellplan.report.text.notes import reaches_nowhere
from cellplan.report.text.run import left_out_lines

MORE = "left_out of check --json"  # where the pairs stand that were not checked in full


def check_lines(record: Record) -> list[str]:
    """All lines about a checked cell."""
    starts: list[Row] = [
        (f"start of {robot}", "searched" if robot in record["start_found"] else "given", _posture(start))
        for robot, start in record["start"].items()
    ]
    paths: list[Row] = [
        (f"task {name}", f"{length:.4g} mm", direction_text(record["direction"][name]))
        for name, length in record["path_length_mm"].items()
    ]
    bulges: list[Row] = [
        (f"task {name}", f"{bulge:.3g} mm", "largest bulge of its path from the sides between its points")
        for name, bulge in record["path_bulge_mm"].items()
        if bulge
    ]
    controllers: list[Row] = [
        (f"controller {name}", controller["kind"], ", ".join(controller["robots"]))
        for name, controller in record["controllers"].items()
    ]
    return [
        f"{record['cell']}: {record['status']}",
        f"  {count_text(record['checks'])}",
        *failure_lines(record["checks"], "check --json"),
        *aligned([*starts, *paths, *bulges, *controllers]),
        *(f"  {line}" for line in moved_start_lines(record["moved_starts"])),
        *(f"  note: {remark}" for remark in record["remarks"]),
        *(f"  {each['message']}" for each in record["checks"] if each["passed"] and not reaches_nowhere(each)),
        *left_out_lines(record, MORE),
    ]


def _posture(start: Record) -> str:
    """A start posture by joint."""
    return ", ".join(
        f"{joint} {round(position, 9) + 0.0:.4g}" for joint, position in start.items()
    )  # -1e-12 is rounding
