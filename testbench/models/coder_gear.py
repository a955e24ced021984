# SPDX-License-Identifier: Apache-2.0
"""Reference model of a coarse coder's gear: the pulses that a count of edges makes."""

from dataclasses import dataclass

ROOM = 1 << 20      # bound of E m + n // 2 - P n, in either direction


def pulses_of(edges: int, n: int, m: int) -> int:
    """Pulses of a sum of edges: m/n of it, to the nearest, half a pulse upwards."""
    return (edges * m + n // 2) // n


@dataclass
class CoderGear:
    """Edges taken and pulses made."""

    n: int = 1
    m: int = 1
    edges: int = 0      # since the beginning
    made: int = 0       # pulses, with the one of the clock to come
    pulse: int = 0      # of the clock to come: -1, 0 or +1
    lost: bool = False

    def tick(self, edge: int, *, clear: tuple[int, int] | None = None,
             forget: bool = False) -> None:
        """Go on by one clock, with an edge: -1, 0 or +1.

        ``clear`` is None, or n and m of a gear that begins.
        """
        self.pulse = 0
        self.lost &= not forget
        if clear:
            (self.n, self.m), self.edges, self.made = clear, 0, 0
        elif edge:
            rest = (self.edges + edge) * self.m + self.n // 2 - self.made * self.n
            if -ROOM <= rest < ROOM:
                self.edges += edge
            else:
                self.lost = not forget
        else:
            wanted = pulses_of(self.edges, self.n, self.m)
            self.pulse = (wanted > self.made) - (wanted < self.made)
            self.made += self.pulse
