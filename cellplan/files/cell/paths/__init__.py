"""Paths from files: tables of points, and toolpaths of CAM (APT/CLDATA, 5-axis G-code) with feeds and rapids."""
