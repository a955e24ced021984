# SPDX-License-Identifier: Apache-2.0
"""Reference model of the pulse discriminator: keeps a whole pulse and classifies it at its end."""

from collections import Counter
from dataclasses import dataclass, field

OPEN, OK, DAME, SHORT = range(4)


@dataclass(frozen=True)
class Sample:
    """Class of a pulse."""

    kind: int
    sensing: bool


@dataclass(frozen=True)
class Rules:
    """Settings; they change between pulses only."""

    blanking: int = 2
    settle: int = 0
    confirm: int = 1
    delay_least: int = 0
    use_current: int = 0
    use_delay: int = 0
    use_noise: int = 0
    from_ignition: int = 0
    relaxation: int = 0


@dataclass(frozen=True)
class Clock:
    """Outputs of the comparators in one clock."""

    high: int = 0
    arc: int = 0
    short: int = 0
    current: int = 0
    noise: int = 0


@dataclass
class Discriminator:
    """One call of ``clock`` a clock."""

    main: Counter = field(default_factory=Counter)
    last: int = OPEN
    source: str = ""
    pulse: list = field(default_factory=list)  # the clocks so far
    rules: Rules = field(default_factory=Rules)

    def clock(self, *, on, sense, rules, **levels):
        """Return ``(sample or None, shorted_now, abnormal)`` of this clock, and go to the next."""
        source = "main" if on else "sense" if sense else ""
        self.rules = rules
        sample = None
        if source != self.source:
            sample = self._classify(rules)
            self.source, self.pulse = source, []
        if source:
            self.pulse.append(Clock(**levels))
        if sample and not sample.sensing:
            self.main[sample.kind] += 1
            self.last = sample.kind
        return (sample, *self._now(rules))

    def _blanked(self, rules):
        """Clocks of the pulse so far in which the comparators do not count."""
        if self.source == "main" and rules.from_ignition:
            for number, clock in enumerate(self.pulse, 1):
                if (rules.use_current or clock.high
                        or (rules.relaxation and not clock.short)):
                    return min(rules.blanking, number)
        return rules.blanking

    def _ignition(self, rules):
        """Number of the clock in which the main pulse ignites, or None."""
        blanked = self._blanked(rules)
        for number, clock in enumerate(self.pulse):
            lit = clock.current if rules.use_current else not clock.high
            if rules.relaxation and not rules.use_current:
                before = self.pulse[:number]
                lit = ((any(c.high for c in before) and not clock.high)
                       or (not all(c.short for c in before) and clock.short))
            if number >= blanked and lit:
                return number
        return None

    @property
    def ignited(self):
        """Whether the main pulse had ignited in the clock of the last call."""
        return self.source == "main" and self._ignition(self.rules) is not None

    def _readable(self, rules):
        """The clocks in which arc and short levels count."""
        if self.source == "sense":
            return self.pulse[rules.blanking:]
        ignition = self._ignition(rules)
        return [] if ignition is None else self.pulse[ignition + rules.settle:]

    def _weak(self, rules):
        """Whether the capacitor has broken down before it was full."""
        ignition = self._ignition(rules)
        return ignition is not None and not any(c.high for c in self.pulse[:ignition])

    def _empty(self, clocks):
        """Whether the capacitor has not been charged in the first clocks of the pulse."""
        return all(clock.short for clock in self.pulse[:clocks])

    def _charging(self, rules):
        """As ``_now``, of a pulse that charges a capacitor."""
        ignition, weak, run = self._ignition(rules), self._weak(rules), 0
        for number in range(self._blanked(rules), len(self.pulse)):
            low = self._empty(number + 1) or (weak and number >= ignition)
            run = run + 1 if low else 0
        past = len(self.pulse) > self._blanked(rules)
        return past and self._empty(len(self.pulse)), weak or run >= max(1, rules.confirm)

    def _now(self, rules):
        if self.source == "main" and rules.relaxation:
            return self._charging(rules)
        seen = self._readable(rules)
        if not seen:
            return False, False
        run = 0
        for clock in seen:
            run = run + 1 if clock.short or clock.arc else 0
        abnormal = self.source == "main" and run >= max(1, rules.confirm)
        return bool(seen[-1].short), abnormal

    def _classify(self, rules):
        if len(self.pulse) <= self._blanked(rules):
            return None
        sensing = self.source == "sense"
        seen = self._readable(rules)
        charges = rules.relaxation and not sensing
        if self._empty(len(self.pulse)) if charges else seen and seen[-1].short:
            return Sample(SHORT, sensing)
        ignition = self._ignition(rules)
        if sensing or ignition is None:
            return Sample(OPEN, sensing)
        says = []
        if rules.use_delay:
            says.append(ignition < rules.delay_least)
        if rules.use_noise:
            says.append(not any(clock.noise for clock in self.pulse[ignition:]))
        arc = self._weak(rules) if charges else seen and seen[-1].arc
        bad = arc or (says and all(says))
        return Sample(DAME if bad else OK, sensing)
