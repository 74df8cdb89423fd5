"""The shortest cycles of a cell as text."""

from collections.abc import Iterator
from typing import Final

from cellplan.report.record.common import Record

TITLES: Final = {
    "as_written": "as written",
    "time_laws": "by its time laws",
    "common_speed": "by the best common speed",
    "reduced_speed": "with no tool faster than 250 mm/s",
}
FIGURES: Final = {
    "max_velocity_ratio": "joint velocity",
    "max_acceleration_ratio": "joint acceleration",
    "max_tool_speed_mm_s": "tool speed",
    "energy_proxy_s": "energy proxy",
}  # what a demand saves, by figure
KINDS: Final = ("velocity", "acceleration")
BINDS: Final = 90.0  # [%] of the time: a limit that asks for less does not bind
HEADINGS: Final = ("cycle s", "parts/h", "velocity %", "acceleration %", "tool mm/s", "energy proxy s", "margin deg")


def fastest_lines(record: Record) -> list[str]:
    """All lines about the shortest cycles.

    Args:
        record: As ``fastest_record`` returns it.
    """
    lines = [f"{record['cell']}: {record['status']}", f"  as written: {record['written_s']:g} s"]
    for name, program in record["cycles"].items():
        lines += _program_lines(TITLES[name], program)
    if record["remark"]:
        lines.append(f"  {TITLES['reduced_speed']}: no program: {record['remark']}")
    if record["demand"]:
        lines += _demand_lines(record["demand"])
    return [*lines, *_curve_lines(record)]


def saving_text(record: Record) -> str:
    """What a demand saves or costs, by figure, such as ``joint velocity 50 % less``."""
    parts = []
    for name, title in FIGURES.items():
        if record[name] is not None:
            parts.append(f"{title} {abs(100.0 * record[name]):.3g} % {'less' if record[name] >= 0.0 else 'more'}")
    return ", ".join(parts)


def binding_lines(program: Record) -> list[str]:
    """What binds each phase of a program, or how near its joints come to their limits where nothing does."""
    binding, figures = program["binding"], program["figures"]
    if max(each["time_percent"] for each in binding) >= BINDS:
        return [each["text"] if len(binding) == 1 else f"phase {each['phase']}: {each['text']}" for each in binding]
    shares = ((figures[f"max_{kind}_ratio"], figures[f"max_{kind}_joint"], kind) for kind in KINDS)
    reached = [f"{100.0 * share:.3g} % of a limit of {kind} ({joint})" for share, joint, kind in shares if share]
    return [f"nothing binds: joints reach {', '.join(reached)}"]


def _program_lines(title: str, program: Record) -> Iterator[str]:
    """One program: its cycle, what binds, speeds, errors, clearance and failed checks."""
    yield f"  {title}: {program['cycle_s']:g} s, {100.0 * program['share_of_written']:.3g} % of the written time"
    yield from (f"    {line}" for line in binding_lines(program))
    figures, clearance = program["figures"], program["smallest_clearance_mm"]
    distance = "nothing to keep clear of" if clearance is None else f"smallest clearance {clearance:.4g} mm"
    yield (
        f"    largest tool error {program['largest_position_error_mm']:.2g} mm, "
        f"{program['largest_orientation_error_deg']:.2g} deg; {distance}"
    )
    above = figures["share_above_250_mm_s"]
    share = f"for {100.0 * above:.3g} % of the time ({figures['share_above_250_robot']})" if above else "never"
    yield (
        f"    tools up to {figures['max_tool_speed_mm_s']:.4g} mm/s ({figures['max_tool_speed_robot']}), "
        f"above 250 mm/s {share}; "
        f"axes up to {figures['max_axis_speed_mm_s']:.4g} mm/s ({figures['max_axis_speed_joint']})"
    )
    for message in program["failed"]:
        yield f"    FAILED {message}"


def _demand_lines(demand: Record) -> Iterator[str]:
    """The calmest program that meets the demand."""
    program = demand["program"]
    yield f"  demand {demand['parts_per_h']:g}/h, a part in {demand['allowed_cycle_s']:g} s at most; calmest program:"
    yield from (f"  {line}" for line in _program_lines(TITLES[program["law"]], program))
    if demand["idle_s"]:
        yield (
            f"    the robots wait for {demand['idle_s']:g} s of each cycle: a longer motion would save next to nothing"
        )
    options = " ".join(f"--set '{each}'" for each in program["options"])
    yield f"    gives it: cellplan solve {options}"
    yield f"    against the shortest cycle: {saving_text(demand['saving_against_shortest'])}"
    yield f"    against the program as written: {saving_text(demand['saving_against_written'])}"


def _curve_lines(record: Record) -> Iterator[str]:
    """The production curve as a table for each law."""
    rows = [(TITLES[point["law"]], point) for point in record["curve"]]
    if len(rows) <= len({title for title, _ in rows}):
        return
    for law in dict.fromkeys(title for title, _ in rows):
        yield f"  production curve {law}"
        table = [HEADINGS, *(_cells(point["figures"]) for title, point in rows if title == law and point["figures"])]
        widths = [max(len(row[column]) for row in table) for column in range(len(HEADINGS))]
        for row in table:
            yield "    " + "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))
        yield from (f"    {point['reason']}" for title, point in rows if title == law and point["reason"])


def _cells(figures: Record) -> tuple[str, ...]:
    """One cycle of the curve."""
    return (
        f"{figures['cycle_time_s']:g}",
        f"{figures['parts_per_h']:.1f}",
        *(
            "-" if value is None else f"{scale * value:{form}}"
            for value, scale, form in (
                (figures["max_velocity_ratio"], 100.0, ".1f"),
                (figures["max_acceleration_ratio"], 100.0, ".1f"),
                (figures["max_tool_speed_mm_s"], 1.0, ".0f"),
                (figures["energy_proxy_s"], 1.0, ".3g"),
                (figures["min_margin_deg"], 1.0, ".2f"),
            )
        ),
    )
