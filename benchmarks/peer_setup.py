"""Install the peers, each into an environment of its own: ``python benchmarks/peer_setup.py``.

What each needs stands as a dependency group in pyproject.toml. They are kept apart because they ask for different
versions of the same libraries, and from `.venv` so that no test ever runs with what a peer brought along. A peer that
cannot be installed is reported in one line and left out.
"""

import os
import subprocess
import sys
import tomllib
import venv
from pathlib import Path
from typing import Final

from engines import PEERS

ROOT: Final = Path(__file__).resolve().parent.parent
HOME: Final = ROOT / ".venv-bench"
STAMP: Final = ".installed"


def python_of(group: str) -> Path:
    """The interpreter that has the libraries of a dependency group; that of this process for cellplan itself."""
    return HOME / group / "bin" / "python" if group else Path(sys.executable)


def is_installed(group: str) -> bool:
    """Whether the libraries of a dependency group are there; cellplan itself is."""
    return not group or (HOME / group / STAMP).is_file()


def requirements(group: str) -> list[str]:
    """What a dependency group asks for."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    needed: list[str] = project["dependency-groups"][group]
    return needed


def install(group: str) -> str:
    """Make the environment of a group unless it is there; what went wrong, or nothing."""
    folder, needed = HOME / group, requirements(group)
    stamp = folder / STAMP
    desired = "\n".join([str(folder), sys.version, *needed])  # a checkout that was moved is installed again
    if stamp.is_file() and stamp.read_text(encoding="utf-8") == desired:
        return ""
    print(f"installing {', '.join(needed)} into {folder.relative_to(ROOT)}", file=sys.stderr)
    venv.create(folder, with_pip=True, clear=True, symlinks=os.name == "posix")
    command = [str(python_of(group)), "-m", "pip", "install", "--quiet", "--only-binary", ":all:", *needed]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return (done.stderr.strip().splitlines() or ["pip failed"])[-1]
    stamp.write_text(desired, encoding="utf-8")
    return ""


def main() -> None:
    """Install all peers."""
    for peer in PEERS:
        problem = install(peer.group)
        print(f"{peer.name}: {f'left out: {problem}' if problem else 'installed'}", file=sys.stderr)


if __name__ == "__main__":
    main()
