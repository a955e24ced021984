# SPDX-License-Identifier: Apache-2.0
"""Scenario: an emergency stop while a tape cuts; then it goes on at the pulse where it was left.

``python -m testbench.cosim.stopped_cut`` tells what jobs with such a stop have left.
"""

import argparse
import random
import re
from collections.abc import Iterable, Iterator

from host.link.link import RESUME
from testbench.cosim.job import MM
from testbench.cosim.power_loss import (
    CAVITY,
    SLOT,
    Result,
    Shop,
    Work,
    interruptions,
    listed,
    whole,
)

__all__ = ["stops"]

PRESSED_S = 0.3
BESIDE = MM // 10   # pulses
PLACE = re.compile(r"block (\d+) (begins|was left) at X(\S+) Y(\S+) Z(\S+):")


def stops(work: Work, seed: int,
          clocks: Iterable[int]) -> Iterator[tuple[int, int | None, Result]]:
    """Press the emergency stop so many clocks after the start of the tape, for each number.

    Yield the clocks, the block whose rest was carried out afterwards, 0 if a block began anew or
    the tape had ended, and the result.
    """
    return interruptions(work, seed, clocks, _gone_on)


def counts(shop: Shop, field: str) -> list[int]:
    """A place of the status report in pulses."""
    return [round(float(one) * MM) for one in shop.link.status()[field].split(",")]


def _gone_on(shop: Shop, begun: int) -> tuple[int | None, Result]:
    session = shop.session
    session.set("force.estop", 1)
    shop.run(PRESSED_S)
    ended = bool(shop.told("program_end"))
    assert ended or shop.told("alarm")
    session.set("force.estop", 0)
    shop.run(0.05)
    sparks = session.get("read.sparks")
    shop.link.command("$X")
    session.press_arm()
    shop.run(0.05)
    if ended:
        shop.until("program_end")
        return 0, Result(shop.work.measure(session), (), session.cycle - begun)
    interrupted, stands = shop.blocks()[-1:], counts(shop, "MPos")
    shop.events.clear()
    shop.link.command("$FROM=last")
    shop.start()
    shop.until("pause")
    assert session.get("read.sparks") == sparks, "nothing burns before the operator's word"
    says = next(filter(None, map(PLACE.search, reversed(shop.said))))
    block = int(says[1])
    assert [block] == interrupted
    rest = says[2] == "was left"
    place = [round(float(one) * MM) + zero
             for one, zero in zip(says.groups()[2:], counts(shop, "WCO"), strict=True)]
    # When the drives go off, the axes stop a little beside their command.
    away = max(abs(one - other) for one, other in zip(place, stands, strict=True))
    assert not rest or away <= BESIDE, (place, stands)
    shop.link.press(RESUME)
    result = shop.result(begun)
    assert shop.blocks() == list(range(block, shop.work.blocks[-1] + 1)), "none is skipped"
    return block if rest else 0, result


def main() -> None:
    """Print a line for each job without a stop, and for each with one: what it has left, in um."""
    parser = argparse.ArgumentParser(prog="python -m testbench.cosim.stopped_cut",
                                     description=main.__doc__)
    parser.add_argument("--work", choices=[work.name for work in (CAVITY, SLOT)],
                        default=CAVITY.name, help="a cavity on the sinker, a slot by the wire")
    parser.add_argument("--stops", type=int, default=20, help="stops in random clocks of one job")
    parser.add_argument("--seed", type=int, default=20261129, help="of the clocks")
    chosen = parser.parse_args()
    work = next(work for work in (CAVITY, SLOT) if work.name == chosen.work)
    result = whole(work, 1)
    print(f"no stop: {listed(result.left_um)}", flush=True)
    rng = random.Random(chosen.seed)
    wanted = [rng.randrange(result.clocks) for _ in range(chosen.stops)]
    for at, block, result in stops(work, rng.randrange(1 << 32), wanted):
        says = f"in block {block}, whose rest followed" if block else "no rest of a block"
        print(f"stop after {at} clocks, {says}: {listed(result.left_um)}", flush=True)


if __name__ == "__main__":
    main()
