"""Toolpaths of CAM: APT/CLDATA and 5-axis G-code as points with tool axes, feeds and rapids."""
