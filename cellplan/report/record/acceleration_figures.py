"""The key figure of a page about accelerations: the joint that comes nearest to its limit."""

from cellplan.report.record.run import Record

FULL = 1.0  # [-] of a limit


def acceleration_figures(joints: Record) -> list[Record]:
    """The joint that takes the largest share of its limit; nothing where no joint has one."""
    uses = [(robot, name, joint) for robot, named in joints.items() for name, joint in named.items()]
    limited = [use for use in uses if use[2].get("acceleration_ratio") is not None]
    if not limited:
        return []
    robot, name, joint = max(limited, key=lambda use: use[2]["acceleration_ratio"])
    ratio, is_assumed = joint["acceleration_ratio"], joint["acceleration_limit_source"] == "assumed"
    is_bad = ratio > FULL
    return [
        {
            "label": "Highest joint acceleration",
            "value": f"{100.0 * ratio:.4g}" if is_bad else f"{100.0 * ratio:.0f}",
            "unit": f"% of {'assumed' if is_assumed else 'stated'} limit",
            "detail": f"{robot} {name} at {joint['peak_acceleration_at_s']:.3f} s; "
            f"{joint['peak_acceleration']:.1f} of {joint['acceleration_limit']:.1f} {joint['unit']}/s²",
            "is_bad": is_bad,
        }
    ]
