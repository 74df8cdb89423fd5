"""A pen of six joints on a box that lies, as a cell file."""

PEN = """\
cellplan: 1
name: pen-on-box
robots:
  pen:
    model: ur10e
    base: {xyz_mm: [0, 0, 500]}
    pedestal: {cylinder: {radius_mm: 120}}
    tool: {xyz_mm: [0, 0, 150], bodies: [{cylinder: {radius_mm: 8, length_mm: 150}, at: {xyz_mm: [0, 0, 75]}}]}
    start_deg: [10.497256989616, -101.593921554137, -111.772649969359, -56.633428476505, 90, -79.502743010384]
part:
  geometry: {box: {size_mm: [300, 300, 200]}}
  at: {xyz_mm: [800, 0, 600]}
tasks:
  seam:
    robot: pen
    path: {polyline: {plane: xy, points_mm: [[-60, -40], [60, 40]]}, project: +z}
environment:
  floor: {plane: {z_mm: 0}}
motion: {mode: part_at_rest, duration_s: 2, step_s: 0.02, time_law: quintic}
checks: {clearance_mm: 5}
"""
