"""A small program from home to home: a part is gripped from a table, worked on twice, and put on another table."""

PICK_AND_PLACE = """\
cellplan: 1
name: pick-and-place
robots:
  holder:
    model: kuka_kr16_2
    tool: {xyz_mm: [0, 0, 120], bodies: [{cylinder: {radius_mm: 50, length_mm: 120}, at: {xyz_mm: [0, 0, 60]}}]}
    start_deg: [0, -99.5076, 117.996, 0, -18.4884, 0]
    home_deg: [0, -99.5076, 117.996, 0, -18.4884, 0]
  pen:
    model: ur10e
    base: {xyz_mm: [1300, 950, 500], rpy_deg: [0, 0, -90]}
    pedestal: {cylinder: {radius_mm: 120}}
    tool: {xyz_mm: [0, 0, 150], bodies: [{capsule: {radius_mm: 15, length_mm: 100}, at: {xyz_mm: [0, 0, 70]}}]}
    start_deg: [7.426416495712, -87.410626716807, -118.820825943611, 26.231452660417, 82.573583504285, 90]
    home_deg: [7.426416495712, -80, -118.820825943611, 26.231452660417, 82.573583504285, 90]
part:
  geometry: {box: {size_mm: [300, 300, 200]}}
  held_by: [{robot: holder, at: {xyz_mm: [0, 0, 100], rpy_deg: [180, 0, 0]}}]
tasks:
  seam:
    robot: pen
    path: {polyline: {plane: xz, points_mm: [[-60, -40], [60, -40]]}, project: -y}
  ring:
    robot: pen
    path: {circle: {radius_mm: 30, plane: xz}, project: -y}
environment:
  floor: {plane: {z_mm: 0}}
  table_in: {box: {size_mm: [400, 400, 500]}, at: {xyz_mm: [0, -1000, 250]}}
  table_out: {box: {size_mm: [400, 400, 500]}, at: {xyz_mm: [0, 1000, 250]}}
motion: {mode: simultaneous, duration_s: 3, step_s: 0.02}
program:
  attach: {at: {xyz_mm: [0, -1000, 600]}, rests_on: table_in}
  detach: {at: {xyz_mm: [0, 1000, 600]}, rests_on: table_out}
"""
