"""Three planar arms that work on one plate with three demanded feeds."""

STRETCHED = 1489.95  # [mm] base of the arm at the top: its ring passes 0.05 mm beside its stretched posture
AWAY = 1459.47  # [mm] likewise: its ring is 30 mm away from that posture, an approach of 60 mm begins beside it

THREE_FEEDS = """\
cellplan: 1
name: three-feeds
robots:
  left:
    model: planar_3r
    tool: {xyz_mm: [0, 0, 60]}
    start_deg: [73.106735922367, -123.555879781621, 50.449143859254]
  right:
    model: planar_3r
    base: {xyz_mm: [1400, 0, 0], rpy_deg: [0, 0, 180]}
    tool: {xyz_mm: [0, 0, 60]}
    start_deg: [-82.022627711826, 116.279474033978, -34.256846322152]
  top:
    model: planar_3r
    base: {xyz_mm: [700, 1489.95, 0], rpy_deg: [0, 0, -90]}
    tool: {xyz_mm: [0, 0, 60], rpy_deg: [0, -90, 0]}
    start_deg: [-11.154266358646, 29.624631143339, -18.470364784723]
part:
  geometry: {box: {size_mm: [400, 400, 10]}}
  at: {xyz_mm: [700, 300, -86]}
tasks:
  bead:
    robot: left
    path: {polyline: {points_mm: [[-100, -130], [-100, -30]], plane: xy}, offset_mm: 6}
    tool_axis: -z
    tool_x: +x
    axes: [x, y, rz]
    start_s: 0.5
    process: {feed_mm_s: 40, on_delay_s: 0.1, off_delay_s: 0.1}
  seam:
    robot: right
    path: {polyline: {points_mm: [[100, -30], [100, -130]], plane: xy}, offset_mm: 6}
    tool_axis: -z
    tool_x: -x
    axes: [x, y, rz]
    start_s: 0.5
    process: {feed_mm_s: 50, on_delay_s: 0.2}
    dwell_s: 0.2
  ring:
    robot: top
    path: {circle: {center_mm: [0, 120], radius_mm: 30, plane: xy}, offset_mm: 6}
    tool_axis: +y
    tool_x: +x
    axes: [x, y, rz]
    start_s: 0.5
    process: {feed_mm_s: 60}
motion: {step_s: 0.01, timing: fastest, jerk_build_up_s: unlimited}
checks: {clearance_mm: 5}
"""


def approached(text: str = THREE_FEEDS) -> str:
    """The cell with the ring away from the stretched posture, and an approach that begins beside it."""
    start = "[2.327619547872, -0.939024360672, -1.38859518718]"
    text = text.replace(f"{STRETCHED:g}", f"{AWAY:g}").replace(
        "[-11.154266358646, 29.624631143339, -18.470364784723]", start
    )
    return text.replace("process: {feed_mm_s: 60}", "process: {feed_mm_s: 60}\n    approach_mm: 60\n    retract_mm: 30")
