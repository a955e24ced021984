# SPDX-License-Identifier: Apache-2.0
"""Reference model of the auxiliary functions' handshake."""

from dataclasses import dataclass

# What each step waits for (the level of FIN), and the strobe during it.
STEPS = ((False, False), (True, True), (False, False))


@dataclass
class AuxiliaryFunctions:
    """Outputs are those of the clock after the last call of ``clock``."""

    step: int | None = None  # index into STEPS, None when nothing is under way
    waited: int = 0
    code: int = 0
    letter: int = 0
    timed_out: bool = False

    @property
    def busy(self):
        return self.step is not None

    @property
    def strobe(self):
        return 1 << self.letter if self.busy and STEPS[self.step][1] else 0

    def clock(self, *, send, code, letter, timeout, safe, fin):
        """Take the inputs of one clock."""
        self.timed_out = False
        if safe:
            self.step = None
        elif self.step is None:
            if send and letter < 3:
                self.step, self.waited, self.code, self.letter = 0, 0, code, letter
        elif bool(fin) == STEPS[self.step][0]:
            self.step, self.waited = self.step + 1, 0
            if self.step == len(STEPS):
                self.step = None
        else:
            self.waited += 1
            if self.waited >= timeout:
                self.step, self.timed_out = None, True
