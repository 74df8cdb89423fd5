"""An editor that saves a cell file as editors do, and a cheap cell to save."""

from pathlib import Path


def coarse_pair(cells: Path, folder: Path) -> Path:
    """The planar pair with few rows, as a file of a folder."""
    text = (cells / "planar_pair.yaml").read_text(encoding="utf-8")
    path = folder / "pair.yaml"
    path.write_text(text.replace("step_s: 0.001", "step_s: 0.01"), encoding="utf-8")
    return path


class Editor:
    """An editor on a simulated clock: each save empties the file first and then writes it piece by piece."""

    def __init__(self, path: Path) -> None:
        self._path, self._now = path, 0.0
        self._steps: list[tuple[float, str, str]] = []  # time in [s], mode in which the file is opened, text

    def save(self, *pieces: str, pause_s: float) -> None:
        """Save once more after what is still to be saved, with a pause before each piece."""
        at = self._steps[-1][0] if self._steps else self._now
        self._steps.append((at, "w", ""))
        self._steps += [(at + pause_s * count, "a", piece) for count, piece in enumerate(pieces, start=1)]
        self.sleep(0.0)

    def monotonic(self) -> float:
        """Simulated time in [s]."""
        return self._now

    def sleep(self, duration_s: float) -> None:
        """Let time pass, and with it what is saved meanwhile."""
        self._now += duration_s
        while self._steps and self._steps[0][0] <= self._now:
            _, mode, text = self._steps.pop(0)
            with self._path.open(mode, encoding="utf-8") as file:
                file.write(text)
