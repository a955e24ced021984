# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.power.power``: the sources joined, against the models of their parts."""

from rtl.power.power import Power
from testbench.models.pulse_generator import PulseGenerator, limit
from testbench.models.readback import ReadBack
from testbench.simulators.benches import settle

LIMITS = dict(level_max=20, on_max=9, off_min=3)
TIMES = dict(dead=2, limit=12, settle=4)  # of the read-back, in clocks
DEVICE = dict(clock_hz=1_000_000, dead_ns=2000, limit_us=12, settle_us=4)


class Model:
    """What the joined sources do: wishes, then limits, then pulses, then what reads them back."""

    def __init__(self):
        self.pulses = PulseGenerator()
        self.gap = ReadBack(**TIMES)
        self.machining = 0      # a clock ago

    def clock(self, *, machining, sensing, look, safe, quiet, current, short, reference, level,
              on_time, wait_time, off_time, latched, settled, **others):
        """Return what the outputs are in this clock, and go to the next."""
        changed = machining != self.machining
        enable = bool((machining or look) and not (changed or safe or quiet))
        live, stuck = self.gap.live, self.gap.stuck
        waits = bool(live or not latched)
        on, sense, level_out, between = self.pulses.outputs(enable=enable, live=waits)
        level, on_time, wait_time, off_time = limit(
            level=level, on_time=on_time, wait_time=wait_time, off_time=off_time, **LIMITS)
        self.pulses.edge(enable=enable, sensing=bool(sensing or not machining or not settled),
                         level=level, on_time=on_time, wait_time=wait_time, off_time=off_time,
                         live=waits, **others)
        self.gap.clock(on=on, sense=sense, current=current, short=short, level=reference)
        self.machining = machining
        forget = changed or not (machining or look)
        return on, sense, level_out, between, int(forget), int(stuck)


def stimulus(rng, before):
    """Return the inputs of a clock: what is set stays for a while, the gap changes with it."""
    rare = {name: rng.random() < 0.5 for name in ("machining", "sensing", "look")
            if rng.random() < 0.02}
    rare |= {name: rng.random() < 0.3 for name in ("safe", "quiet") if rng.random() < 0.05}
    rare |= {name: rng.randrange(15) for name in ("on_time", "wait_time", "off_time", "off_extra",
                                                  "sense_on", "sense_off") if rng.random() < 0.01}
    rare |= {name: rng.random() < 0.7 for name in ("latched", "settled") if rng.random() < 0.05}
    if rng.random() < 0.02:
        rare["reference"] = rng.choice([100, 100, 101])
    if rng.random() < 0.05:
        rare["level"] = rng.randrange(64)
    # The gap is live for a long time now and then, otherwise for one clock.
    dead = rng.random() < (0.97 if before["short"] else 0.1)
    return before | rare | {"cut": rng.random() < 0.5, "abnormal": rng.random() < 0.1,
                            "ignited": rng.random() < 0.1,
                            "current": rng.random() < 0.02, "short": dead}


def test_follows_the_models_of_its_parts(simulate, rng):
    dut, model = Power(**LIMITS, **DEVICE), Model()
    seen = set()

    async def bench(ctx):
        inputs = dict.fromkeys(("machining", "sensing", "look", "safe", "quiet", "on_time",
                                "wait_time", "off_time", "off_extra", "sense_on", "sense_off",
                                "level", "cut", "abnormal", "ignited", "current", "reference",
                                "latched", "settled"), 0) | dict(short=1)
        for _ in range(12_000):
            inputs = {name: int(value) for name, value in stimulus(rng, inputs).items()}
            for name, value in inputs.items():
                ctx.set(getattr(dut, name), value)
            await settle(ctx)
            got = tuple(ctx.get(getattr(dut, name)) for name in (
                "on", "sense", "level_out", "between", "forget", "stuck"))
            assert got == model.clock(**inputs)
            seen.add((*got[:2], got[5], inputs["machining"]))
            if got[1] and inputs["machining"] and not inputs["sensing"]:
                seen.add("sensing in place of a discharge")
            await ctx.tick()

    simulate(dut, bench, deadline=1)
    # Main pulses, sensing pulses in their place and while off, and a gap that stays live in both.
    assert {(1, 0, 0, 1), (0, 1, 0, 1), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 1, 1),
            "sensing in place of a discharge"} <= seen


def test_limits_can_be_read(simulate):
    dut = Power(**LIMITS, **DEVICE)

    async def bench(ctx):
        assert (ctx.get(dut.limit_level), ctx.get(dut.limit_off)) == (20, 3)

    simulate(dut, bench)
