"""Sentences on a comparison: which variant pays and what it costs, nothing that its figures do not show."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

from cellplan.report.record.common import Record
from cellplan.report.record.numbers import floored, seconds

EQUAL: Final = 0.01  # [-] of a figure: a smaller difference is no cost
COMPARED: Final = "each load, peak, margin and clearance"
COSTS: Final[Mapping[str, tuple[str, float, str, bool]]] = {
    "positioner_load_s": ("load of the positioner", 1.0, " s", True),
    "positioner_phase_load_s": ("load of the positioner in its hardest phase", 1.0, " s", True),
    "operator_load_s": ("load of the operators", 1.0, " s", True),
    "work_velocity_ratio": ("highest joint velocity at work", 100.0, " % of the limit", True),
    "work_acceleration_ratio": ("highest joint acceleration at work", 100.0, " % of the limit", True),
    "min_margin_deg": ("smallest joint margin", 1.0, " deg", False),
    "min_clearance_mm": ("smallest clearance", 1.0, " mm", False),
}  # what it is called, its scale and unit, and whether more of it is worse

LOADS: Final = {
    "the positioner": "positioner_load_s",
    "the positioner in its hardest phase": "positioner_phase_load_s",
    "the operators": "operator_load_s",
    "the operators at work": "operator_work_load_s",
}


def sentences(variants: Sequence[Record]) -> list[str]:
    """What the figures of the variants, entries of ``comparison_record``, say together."""
    passed = sorted(
        (variant for variant in variants if variant["status"] == "passed"),
        key=lambda variant: variant["figures"]["cycle_time_s"],
    )
    return [
        *_payment(passed),
        *(_failure(variant) for variant in variants if variant["status"] != "passed"),
        *_orders([variant for variant in variants if variant["figures"]]),
        *_reservations([variant for variant in variants if variant["figures"]]),
    ]


def _payment(passed: Sequence[Record]) -> Iterator[str]:
    """What the fastest variant brings and costs beside each other one that passes too."""
    if not passed:
        yield "None of them passes every check: there is nothing to choose from."
        return
    best, *others = passed
    if not others:
        yield f"Only {best['name']} passes every check: {_time(best)}."
    for other in others:
        costs, gains = _worse(best, other), _worse(other, best)
        lead = _lead(best, other)
        if lead is None:
            both = f"{best['name']} and {other['name']} take the same time ({_time(best)})"
            worse = ((best["name"], costs), (other["name"], gains))
            drawbacks = [f"Worse in {name}: {'; '.join(its)}" for name, its in worse if its]
            yield f"{both}. {'. '.join(drawbacks)}." if drawbacks else f"{both}, and {COMPARED} is the same."
        elif costs:
            yield f"{lead}. The price: {'; '.join(costs)}."
        else:
            yield f"{lead}, and {COMPARED} is no worse."


def _lead(best: Record, other: Record) -> str | None:
    """How much faster the first one is; None when both take the same time."""
    ratio = other["figures"]["cycle_time_s"] / best["figures"]["cycle_time_s"]
    times = next((text for digits in (2, 3, 4) if (text := f"{ratio:.{digits}g}") != "1"), None)
    if times is None:
        return None
    short, long = best["figures"]["not_in_program"], other["figures"]["not_in_program"]
    both = f"({_time(best)} and {_time(other)})"
    if short:
        return f"{best['name']} is faster than {other['name']} {both}, but its program leaves moves out"
    least = "at least " if long else ""
    return f"{best['name']} is {least}{times} times as fast as {other['name']} {both}"


def _worse(one: Record, other: Record) -> list[str]:
    """Figures in which one variant is worse than another one, with both values."""
    drawbacks = []
    for key, (title, scale, unit, more_is_worse) in COSTS.items():
        value, its = one["figures"][key], other["figures"][key]
        if value is None or its is None:
            continue
        tolerance = EQUAL * max(abs(value), abs(its))
        if (value - its if more_is_worse else its - value) > tolerance:
            show = _three_digits if more_is_worse else floored
            drawbacks.append(f"{title} {show(scale * value)} instead of {show(scale * its)}{unit}")
    return drawbacks


def _failure(variant: Record) -> str:
    """What is wrong with a variant that does not pass."""
    if not variant["figures"]:
        what = {"no_solution": "has no solution", "crashed": "crashed"}.get(variant["status"], "is no valid cell")
        return f"{variant['name']} {what}: {variant['reason']}."
    count, first = variant["figures"]["failed_checks"], next(iter(variant["figures"]["failed"]), variant["reason"])
    return f"{variant['name']} fails {count} check{'' if count == 1 else 's'}, first: {first}."


def _orders(solved: Sequence[Record]) -> Iterator[str]:
    """Who works hardest in which variant, also where a check fails."""
    seen: list[dict[str, float]] = []
    for title, key in LOADS.items():
        loads = {variant["name"]: variant["figures"][key] or 0.0 for variant in solved}
        if len(loads) > 1 and any(loads.values()) and loads not in seen:
            order = sorted(loads, key=lambda name: -loads[name])
            shown = ", ".join(f"{name} {_three_digits(loads[name])} s" for name in order)
            seen.append(loads)
            yield f"Load of {title}, most first: {shown}."


def _reservations(solved: Sequence[Record]) -> Iterator[str]:
    """What the figures leave out or rest on."""
    without = [variant["name"] for variant in solved if variant["figures"]["not_in_program"]]
    if without:
        yield f"Without moves that no program holds, such as those to and from the homes: {', '.join(without)}."
    for variant in solved:
        if variant["status"] == "passed" and variant["figures"]["proof"] not in {"solved", "verified"}:
            yield f"{variant['name']} was not verified again: {variant['figures']['proof']}."


def _time(variant: Record) -> str:
    return f"{seconds(variant['figures']['cycle_time_s'])} s"


_three_digits: Callable[[float], str] = "{:.3g}".format
