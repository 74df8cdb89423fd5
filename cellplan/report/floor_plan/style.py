"""Style sheet of the floor plan, for light and for dark surroundings, and for print."""

from collections.abc import Sequence
from typing import Final

FONT: Final = 'system-ui,"Segoe UI","Helvetica Neue",Arial,sans-serif'
LIGHT: Final = f"""
svg.plan-sheet {{ font-family: {FONT}; color-scheme: light dark; max-width: 100%; height: auto; }}
.plan-sheet path, .plan-sheet circle {{ stroke-width: 2.5; stroke-linejoin: round; fill: none; }}
.plan-sheet .sheet {{ fill: #fff; }}
.plan-sheet text {{ font-size: 27px; fill: #1d2733; }}
.plan-sheet .title {{ font-size: 48px; font-weight: 700; }}
.plan-sheet .soft {{ font-size: 29px; fill: #55616f; }}
.plan-sheet .head {{ font-weight: 600; fill: #55616f; }}
.plan-sheet .right {{ text-anchor: end; }}
.plan-sheet .name {{ font-weight: 700; font-size: 31px; }}
.plan-sheet .name, .plan-sheet .thing, .plan-sheet .length {{ text-anchor: middle; paint-order: stroke; stroke: #fff; }}
.plan-sheet .name, .plan-sheet .thing, .plan-sheet .length {{ stroke-width: 8px; stroke-linejoin: round; }}
.plan-sheet .thing {{ font-size: 22px; fill: #55616f; }}
.plan-sheet .robots {{ stroke: #55616f; fill: #55616f; fill-opacity: .10; }}
.plan-sheet .base {{ fill-opacity: .42; stroke-width: 4; }}
.plan-sheet .reach {{ stroke: #55616f; stroke-width: 2.5; stroke-dasharray: 16 10; }}
.plan-sheet .swept {{ stroke: #55616f; fill: #55616f; fill-opacity: .13; fill-rule: evenodd; }}
.plan-sheet .swept {{ stroke-width: 2; stroke-opacity: .6; }}
.plan-sheet .whole {{ stroke: #1d2733; stroke-width: 3.5; stroke-dasharray: 3 8; stroke-linecap: round; }}
.plan-sheet .part {{ stroke: #6d5712; stroke-width: 4; fill: #b9a26a; fill-opacity: .55; }}
.plan-sheet .surroundings {{ stroke: #77828e; stroke-width: 3.5; fill: #c3cad2; fill-opacity: .55; }}
.plan-sheet .wall {{ stroke: #77828e; stroke-width: 7; }}
.plan-sheet .path {{ stroke-width: 5; stroke: #55616f; }}
.plan-sheet .dimension, .plan-sheet .cross {{ stroke: #1d2733; }}
.plan-sheet .cross, .plan-sheet .bar, .plan-sheet .axes {{ stroke: #1d2733; stroke-width: 4; }}
.plan-sheet .rule {{ stroke: #b9c1cb; }}
"""
DARK: Final = """
.plan-sheet .sheet { fill: #161b22; }
.plan-sheet text { fill: #e3e8ee; }
.plan-sheet .soft, .plan-sheet .head, .plan-sheet .thing { fill: #9aa5b1; }
.plan-sheet .name, .plan-sheet .thing, .plan-sheet .length { stroke: #161b22; }
.plan-sheet .whole, .plan-sheet .dimension, .plan-sheet .cross, .plan-sheet .bar, .plan-sheet .axes { stroke: #e3e8ee; }
.plan-sheet .part { stroke: #d6c288; }
.plan-sheet .rule { stroke: #4a5563; }
"""


def style(colours: Sequence[str]) -> str:
    """All rules, with the colours of the robots in their order."""
    light, dark = [], []
    for number, colour in enumerate(colours):
        light.append(_of_robot(number, colour))
        dark.append(_of_robot(number, _lighter(colour)))
    return f"{LIGHT}{''.join(light)}@media screen and (prefers-color-scheme: dark) {{{DARK}{''.join(dark)}}}\n"


def _of_robot(number: int, colour: str) -> str:
    """Rules of one robot."""
    stroked = ", ".join(f".plan-sheet .{kind}.r{number}" for kind in ("robots", "swept", "reach", "path"))
    filled = ", ".join(f".plan-sheet .{kind}.r{number}" for kind in ("robots", "swept"))
    return f"{stroked} {{ stroke: {colour}; }}\n{filled}, .plan-sheet .n{number} {{ fill: {colour}; }}\n"


def _lighter(colour: str) -> str:
    """A colour that can be read in dark surroundings."""
    channels = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return "#" + "".join(f"{round(channel + 0.45 * (255 - channel)):02x}" for channel in channels)
