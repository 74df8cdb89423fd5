"""Style sheet of the picture of an instant, for light and for dark surroundings."""

from typing import Final

FONT: Final = 'system-ui,"Segoe UI","Helvetica Neue",Arial,sans-serif'

STYLE: Final = f"""
svg.still-sheet {{ font-family: {FONT}; color-scheme: light dark; }}
.still-sheet .sheet {{ fill: #f6f8fa; }}
.still-sheet path {{ stroke-width: 9; stroke-linejoin: round; }}
.still-sheet .e {{ stroke: #101820; stroke-opacity: .45; stroke-width: 9; fill: none; stroke-linecap: round; }}
.still-sheet .grid {{ stroke: #c8d0d9; stroke-width: 8; fill: none; }}
.still-sheet .shadow {{ fill: #1d2733; fill-opacity: .13; stroke: none; }}
.still-sheet .title {{ fill: #1c6b43; font-size: 205px; font-weight: 700; }}
.still-sheet .bad .title {{ fill: #a61f1f; }}
.still-sheet .note, .still-sheet .name, .still-sheet .value {{ fill: #1d2733; font-size: 165px; }}
.still-sheet .name, .still-sheet .value {{ font-weight: 600; paint-order: stroke; stroke: #f6f8fa; stroke-width: 45; }}
.still-sheet text {{ stroke-linejoin: round; }}
.still-sheet .name {{ text-anchor: middle; }}
.still-sheet .value {{ font-size: 200px; font-weight: 700; text-anchor: middle; }}
.still-sheet .bad .value {{ fill: #a61f1f; }}
.still-sheet .halo {{ stroke: #fff; stroke-width: 62; stroke-linecap: round; fill: none; }}
.still-sheet .near {{ stroke: #1d2733; stroke-width: 32; stroke-linecap: round; fill: none; }}
.still-sheet .bad .near {{ stroke: #d40f0f; }}
.still-sheet .spot {{ fill: #1d2733; stroke: #fff; stroke-width: 16; }}
.still-sheet .bad .spot {{ fill: #d40f0f; }}
.still-sheet .ring, .still-sheet .frame {{ fill: none; stroke: #1d2733; stroke-width: 18; }}
.still-sheet .bad .ring {{ stroke: #d40f0f; stroke-width: 30; }}
.still-sheet .lead {{ stroke: #55616f; stroke-width: 10; stroke-dasharray: 40 30; fill: none; }}
"""
DARK: Final = """
.still-sheet .sheet { fill: #161b22; }
.still-sheet .e { stroke: #000; stroke-opacity: .5; }
.still-sheet .grid { stroke: #343d49; }
.still-sheet .shadow { fill: #000; fill-opacity: .4; }
.still-sheet .title { fill: #5fc58f; }
.still-sheet .bad .title, .still-sheet .bad .value { fill: #ff8a80; }
.still-sheet .note, .still-sheet .name, .still-sheet .value { fill: #e3e8ee; }
.still-sheet .name, .still-sheet .value { stroke: #161b22; }
.still-sheet .near, .still-sheet .ring, .still-sheet .frame { stroke: #e3e8ee; }
.still-sheet .bad .near, .still-sheet .bad .ring { stroke: #ff4d42; }
.still-sheet .halo { stroke: #161b22; }
.still-sheet .spot { fill: #e3e8ee; stroke: #161b22; }
.still-sheet .bad .spot { fill: #ff4d42; }
.still-sheet .lead { stroke: #9aa5b1; }
"""
