"""What ties the numbers of a layout together: equal and mirrored ones, those that stay, and what a change costs."""

from collections.abc import Sequence

from cellplan.files.cell.layout.layout_addresses import Address, AddressError, read_address
from cellplan.files.cell.layout.layout_ranges import Context
from cellplan.files.input.findings import Finding, KeyPath, listed, shown
from cellplan.model.cell.layout import Mirrored, VaryRange, mirror_image
from cellplan.model.settings.layout import LayoutEntry, MirroredEntry


class Ties:
    """The entries of a layout beside ``vary``, read against its ranges; what is wrong goes to the findings."""

    def __init__(
        self, entry: LayoutEntry, ranges: dict[str, VaryRange], context: Context, findings: list[Finding]
    ) -> None:
        """Keep what is read, and against what; ranges, by address, of numbers that stay are taken out."""
        self._entry, self._ranges, self._context, self._findings = entry, ranges, context, findings
        self._tied = set[str]()

    def fixed(self) -> frozenset[str]:
        """Addresses of all that stays as it is."""
        stay = set[str]()
        for index, key in enumerate(self._entry.fixed):
            address = self._address(key, ("layout", "fixed", index))
            if address is not None:
                stay |= {*address.numbers, address.group}
        for number in stay & set(self._ranges):
            del self._ranges[number]
        return frozenset(stay)

    def equal(self) -> tuple[tuple[str, ...], ...]:
        """Addresses of numbers that have one value."""
        lists = []
        for row, keys in enumerate(self._entry.equal):
            path: KeyPath = ("layout", "equal", row)
            if len(keys) < 2:
                self._refuse(path, f"expected at least two addresses, got {len(keys)}")
            variables = [self._varied(key, (*path, place)) for place, key in enumerate(keys)]
            members = [variable for variable in variables if variable is not None]
            self._tie(members, path)
            self._overlap(members[:1], members[1:], path)
            lists.append(tuple(member.address for member in members))
        return tuple(lists)

    def mirrored(self) -> tuple[Mirrored, ...]:
        """Pairs of bases of which the second is the mirror image of the first."""
        pairs = []
        for row, entry in enumerate(self._entry.mirrored):
            path: KeyPath = ("layout", "mirrored", row, "bases")
            addresses = [self._address(key, (*path, place)) for place, key in enumerate(entry.bases)]
            bases = [address for address in addresses if address is not None]
            if len(bases) < 2:
                continue
            if any(base.what != "base" or base.index is not None for base in bases):
                self._refuse(path, f"expected two addresses ROBOT.base, got {' and '.join(entry.bases)}")
            elif self._are_alike(bases, path):
                pairs.append(self._pair(entry, bases, path))
        return tuple(pairs)

    def _are_alike(self, bases: Sequence[Address], path: KeyPath) -> bool:
        """Whether the same components of both bases may change."""
        keys = [[key for key, at in zip(base.keys, base.numbers, strict=True) if at in self._ranges] for base in bases]
        if keys[0] != keys[1] or not keys[0]:
            both = f"got {listed(keys[0])} of the first and {listed(keys[1])} of the second"
            self._refuse(path, f"expected ranges of the same components of both under layout.vary, {both}")
        return keys[0] == keys[1]

    def _pair(self, entry: MirroredEntry, bases: Sequence[Address], path: KeyPath) -> Mirrored:
        """One pair, its ranges compared."""
        pair = Mirrored(robots=(bases[0].name, bases[1].name), axis=int(entry.plane == "xz"), at=entry.at_mm.si)
        first, second = ([self._ranges[at] for at in base.numbers if at in self._ranges] for base in bases)
        self._tie(second, path)
        for one, other in zip(first, second, strict=True):
            sign, shift = mirror_image(pair, one.index)
            ends = sorted((sign * one.lower + shift, sign * one.upper + shift))
            if one.index < 3 and not max(ends[0], other.lower) < min(ends[1], other.upper):
                self._refuse(path, f"expected ranges that overlap when mirrored, got none of {other.address}")
        return pair

    def cost(self) -> dict[str, float]:
        """Costs of changes by the address of the number; those of single numbers count before those of groups."""
        costs = dict[str, float]()
        read = [(self._address(key, ("layout", "cost", key)), cost) for key, cost in self._entry.cost.items()]
        for is_single in (False, True):
            for address, cost in read:
                if address is not None and (address.index is not None) == is_single:
                    costs |= dict.fromkeys(address.numbers, cost)
        return costs

    def _tie(self, members: Sequence[VaryRange], path: KeyPath) -> None:
        """Each number follows at most one other."""
        for member in members:
            if member.address in self._tied:
                self._refuse(path, f"expected each variable in one list or pair, got '{member.address}' in two")
            self._tied.add(member.address)

    def _overlap(self, first: Sequence[VaryRange], others: Sequence[VaryRange], path: KeyPath) -> None:
        """Equal numbers have one unit, and ranges with common values."""
        for one in first:
            for other in others:
                if one.is_angle != other.is_angle or (one.kind == "weight") != (other.kind == "weight"):
                    self._refuse(path, f"expected variables of one unit, got {one.address} and {other.address}")
            lower, upper = max(it.lower for it in (one, *others)), min(it.upper for it in (one, *others))
            if not lower < upper:
                self._refuse(path, "expected ranges with common values, got none")

    def _varied(self, key: str, path: KeyPath) -> VaryRange | None:
        """The range of one number that may change."""
        address = self._address(key, path)
        if address is None:
            return None
        if len(address.numbers) != 1:
            self._refuse(path, f"expected the address of one number, such as {_example(address)}, got {shown(key)}")
            return None
        range_ = self._ranges.get(address.numbers[0])
        if range_ is None:
            self._refuse(path, f"expected a variable with a range under layout.vary, got {shown(key)}, which stays")
        return range_

    def _address(self, key: str, path: KeyPath) -> Address | None:
        try:
            return read_address(key, self._context.valid, self._context.models)
        except AddressError as error:
            self._refuse(path, str(error), is_key=isinstance(path[-1], str))
            return None

    def _refuse(self, path: KeyPath, text: str, *, is_key: bool = False) -> None:
        """Note what is wrong."""
        document = self._context.document
        self._findings.append(document.key_finding(path, text) if is_key else document.finding(path, text))


def _example(address: Address) -> str:
    """One number of what an address names."""
    return f"{address.group}{address.parts[0]}" if address.parts else "kuka.base.x_mm"
