"""Accelerations on the screen: the joint that comes nearest to its limit, tool and part, and what was not judged."""

from collections.abc import Iterator
from typing import Any

Record = dict[str, Any]


def acceleration_lines(record: Record) -> Iterator[str]:
    """Lines about the accelerations of a run; none for a record without them."""
    found = record.get("accelerations")
    if found is None:
        return
    yield from _joint_lines(record["joints"])
    yield from _world_lines(found)
    yield from _not_judged_lines(found["not_judged"])


def _joint_lines(joints: Record) -> Iterator[str]:
    """The joint that takes the largest share of its limit; the fastest of all where no joint has one."""
    uses = [(robot, name, use) for robot, named in joints.items() for name, use in named.items()]
    limited = [use for use in uses if use[2].get("acceleration_ratio") is not None]
    if limited:
        robot, name, use = max(limited, key=lambda it: it[2]["acceleration_ratio"])
        share = 100.0 * use["acceleration_ratio"]
        source = "assumed" if use["acceleration_limit_source"] == "assumed" else "stated"
        yield (
            f"  largest joint acceleration {share:.4g} % of its {source} limit: {robot} {name}"
            f" at {use['peak_acceleration_at_s']:.3f} s"
        )


def _world_lines(found: Record) -> Iterator[str]:
    """Tool and part in the world."""
    words = []
    if found["tools"]:
        robot, tool = max(found["tools"].items(), key=lambda it: it[1]["peak_acceleration_m_s2"])
        words.append(f"of a tool tip {_figure(tool)} ({robot})")
    if found["part"] is not None:
        words.append(f"of the part {_figure(found['part']['corner'])}")
    if words:
        yield f"  largest acceleration {', '.join(words)}"


def _not_judged_lines(entries: list[Record]) -> Iterator[str]:
    """One line for each kind of thing that was left out, with its robots and the reason."""
    robots: dict[tuple[str, str], list[str]] = {}
    for left in entries:
        robots.setdefault((left["what"], left["reason"]), []).extend([left["robot"]] if left["robot"] else [])
    for (what, reason), names in robots.items():
        of = f" of {', '.join(names)}" if names else ""
        yield f"  not judged: {what}{of} ({reason})"


def _figure(point: Record) -> str:
    return f"{point['peak_acceleration_m_s2']:.3g} m/s2 at {point['peak_acceleration_at_s']:.3f} s"
