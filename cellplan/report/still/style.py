"""Style sheet of the picture of an instant, for light and for dark surroundings."""

from typing import Final

FONT: Final = 'system-ui,"Segoe UI","Helvetica Neue",Arial,sans-serif'

STYLE: Final = f"""
svg.still {{ font-family: {FONT}; color-scheme: light dark; }}
.still .sheet {{ fill: #f6f8fa; }}
.still path {{ stroke-width: 6; stroke-linejoin: round; }}
.still .e {{ stroke: #101820; stroke-opacity: .45; stroke-width: 9; fill: none; stroke-linecap: round; }}
.still .grid {{ stroke: #c8d0d9; stroke-width: 8; fill: none; }}
.still .shadow {{ fill: #1d2733; fill-opacity: .13; stroke: none; }}
.still .title {{ fill: #1c6b43; font-size: 235px; font-weight: 700; }}
.still .bad .title {{ fill: #a61f1f; }}
.still .note, .still .name, .still .value {{ fill: #1d2733; font-size: 165px; }}
.still .name, .still .value {{ font-weight: 600; paint-order: stroke; stroke: #f6f8fa; stroke-width: 45; }}
.still text {{ stroke-linejoin: round; }}
.still .name {{ text-anchor: middle; }}
.still .value {{ font-size: 200px; font-weight: 700; text-anchor: middle; }}
.still .bad .value {{ fill: #a61f1f; }}
.still .halo {{ stroke: #fff; stroke-width: 62; stroke-linecap: round; fill: none; }}
.still .near {{ stroke: #1d2733; stroke-width: 32; stroke-linecap: round; fill: none; }}
.still .bad .near {{ stroke: #d40f0f; }}
.still .spot {{ fill: #1d2733; stroke: #fff; stroke-width: 16; }}
.still .bad .spot {{ fill: #d40f0f; }}
.still .ring, .still .frame {{ fill: none; stroke: #1d2733; stroke-width: 18; }}
.still .bad .ring {{ stroke: #d40f0f; stroke-width: 30; }}
.still .lead {{ stroke: #55616f; stroke-width: 10; stroke-dasharray: 40 30; fill: none; }}
"""
DARK: Final = """
.still .sheet { fill: #161b22; }
.still .e { stroke: #000; stroke-opacity: .5; }
.still .grid { stroke: #343d49; }
.still .shadow { fill: #000; fill-opacity: .4; }
.still .title { fill: #5fc58f; }
.still .bad .title, .still .bad .value { fill: #ff8a80; }
.still .note, .still .name, .still .value { fill: #e3e8ee; }
.still .name, .still .value { stroke: #161b22; }
.still .near, .still .ring, .still .frame { stroke: #e3e8ee; }
.still .bad .near, .still .bad .ring { stroke: #ff4d42; }
.still .halo { stroke: #161b22; }
.still .spot { fill: #e3e8ee; stroke: #161b22; }
.still .bad .spot { fill: #ff4d42; }
.still .lead { stroke: #9aa5b1; }
"""
