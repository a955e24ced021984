# SPDX-License-Identifier: Apache-2.0
"""The order of the firmware's functions by which they drive each other out of the cache least.

The processor's instruction cache has one way: two places of the code that are a multiple of its
size apart cannot be in it together. ``python -m testbench.cosim.code_order`` takes the fetches of
short blocks on the simulated machine, anneals the order of the functions that were called, and
writes it into the linker script if a block takes fewer clocks with it.
"""

import argparse
import re
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softcore.image import SOURCES, target_image
from testbench.cosim.short_blocks import fetched, first_pass

__all__ = ["Code", "code_of", "listed", "misses"]

SCRIPT = SOURCES / "hal" / "link.ld"
LIST = re.compile(r"(?<=no harm\. \*/\n)(.*?)(?= +\*\(\.text \.text\.\*)", re.DOTALL)
CACHE, LINE = 4096, 32      # bytes
REACH = 2048                # bytes: a call as far as that is shortened by the linker, to 2 of 4
BLOCKS = 160
CLOCKS_HZ = (2_000_000, 50_000_000)
COLUMNS = 100
# These stay where they are: start, and what saves registers for all others.
FIRST = ("_start", "trap_entry", "image_loader", "image_loader_end", "memcpy", "memset", "__riscv_")
RARE = 100_000              # from this address on there is only code that no block needs

Numbers = NDArray[np.int64]


@dataclass(frozen=True)
class Code:
    """The functions that were called, as if the linker shortened no call.

    ``sizes`` in bytes and ``starts``, their present addresses, by function; the first ``fixed`` of
    them cannot be moved. Of each call that may be short: ``caller``, the offset ``at`` and
    ``target``, -1 for any other function. ``places``: the offset of each fetch, and ``of``: its
    function.
    """

    names: list[str]
    sizes: Numbers
    starts: Numbers
    fixed: int
    caller: Numbers
    at: Numbers
    target: Numbers
    places: Numbers
    of: Numbers

    def addresses(self, order: Sequence[int]) -> tuple[Numbers, NDArray[np.bool_]]:
        """Address of each function, if they follow each other so; and which calls are short.

        ``order`` has the functions that can be moved.
        """
        starts, sizes = self.starts.copy(), self.sizes.copy()
        near = np.zeros(len(self.caller), dtype=bool)
        moved = np.asarray(order)
        for _ in range(3):  # a shorter call brings others nearer
            ends = self.starts[self.fixed] + np.cumsum(sizes[moved])
            starts[moved] = ends - sizes[moved]
            way = starts[self.target] - (starts[self.caller] + self.at - self._before(near))
            near = (self.target >= 0) & (way >= -REACH) & (way < REACH)
            sizes = self.sizes - 2 * np.bincount(self.caller[near], minlength=len(sizes))
        return starts, near

    def _before(self, near: NDArray[np.bool_]) -> Numbers:
        """Bytes that short calls before each call take off in its function."""
        total = np.cumsum(2 * near) - 2 * near
        first: Numbers = total[np.searchsorted(self.caller, self.caller)]
        return total - first

    def fetches(self, order: Sequence[int]) -> Numbers:
        """Address of each fetch."""
        starts, near = self.addresses(order)
        key = self.caller * (1 << 20) + self.at
        taken = np.concatenate([[0], np.cumsum(2 * near)])
        upto = np.searchsorted(key, self.of * (1 << 20) + self.places)
        shift = taken[upto] - taken[np.searchsorted(self.caller, self.of)]
        found: Numbers = starts[self.of] + self.places - shift
        return found


def misses(fetches: Numbers) -> int:
    """How often a fetch finds another line in its place of the cache."""
    lines = fetches // LINE
    lines = lines[np.concatenate([[True], lines[1:] != lines[:-1]])]
    sets = (lines % (CACHE // LINE)).astype(np.uint8)
    sorted_lines = lines[np.argsort(sets, kind="stable")]
    return 1 + int(np.count_nonzero(sorted_lines[1:] != sorted_lines[:-1]))


def _symbols(elf: bytes) -> dict[int, str]:
    """Names of the code's places by address, of an ELF file of 32 bits."""
    table, = struct.unpack_from("<I", elf, 32)
    size, count = struct.unpack_from("<HH", elf, 46)
    sections = [struct.unpack_from("<10I", elf, table + size * one) for one in range(count)]
    symbols = next(section for section in sections if section[1] == 2)
    names = sections[symbols[6]][4]
    code = {one for one, section in enumerate(sections) if section[2] & 4}
    found: dict[int, str] = {}
    for place in range(symbols[4], symbols[4] + symbols[5], 16):
        name, address, _, info, _, section = struct.unpack_from("<3IBBH", elf, place)
        text = elf[names + name:elf.index(b"\0", names + name)].decode()
        if section in code and info & 15 < 3 and text and not text.startswith(("$", ".L")):
            found.setdefault(address, text)
    return found


def _jumps(image: bytes, start: int, end: int) -> Iterable[tuple[int, int, int]]:
    """Place, size and target of each jump in a function that may be a call."""
    at = start
    while at < end:
        half, = struct.unpack_from("<H", image, at)
        if half & 3 < 3:
            if half & 3 == 1 and half >> 13 in (1, 5):
                bits = ((11, 12), (4, 11), (9, 10), (8, 9), (10, 8), (6, 7), (7, 6), (3, 5),
                        (2, 4), (1, 3), (5, 2))
                way = sum((half >> source & 1) << to for to, source in bits)
                yield at, 2, at + way - (way >> 11 << 12)
            at += 2
            continue
        word, = struct.unpack_from("<I", image, at)
        if word & 0x7F == 0x6F and word >> 7 & 31 in (0, 1):
            way = ((word >> 31) << 20 | (word >> 12 & 0xFF) << 12 | (word >> 20 & 1) << 11
                   | (word >> 21 & 0x3FF) << 1)
            yield at, 4, at + way - (way >> 20 << 21)
        at += 4


def code_of(image: Path, fetches: Sequence[int]) -> Code:
    """The functions of an image that these fetches, addresses in their order, have come from.

    Those that the linker script names are among them, called or not, and those before them.
    """
    symbols, content = _symbols(image.with_name("firmware.elf").read_bytes()), image.read_bytes()
    starts = sorted(symbols)
    places = np.asarray(fetches, dtype=np.int64)
    number = np.searchsorted(starts, places, side="right") - 1
    named = set(_named(SCRIPT.read_text(encoding="utf-8")))
    listed_too = {place for place, start in enumerate(starts)
                  if symbols[start] in named or symbols[start].startswith(FIRST)}
    called = [one for one in sorted({*map(int, number)} | listed_too)
              if starts[one] < RARE and symbols[starts[one]] not in FIRST[:2]]
    index = {one: place for place, one in enumerate(called)}
    target_of = {starts[one]: place for one, place in index.items()}
    rows, short = [], {}
    for one in called:
        start, end, shift = starts[one], starts[one + 1], 0
        for at, size, target in _jumps(content, start, end):
            if not start <= target < end:
                rows.append((index[one], at - start + shift, target_of.get(target, -1)))
                shift += 2 * (size == 2)
                if size == 2:
                    short.setdefault(one, []).append(at - start)
    rows.sort()
    caller, at, target = np.array(rows, dtype=np.int64).T
    here = np.isin(number, called)
    number, places = number[here], places[here]
    offsets = places - np.asarray(starts)[number]
    far = [offset + 2 * int(np.searchsorted(short.get(int(one), []), offset))
           for one, offset in zip(number, offsets, strict=True)]
    return Code(
        [symbols[starts[one]] for one in called],
        np.array([starts[one + 1] - starts[one] + 2 * len(short.get(one, [])) for one in called]),
        np.array([starts[one] for one in called]),
        sum(symbols[starts[one]].startswith(FIRST) for one in called), caller, at, target,
        np.array(far, dtype=np.int64), np.array([index[int(one)] for one in number]))


def anneal(code: Code, rng: np.random.Generator, tries: int, heat: float) -> list[int]:
    """An order with few misses, beginning with the present one."""
    now = best = list(range(code.fixed, len(code.names)))
    cost = least = misses(code.fetches(now))
    first = heat * cost
    for number in range(tries):
        new = now.copy()
        length = int(rng.integers(1, 5))
        start = int(rng.integers(len(new) - length + 1))
        part = new[start:start + length]
        del new[start:start + length]
        to = int(rng.integers(len(new) + 1))
        new[to:to] = part
        found = misses(code.fetches(new))
        warm = first * 0.003**(number / tries)
        if found <= cost or rng.random() < np.exp((cost - found) / warm):
            now, cost = new, found
        if cost < least:
            best, least = now, cost
    return best


def _named(script: str) -> list[str]:
    """Functions that a linker script names."""
    found = LIST.search(script)
    assert found is not None, f"{SCRIPT} has no list of functions"
    return re.findall(r"\*\(\.text\.([^)]+)\)", found[0])


def listed(names: Iterable[str]) -> str:
    """Lines of the linker script that name these functions."""
    lines, line = [], "   "
    for name in names:
        part = f" *(.text.{name})"
        if len(line) + len(part) > COLUMNS:
            lines.append(line)
            line = "   "
        line += part
    return "\n".join([*lines, line]) + "\n"


def _clocks() -> list[float]:
    return [first_pass(BLOCKS, clock_hz).clocks for clock_hz in CLOCKS_HZ]


def main() -> None:
    """Look for an order of the firmware's functions in which a short block takes fewer clocks."""
    parser = argparse.ArgumentParser(prog="python -m testbench.cosim.code_order",
                                     description=main.__doc__)
    parser.add_argument("--rounds", type=int, default=6, help="orders that are tried")
    parser.add_argument("--tries", type=int, default=12_000, help="steps of the annealing for each")
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    rng = np.random.default_rng(chosen.seed)
    best, clocks = SCRIPT.read_text(encoding="utf-8"), _clocks()
    print("a block takes", *map(round, clocks), "clocks at", *CLOCKS_HZ, "Hz", flush=True)
    for number in range(chosen.rounds):
        try:
            fetches = [*fetched(4), *fetched(1, circle=True)]
            code = code_of(target_image(), fetches)
            order = anneal(code, rng, chosen.tries, (0.006, 0.003, 0.001)[number % 3])
            text = listed(code.names[one] for one in order)
            SCRIPT.write_text(LIST.sub(lambda _, text=text: text, best), encoding="utf-8")
            now = _clocks()
            better = max(now) < max(clocks)
            print("tried:", *map(round, now), "better" if better else "", flush=True)
            if better:
                best, clocks = SCRIPT.read_text(encoding="utf-8"), now
        finally:
            SCRIPT.write_text(best, encoding="utf-8")


if __name__ == "__main__":
    main()
