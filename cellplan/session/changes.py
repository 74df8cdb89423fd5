"""Values of a cell file that were changed, and the steps that undo and redo them."""

from collections.abc import Iterable, Mapping

from cellplan.errors import InputError
from cellplan.files.cell.changes import plain_values
from cellplan.files.cell.load import CellFile
from cellplan.jobs.repair.neat import written_at
from cellplan.model.cell.cell import Cell

Step = Mapping[str, tuple[object, object]]  # values before and after a step, by address; None for a key left out


class Changes:
    """Values by address that differ from those of a cell, as ``Cell.with_values`` takes them."""

    def __init__(self, base: Cell) -> None:
        """Begin without a change of a cell."""
        self.values: dict[str, object] = {}
        self._base, self._done, self._undone = base, list[Step](), list[Step]()
        self._is_open = False  # whether a change of the same values still belongs to the last step

    @property
    def can_undo(self) -> bool:
        """Whether there is a step to undo."""
        return bool(self._done)

    @property
    def can_redo(self) -> bool:
        """Whether there is a step to do again."""
        return bool(self._undone)

    def value(self, address: str) -> object:
        """The present value at an address; None where the file leaves the key out."""
        if any(_is_below(address, other) or _is_below(other, address) for other in self.values):
            return _value(self._base.with_values(self.values), address)
        return self.values[address] if address in self.values else _value(self._base, address)

    def set(self, values: Mapping[str, object]) -> None:
        """Set values, as a step; further ones at the same addresses belong to it until it is complete."""
        new = plain_values(values)
        if self._is_open and self._done and [*self._done[-1]] == [*new]:
            step = {address: (old, new[address]) for address, (old, _) in self._done.pop().items()}
        else:
            step = {address: (self.value(address), value) for address, value in new.items()}
        self._put(new)
        self._done.append(step)
        self._undone.clear()
        self._is_open = True

    def add(self, values: Mapping[str, object]) -> None:
        """Set values that follow from the last step, as a part of it; nothing where there is none."""
        new = {address: value for address, value in plain_values(values).items() if value != self.value(address)}
        if new and self._done:
            step = self._done[-1]
            olds = {address: step[address][0] if address in step else self.value(address) for address in new}
            self._done[-1] = {**step, **{address: (olds[address], value) for address, value in new.items()}}
            self._put(new)

    def complete(self) -> None:
        """Complete the last step, such as a drag: what follows is another one."""
        self._is_open = False

    def undo(self) -> None:
        """Undo the last step; nothing where there is none."""
        self._is_open = False
        if self._done:
            self._undone.append(self._done.pop())
            self._put({address: old for address, (old, _) in self._undone[-1].items()})

    def redo(self) -> None:
        """Do the step again that was undone last; nothing where there is none."""
        self._is_open = False
        if self._undone:
            self._done.append(self._undone.pop())
            self._put({address: new for address, (_, new) in self._done[-1].items()})

    def reset(self) -> None:
        """Set all values to those of the cell, as a step."""
        if self.values:
            self.complete()
            self.move_to(self._base, is_taken=True)

    def move_to(self, base: Cell, *, is_taken: bool = False) -> None:
        """Change another cell from now on: steps at addresses that it does not have are dropped.

        Args:
            is_taken: Whether its values take the place of those that were changed, as a step.
        """
        mine = {address: value for address, value in self.values.items() if _has(base, address, value)}
        self._base, self.values = base, {}
        self._done, self._undone = (_usable(base, steps) for steps in (self._done, self._undone))
        if is_taken and mine:
            self._done.append({address: (value, self.value(address)) for address, value in mine.items()})
            self._undone.clear()
        elif not is_taken:
            self._put(mine)

    def _put(self, values: Mapping[str, object]) -> None:
        """Take over values; those of the cell itself are no change."""
        for address, value in values.items():
            whole, _, index = address.removesuffix("]").rpartition("[")
            listed = self.values.get(whole)
            if isinstance(listed, list) and index.isdecimal() and int(index) < len(listed):
                self._put({whole: [value if place == int(index) else it for place, it in enumerate(listed)]})
                continue
            self.values = {it: old for it, old in self.values.items() if it != address and not _is_below(it, address)}
            if value != self.value(address):
                self.values[address] = value


def differ(values: Mapping[str, object], cell: Cell) -> bool:
    """Whether a cell has other values than some by address."""
    return any(_value(cell, address) != value for address, value in values.items())


def _value(cell: Cell, address: str) -> object:
    """The value that the file of a cell has at an address, defaults filled in."""
    return plain_values({address: written_at(cell.origin.document, address)})[address]


def _is_below(address: str, above: str) -> bool:
    """Whether an address leads to a part of what another one leads to."""
    return address.startswith((f"{above}.", f"{above}["))


def _usable(cell: Cell, steps: Iterable[Step]) -> list[Step]:
    """The steps whose addresses a cell has."""
    return [step for step in steps if all(_has(cell, address, new) for address, (_, new) in step.items())]


def _has(cell: Cell, address: str, value: object) -> bool:
    """Whether a value can stand at an address of the file of a cell."""
    source = cell.origin.source
    try:
        return isinstance(source, CellFile) and bool(source.document_with({address: value}).root)
    except InputError:
        return False
