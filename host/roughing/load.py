# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper plan --load``: basic data entered into a controller at a port."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Console

from host.errors import UserError
from host.link.link import Link
from host.link.port import Port
from host.machines import machine as machines
from host.roughing.basic import BasicData, read_all
from host.run.controller import Controller
from host.words import counted, exact

__all__ = ["lines", "load"]


def lines(data: Sequence[BasicData]) -> Iterator[str]:
    """Yield the lines by which a host enters basic data of one pair, behind its name."""
    yield "$BD" + ",".join(map(exact, data[0].depth_mm))
    yield "$BR" + ",".join(exact(value) for one in data[0].finish_um for value in one)
    for one in data:
        yield f"$BA{exact(one.area_mm2)}"
        for ip, row, *stock in zip(one.ip, one.undersize_um, one.bottom_um, one.side_um,
                                   strict=True):
            # The controller lists no stock where it has none.
            yield f"$BI{exact(ip)}," + ",".join(map(exact, (*row, *(stock if any(stock) else ()))))


def load(electrode: str, workpiece: str, folder: Path, url: str, *, baud: int,
         console: Console) -> None:
    """Enter all basic data of a pair of materials, and put it in force.

    Data of other pairs stay. The controller lists what it holds then.

    Raises
    ------
    UserError
        If there are no such data, nobody answers at the port, the controller is at work, refuses a
        line, or holds other data afterwards.
    """
    data = read_all(electrode, workpiece, folder)
    name = f"$BM{electrode}_{workpiece}".upper()
    wanted, said = [name, *lines(data)], list[str]()
    machine = machines.load("sinker")   # its clock is of no account here
    port = Port(url, baud)
    try:
        with console.status("asking the controller who it is") as status:
            controller = Controller(port, machine, clock_hz=machine.clock_hz, say=console.print)
            controller.identify(reset=False)
            link = Link(controller, said.append)
            link.await_greeting()
            for number, line in enumerate(wanted, 1):
                status.update(f"entering basic data, line {number} of {len(wanted)}")
                link.command(line)
            said.clear()
            link.command("$BL")
    finally:
        port.close()
    held = [text.removeprefix("[MSG:").removesuffix("]") for text in said
            if text.startswith("[MSG:$B")]
    if _of_pair(held, name) != wanted:
        raise UserError(f"the controller at {url} does not hold what was entered: it lists "
                        f"{counted(len(_of_pair(held, name)), 'line')} of {len(wanted)}, or "
                        "others.")
    rows = sum(len(one.ip) for one in data)
    others = [line.removeprefix("$BM") for line in held if line.startswith("$BM") and line != name]
    console.print(f"The controller at {url} holds {counted(rows, 'current')} of "
                  f"{counted(len(data), 'area')}, {electrode} on {workpiece}: $BP plans with them."
                  + (f" It also holds {', '.join(others)}." if others else ""),
                  soft_wrap=True, markup=False)


def _of_pair(held: list[str], name: str) -> list[str]:
    """Those of the listed lines that are of one pair: from its name to the next one's."""
    if name not in held:
        return []
    begin = held.index(name)
    end = next((at for at in range(begin + 1, len(held)) if held[at].startswith("$BM")), None)
    return held[begin:end]
