# SPDX-License-Identifier: Apache-2.0
"""Changed bits anywhere: their outcomes, by the part of the controller in which they are."""

import random
import re
from collections import Counter
from dataclasses import dataclass

from testbench.cosim.job import Job
from testbench.faults.outcome import MISPLACED, Found, Outcome
from testbench.faults.trials import Trial, run_trials
from testbench.native.symbols import firmware_symbols

__all__ = ["BORNE", "GUARDED", "SHARE", "Flips", "bend_code", "bend_memory", "measure", "turn_over"]

BORNE = (Outcome.NO_EFFECT, Outcome.SAFE_TOLD, Outcome.SAFE_UNTOLD)
# Of the registers, and of the memory: that may end at another place than they tell, each listed.
SHARE = 0.005
PROCESSOR, MEMORY = "soc.cpu.", "memory, "
# Names of registers whose bits the gateware guards, in a register that flips.
GUARDED = re.compile(r"^soc\.(controller\.(drives\.axis_.\.(error_counter\.|backlash\.parity)"
                     r"|motion\.(conservation\.|path\.(\w+_again|offset|segment_parity) )"
                     r"|interlock\.double)|registers\.\w+_parity)")
STACK = 1024        # bytes of the stack that are in use
# The main loop: functions that are called at one place only are inside of these, and which of them
# stand alone is the compiler's choice. All together do not fit into the processor's cache.
LOOP = ("main", "step", "watch_over")


def turn_over(job: Job, rng: random.Random) -> str:
    """Invert any bit of any register, the processor's included; return its name."""
    state = job.session.state()
    inside = [index for index, (name, _) in enumerate(state) if name.startswith("soc.")]
    weights = [state[index][1] for index in inside]
    index, = rng.choices(inside, weights)
    name, bits = state[index]
    bit = rng.randrange(bits)
    job.session.turn_over(index, bit)
    return f"{name} bit {bit}"


def bend_memory(job: Job, rng: random.Random) -> str:
    """Invert any bit of the memory, in code, data or stack; return its place."""
    symbols = firmware_symbols()
    end, top = symbols["__bss_end"][0], symbols["__stack_top"][0]
    begin = symbols["__image_end"][0]
    kind, words = rng.choice((("code", range(0, begin & -4, 4)),
                              ("data", range(begin & -4, end & -4, 4)),
                              ("stack", range(top - STACK, top, 4))))
    address, bit = rng.choice(words), rng.randrange(33)
    job.session.flip(address, bit)
    return f"{MEMORY}{kind} 0x{address:05x} bit {bit}"


def bend_code(job: Job, rng: random.Random) -> str:
    """Invert a bit in every word of the main loop: the word that is read first shows it."""
    bit = rng.randrange(33)
    symbols = firmware_symbols()
    for begin, extent in (symbols[name] for name in LOOP if name in symbols):
        for address in range(begin + 3 & -4, begin + extent & -4, 4):
            job.session.flip(address, bit)
    job.session.send(b"?")
    return f"bit {bit}"


@dataclass(frozen=True)
class Flips:
    """Outcomes of changed bits, by the part in which they are."""

    found: tuple[Found, ...]

    @property
    def parts(self) -> dict[str, Counter]:
        """Outcomes by part."""
        parts = {}
        for one in self.found:
            part = ("processor" if one.why.startswith(PROCESSOR) else
                    "memory" if one.why.startswith(MEMORY) else "gateware")
            parts.setdefault(part, Counter())[one.outcome] += 1
        return dict(sorted(parts.items()))

    @property
    def wrong(self) -> list[str]:
        """Each that ended wrong."""
        return [one.why for one in self.found if one.outcome is Outcome.WRONG]

    @property
    def good(self) -> bool:
        """Whether none runs away, burns on or lies, and few end at another place than they tell.

        None of the guarded registers may; and a bit of the memory that stops the machine is told.
        """
        memory = self.parts.get("memory", Counter())
        registers = sum((counts for part, counts in self.parts.items() if part != "memory"),
                        Counter())
        return (all(MISPLACED in why and not GUARDED.match(why) for why in self.wrong)
                and all(counts[Outcome.WRONG] <= SHARE * counts.total()
                        for counts in (memory, registers))
                and not memory[Outcome.SAFE_UNTOLD])


def measure(count: int, seed: int) -> Flips:
    """Invert ``count`` bits of registers and as many of the memory, each in its own cut.

    After every other one a short comes: only that shows the effect of a bit on the retraction.

    Raises
    ------
    testbench.native.branch.BranchError
        If a trial cannot be run.
    """
    tried = run_trials([
        Trial(name, act, None, BORNE, count=(count + (not short)) // 2, short=short)
        for name, act in (("registers", turn_over), ("memory", bend_memory))
        for short in (False, True)], seed)
    return Flips(tuple(one for _, found in tried for one in found))
