"""A planar arm whose joints turn without end: what a continuous joint with ``wrap: true`` gives."""

from pathlib import Path

LINKS = (0.0, 0.5, 0.4, 0.2)  # [m] from each joint to the one before it, then to the flange
NAMES = ("A", "B", "C")


def write_endless_arm(file: Path) -> None:
    """Write the arm of ``planar_3r`` as a URDF with continuous joints, without bodies."""
    links = "".join(f'<link name="{name}"/>' for name in ("base", *NAMES, "flange"))
    parents = ("base", *NAMES[:2])
    joints = "".join(
        f'<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{name}"/>'
        f'<origin xyz="{length} 0 0"/><axis xyz="0 0 1"/><limit velocity="3.14159" effort="1"/></joint>'
        for name, parent, length in zip(NAMES, parents, LINKS[:3], strict=True)
    )
    end = (
        '<joint name="end" type="fixed"><parent link="C"/><child link="flange"/>'
        f'<origin xyz="{LINKS[3]} 0 -0.02" rpy="3.141592653589793 0 0"/></joint>'
    )
    file.write_text(f'<robot name="endless">{links}{joints}{end}</robot>')


def limits(*names: str) -> str:
    """Limits of a cell: some joints turn without end, the others by two turns either way."""
    wide, endless = "{lower_deg: -720, upper_deg: 720}", "{wrap: true}"
    return f"{{{', '.join(f'{name}: {endless if name in names else wide}' for name in NAMES)}}}"
