# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.preset_counter``, against the exact model."""

from dataclasses import astuple

import numpy as np
import pytest

from rtl.gap.discriminator import PulseClass
from rtl.gap.preset_counter import Mode, PresetCounters
from testbench.models import preset_counter as model
from testbench.models.preset_counter import (
    ACCUMULATE,
    CONSECUTIVE,
    OK_ALONE,
    OWN_GATE,
    RELATIVE,
    TOTAL,
)
from testbench.native.preset_counter import INPUTS, OUTPUTS, by_name, compiled
from testbench.simulators.benches import settle

SETTINGS = dict(dame=3, open=2, ok=4, mode=ACCUMULATE, window=6, weight=1, period=8, freeze=0)
LAST = slice(-1, None)
KINDS = {"D": model.DAME, "S": model.SHORT, "O": model.OPEN, "K": model.OK}


def as_modelled(counters, inputs):
    """Outputs of the model for the inputs of one clock."""
    inputs = dict(inputs)
    return astuple(counters.clock(open_=inputs.pop("open"), **inputs))


class Bench:
    """The block and its model side by side, fed with pulses written as letters.

    A letter is a clock with a DAME, a SHORT, an OPEN or an OK (K); a point is a clock without a
    pulse. Outputs are those of the next clock: U, D, or a minus for a strobe with neither.
    ``shown`` has the counters that are full: d, o, or k for the output of 7.
    """

    def __init__(self):
        self.dut = PresetCounters()
        self.model = model.PresetCounters()

    def begin(self, settings):
        """Take settings; what was given and shown before is dropped."""
        self.settings = settings
        self.given, self.shown = [], []

    async def feed(self, ctx, pulses, **settings):
        dut = self.dut
        self.settings |= settings
        for letter in pulses:
            inputs = dict(sample=letter != ".", kind=KINDS.get(letter, 0), **self.settings)
            for name, value in inputs.items():
                shape = {"kind": PulseClass, "mode": Mode}.get(name, int)
                ctx.set(getattr(dut, name), shape(value))
            await settle(ctx)
            found = tuple(ctx.get(getattr(dut, name)) for name in OUTPUTS)
            assert found == as_modelled(self.model, inputs)
            self._keep(found)
            await ctx.tick()

    def _keep(self, found):
        up, down, strobe, *full = found
        assert not (up and down)
        assert strobe or not (up or down)
        self.given.append("U" if up else "D" if down else "-" if strobe else ".")
        self.shown.append("".join(letter for letter, high in zip("dok", full, strict=True)
                                  if high) or ".")


@pytest.fixture
def table(simulate):
    """Check cases, in one simulation: each begins with a freeze, which clears all, in its mode.

    A case is ``(parts, wanted)`` or ``(parts, wanted, own settings)``; parts are pulses, or a list
    of ``(pulses, settings that change with them)``. ``part`` takes a part of what is wanted.
    """
    def check(*rows, shown=False, part=slice(None), **settings):
        bench = Bench()

        async def script(ctx):
            found = []
            for parts, _, *own in rows:
                bench.begin(SETTINGS | settings | (own[0] if own else {}))
                await bench.feed(ctx, ".", freeze=1)
                bench.settings["freeze"] = 0
                for pulses, changed in [(parts, {})] if isinstance(parts, str) else parts:
                    await bench.feed(ctx, pulses, **changed)
                await bench.feed(ctx, ".")
                found.append((bench.shown if shown else bench.given)[2:])
            return found

        (found,) = simulate(bench.dut, script)
        for (parts, wanted, *own), one in zip(rows, found, strict=True):
            assert (" " if shown else "").join(one[part]) == wanted, (parts, *own)

    return check


def test_accumulate(table):
    table(
        # Presets 3, 2, 4 and a strobe in every eighth clock.
        ("DDD.....", ".......U"), ("DSD.....", ".......U"), ("DD......", ".......-"),
        ("O.O.....", ".......D"), ("O.......", ".......-"),
        # A race: other classes do not clear.
        ("DOKDKKD.", ".......U"), ("KKDODKO.", ".......D"),
        # Both full: UP wins, and both are cleared.
        ("DDDOO.........OO", ".......U.......D"), ("OODDD...........", ".......U.......-"),
        # 7 clears both, full or not, and itself; after that all count anew.
        ("DDDKKKK.", ".......-"), ("DDOKKKKD", ".......-"), ("OODDDKKK", ".......U"),
        ("KKKKKKKDDD......", ".......-.......U"), ("KKKKKKKKDDDKKKK.", ".......-.......-"),
        # UP and DOWN leave 7: three OK before, the fourth after.
        ("KKKDDD..DDDK....", ".......U.......-"), ("KKK..OO.DDDK....", ".......D.......-"),
        # A strobe with neither leaves what was counted; a full counter is held for the strobe.
        ("DD.........D....", ".......-.......U"), ("O..............O", ".......-.......D"),
        # UP clears 6, DOWN clears 5: the partial counts too.
        ("DDDO...........O", ".......U.......-"), ("OODD.......D....", ".......D.......-"),
        # The pulse of the strobe's clock comes before it: it fills, it clears, it is cleared.
        ("DD.....D........", ".......U.......-"), ("DDDKKK.K........", ".......-.......-"),
        ("DDD....D.DD.....", ".......U.......-"), ("DDD.....DDD.....", ".......U.......U"),
        # A full counter does not count on: nothing is left over.
        ("DDDDDD.....D....", ".......U.......-"),
        mode=ACCUMULATE)


def test_consecutive(table):
    table(
        ("DDD.....", ".......U"), ("D.S...D.", ".......U"), ("DDOD....", ".......-"),
        ("DDKDD...", ".......-"), ("DDKDDD..", ".......U"), ("ODO.....", ".......-"),
        ("OKOO....", ".......D"),
        # Once full it is held against other classes, and cleared by 7 only.
        ("DDDOKDK.", ".......U"), ("DDDKKKK.", ".......-"), ("DDDKKKDK", ".......U"),
        ("OOKKKK..", ".......-"), ("DDDOKOO.", ".......U"),
        # A run of OK is ended by any other.
        ("KKKOK...DDD.....", ".......-.......U"), ("DDDKKKOKKKK.....", ".......U.......-"),
        # It goes on through a strobe with neither, and is cleared with one.
        ("......DD..D.....", ".......-.......U"), ("OO.....DDD......", ".......D.......-"),
        mode=CONSECUTIVE)


def test_total(table):
    table(
        # Windows of six; presets 3, 2, 4.
        ("DKDKDK..", ".......U"), ("DKDKKK..", ".......-"), ("KDOKOK..", ".......D"),
        ("DODODK..", ".......U"), ("DDD.....", ".......-"),
        # Counts begin anew with each window.
        ("DDKKOKDKKODK....", ".......-.......-"), ("KKODDDDKKKDO....", ".......U.......-"),
        ("KKKDDKDKKDDK....", ".......-.......U"),
        # 7 at the end of a window clears both; it does nothing within one.
        ("DDKKKK..DDDKKO..", ".......-.......U"),
        # The pulse of the strobe's clock is the window's last.
        ("..DDDKKO", ".......U"), ("..DDDKK.O.......", ".......-.......U"),
        # UP begins the window anew: the two before it do not count.
        ("DDDKKODDDKKKO...", ".......U.......-"), ("DDDKKOKKKKDDDO..", ".......U.......U"),
        mode=TOTAL)


def test_total_verdict_replaces_the_last(table):
    table(("DDDKKKKKDOKK....", "-"),  # 7 reached its preset
          ("DDDKKKDDOKKK....", "-"),  # none did: what was held is lost
          ("DDDKKKOODKKK....", "D"), ("DDDKKKDDDOOK....", "U"),
          mode=TOTAL, period=16, part=LAST)


def test_total_window_of_one_pulse(table):
    pulses, given = "D.O..OK.DK.S", ".U.D.D.-.-.U"
    table((pulses, given, dict(window=0)), (pulses, given, dict(window=1)),
          mode=TOTAL, dame=1, open=1, ok=1, period=2)


def test_total_longest_window(table):
    table(("D" * 255 + "." * 45, "U"), ("D" * 254 + "K" + "." * 45, "-"),
          mode=TOTAL, window=255, dame=255, open=0, ok=255, period=300, part=LAST)


def test_relative(table):
    table(
        # Presets 3 and 2, weight 1. Not below 0.
        ("KKKKDDD.", ".......U"),
        ("DDD.....", ".......U"), ("DDKD....", ".......-"), ("DDKDD...", ".......U"),
        ("DODOD...", ".......U"), ("OKO.....", ".......-"), ("OKOO....", ".......D"),
        ("DKKKKDDD", ".......U"), ("DKKKKDD.", ".......-"),
        # Once full it is held; 7 is not used.
        ("DDDKKKK.", ".......U"), ("KKKKKKKKOOKKK....", ".......-.......D."),
        # Cleared with the strobe.
        ("DDDDDO.....O....", ".......U.......-"),
        mode=RELATIVE)


def test_relative_weight(table):
    """Four DAME, an OK, three DAME: the preset 5 is reached if the OK takes off at most two."""
    table(*(("DDDDKDDD", given, dict(weight=weight)) for weight, given in
            ((0, "U"), (2, "U"), (3, "-"), (4, "-"), (15, "-"))),
          mode=RELATIVE, dame=5, part=LAST)


def test_relative_heaviest_weight(table):
    pulses = "D" * 254 + "K" + "D" * 15
    table((pulses + "." * 730, "-"), (pulses + "D" + "." * 729, "U"),
          mode=RELATIVE, dame=255, weight=15, period=1000, part=LAST)


def test_own_gate(table):
    table(
        # Presets 3, 2, 4, as ACCUMULATE but at a strobe with only one full.
        ("DDD.....", ".......U"), ("DOKDKKD.", ".......U"), ("DDDKKKK.", ".......-"),
        # UP clears 5 alone: the OPEN before it counts on.
        ("DDDO...........O", ".......U.......D"), ("DDDO............", ".......U.......-"),
        # DOWN clears 6 alone: the two DAME before it count on.
        ("OODD.......D....", ".......D.......U"), ("OODD............", ".......D.......-"),
        # Both full: UP wins, and each has cleared its own.
        ("DDDOO...........", ".......U.......-"), ("DDDOO....O......", ".......U.......-"),
        ("OODDD....DD.....", ".......U.......-"),
        # 7 clears all, what was left by a strobe too; UP and DOWN leave 7.
        ("DDDO....KKKKO...", ".......U.......-"), ("KKKDDD..DDDK....", ".......U.......-"),
        # The pulse of the strobe's clock: it fills, or it is the first of those left.
        ("DD.....D........", ".......U.......-"), ("DDD....O...O....", ".......U.......D"),
        ("DDD....D..DD....", ".......U.......-"),
        mode=OWN_GATE)


def test_ok_alone(table):
    table(
        # Preset 4: full UP, else DOWN, at each strobe; then 7 begins anew.
        ("KKKK....", ".......U"), ("KKK.....", ".......D"), ("........", ".......D"),
        ("KKKKKKKKKKK.....", ".......U.......D"), ("KKK.....K.......", ".......D.......D"),
        # Other classes neither count nor clear.
        ("KDOSKKDK", ".......U"), ("DDDDDOOO", ".......D"),
        ("DDDOO...KKKK....", ".......D.......U"),
        # The pulse of the strobe's clock comes before it.
        ("KKK....KKKK.....", ".......U.......D"), ("KKKK...KKKK.....", ".......U.......D"),
        ("KKKK....KKKK....", ".......U.......U"),
        mode=OK_ALONE)


def test_ok_alone_without_a_preset_does_nothing(table):
    table(("KKKK" * 4, ".......-.......-", dict(ok=0)),
          # 5 and 6 are not used.
          ("DDDOO...", ".......-", dict(ok=0)),
          ([("KKKK.", {}), ("...", dict(ok=0)), ("........", {})], ".......-.......-"),
          mode=OK_ALONE)


def test_ok_alone_at_its_highest_preset(table):
    settings = dict(mode=OK_ALONE, ok=255, period=256)
    table(("K" * 255 + "." * 257, "." * 255 + "U" + "." * 255 + "D"),
          ("K" * 254 + "..", "." * 255 + "D"), ("K" * 1024, ("." * 255 + "U") * 4), **settings)


def test_ok_alone_shows_7_full_until_the_strobe(table):
    table(("KKKKD.....", ". . . k k k k . . ."), mode=OK_ALONE, shown=True)


@pytest.mark.parametrize("mode", [ACCUMULATE, CONSECUTIVE, TOTAL, RELATIVE, OWN_GATE])
def test_one_class_alone(table, mode):
    """A counter with preset 0 is off; the other one works as usual."""
    def case(name, letter, given):
        first, second = (other for other in "DOK" if other != letter)
        return (first * 2 + second * 2 + letter * 2 + first + second + letter * 4,
                "...-..." + given + "..." + given, {name: 2})

    table(case("dame", "D", "U"), case("open", "O", "D"), case("ok", "K", "-"),
          mode=mode, window=4, weight=0, period=4, dame=0, open=0, ok=0)


@pytest.mark.parametrize("mode", [ACCUMULATE, CONSECUTIVE, RELATIVE, OWN_GATE])
def test_highest_preset(table, mode):
    table(("D" * 255 + "." * 257, "." * 255 + "U" + "." * 255 + "-"),
          ("D" * 254 + "..", "." * 255 + "-"),
          # Far beyond its preset: held, and nothing left over.
          ("S" * 1024, ("." * 255 + "U") * 4),
          mode=mode, dame=255, open=255, ok=255, period=256)


@pytest.mark.parametrize("mode", [ACCUMULATE, CONSECUTIVE, OWN_GATE])
def test_highest_preset_of_7(table, mode):
    table(("D" + "K" * 254 + ".", "U"), ("D" + "K" * 255, "-"),
          mode=mode, dame=1, ok=255, period=256, part=LAST)


def test_full_counters_are_shown(table):
    longer, usual = dict(period=15), dict(period=8)
    table(("DDDOOKKKK.DDD..", ". . d d do do do do k . . . d d .", longer | dict(mode=ACCUMULATE)),
          ("OODDDKKKK......", ". o o o do do do do k . . . . . .", longer | dict(mode=CONSECUTIVE)),
          ("DDDOOK.OOKKKKK.", ". . . . . do do . . . . . . k .", usual | dict(mode=TOTAL)),
          ("OODDDKKKK......", ". o o o do do do . . . . . . . .", usual | dict(mode=RELATIVE)),
          shown=True)


def test_strobes(table):
    table(("." * 9, "-" * 9, dict(period=1)), ("." * 9, "..-..-..-", dict(period=3)),
          ("DDDOO" + "." * 600, "." * 605, dict(period=0)))


def test_period_changes(table):
    """Less than what has run: at once. More: from the last strobe on. 0: it is restarted."""
    table(
        ([(".....", {}), ("......", dict(period=3))], ".....-..-.."),
        ([(".....", {}), ("......", dict(period=10))], ".........-."),
        ([(".....", {}), ("..", dict(period=0)), ("....", dict(period=3))], ".........-."),
        ([("DDD..", {}), ("....", dict(period=4))], ".....U..."))


@pytest.mark.parametrize("mode", [ACCUMULATE, CONSECUTIVE, TOTAL, RELATIVE, OWN_GATE])
def test_freeze_clears_and_holds(table, mode):
    still, held = dict(freeze=0), dict(freeze=1)
    table(
        # What was counted is lost, pulses under it do not count, and a whole period follows it.
        ([("DDO", {}), ("DDDOOO", held), ("....", still)], "............-"),
        ([("DOO", {}), ("OOOD", held), ("DOK.", still)], "..........-"),
        ([("DD.", {}), (".", held), ("ODD.", still)], ".......U"),
        # It hides the output that was on its way, and the strobe of its own clock.
        ([("DDO.", {}), ("D", held), ("....", still)], "........-"),
        ([("OOD.", {}), ("O", held), ("....", still)], "........-"),
        ([("DDO", {}), ("D", held), ("....", still)], ".......-"),
        # It clears 7.
        ([("DKK", {}), (".", held), ("KDD.", still)], ".......U"),
        mode=mode, dame=2, open=2, ok=3, window=3, period=4)


def test_freeze_clears_ok_alone_and_holds(table):
    still, held = dict(freeze=0), dict(freeze=1)
    table(
        # What was counted is lost, pulses under it do not count, and a whole period follows it.
        ([("KK", {}), ("KKKK", held), ("K...", still)], ".........D"),
        # It hides the output that was on its way, and the strobe of its own clock.
        ([("KK..", {}), ("K", held), ("....", still)], "........D"),
        ([("KK.", {}), (".", held), ("....", still)], ".......D"),
        mode=OK_ALONE, ok=2, period=4)


def test_frozen_outputs_are_low_in_the_same_clock(simulate):
    dut = PresetCounters()

    async def run(ctx):
        for name, value in dict(sample=1, dame=1, period=1, kind=PulseClass.DAME).items():
            ctx.set(getattr(dut, name), value)
        await ctx.tick()
        assert ctx.get(dut.up)
        assert ctx.get(dut.strobe)
        ctx.set(dut.freeze, 1)
        await settle(ctx)
        assert not ctx.get(dut.up)
        assert not ctx.get(dut.strobe)

    simulate(dut, run)


def test_settings_change_in_mid_count(table):
    table(
        # A preset lowered to the count or below acts with the next pulse of the class, not before.
        ([("DD", {}), ("......", dict(dame=1))], ".......-"),
        ([("DD", {}), ("OK....", dict(dame=1))], ".......-"),
        ([("DD", {}), ("..D...", dict(dame=1))], ".......U"),
        ([("KKKDDD", {}), (".O", dict(ok=1))], ".......U"),
        ([("KKKDDD", {}), (".K", dict(ok=1))], ".......-"),
        # Raised: more are needed; what is full is held.
        ([("DD", {}), ("D.....", dict(dame=4))], ".......-"),
        ([("DD", {}), ("DD....", dict(dame=4))], ".......U"),
        ([("DDD", {}), (".....", dict(dame=9))], ".......U"),
        # Switched off: cleared in that clock; switched on again it begins at 0.
        ([("DDD", {}), (".", dict(dame=0)), ("....", dict(dame=3))], ".......-"),
        ([("DDD", {}), (".", dict(dame=0)), ("DD..", dict(dame=3))], ".......-"),
        ([("DDD....", {}), (".", dict(dame=0))], ".......-"),
        ([("DDDOO..", {}), (".", dict(dame=0))], ".......D"),
        ([("KKK", {}), ("DDD.", dict(ok=0)), ("K", dict(ok=4))], ".......U"),
        ([("DD", dict(dame=0)), ("D.....", dict(dame=3))], ".......-"),
        # A mode clears everything, and its first pulse is lost; the time device runs on.
        ([("DDD", {}), (".....", dict(mode=CONSECUTIVE))], ".......-"),
        ([("DDD....", {}), (".", dict(mode=CONSECUTIVE))], ".......-"),
        ([("D", {}), ("DDD....", dict(mode=RELATIVE))], ".......-"),
        ([("D", {}), ("DDDD...", dict(mode=RELATIVE))], ".......U"),
        ([("KKK", {}), (".", dict(mode=CONSECUTIVE)), ("DDDK", {})], ".......U"),
        ([("..DD", dict(mode=TOTAL)), (".", dict(mode=ACCUMULATE)),
          (".KDD", dict(mode=TOTAL)), ("DKK....", {})], ".......-.......U"),
        # Window and weight: from the next pulse on.
        ([("..DDD", dict(mode=TOTAL)), ("...", dict(window=2))], ".......-"),
        ([("..DDD", dict(mode=TOTAL)), ("..K", dict(window=2))], ".......U"),
        ([(".DD", dict(mode=RELATIVE)), ("KDD..", dict(weight=2))], ".......-"),
        # An OK makes no counter full that a lower preset would.
        ([(".DD", dict(mode=RELATIVE)), ("K....", dict(dame=1))], ".......-"))


def test_modes_differ(table):
    """Settings of other modes have no effect: window 0, a weight, a preset of 7."""
    pulses = "DDD.....OO......DDODO...DDDK...."
    table(*((pulses, given, dict(mode=mode, window=6 if mode == TOTAL else 0))
            for mode, given in ((ACCUMULATE, "UDU-"), (CONSECUTIVE, "UD--"), (TOTAL, "--U-"),
                                (RELATIVE, "UDUU"), (OWN_GATE, "UDU-"), (OK_ALONE, "DDDU"))),
          weight=0, ok=1, part=slice(7, None, 8))


def test_output_of_7_is_cleared_too(table):
    table(([("KKK", {}), ("K.", {})], ". . . k ."),
          ([("KKK", {}), ("K.", dict(freeze=1))], ". . . . ."),
          ([("KKK", {}), ("K.", dict(mode=CONSECUTIVE))], ". . . . ."), shown=True)


@pytest.mark.soak
def test_longest_period():
    period = (1 << 24) - 1
    row = [0, 0, *(SETTINGS | dict(period=period)).values()]
    outputs = compiled([row], period + 2)
    assert list(np.flatnonzero(outputs)) == [period]
    assert outputs[period] == 1 << OUTPUTS.index("strobe")


def settings_at_random(rng):
    """Settings as they come, with edges among them."""
    preset = rng.choice(((0, 1, 2, 3), (2, 3, 5, 8), (20, 60), (254, 255)))
    return dict(dame=rng.choice(preset), open=rng.choice(preset), ok=rng.choice((0, *preset)),
                mode=rng.randrange(8), window=rng.choice((0, 1, 2, 5, 30, 255)),
                weight=rng.choice((0, 1, 1, 2, 3, 15)),
                period=rng.choice((0, 1, 2, 7, 50, 50, 300)), freeze=0)


@pytest.mark.parametrize("lasting", [3, 30, 600])
def test_follows_the_model(rng, lasting):
    """Settings change one or all at a time, after as many clocks as are ``lasting`` on average."""
    rows, settings, odds, busy = [], settings_at_random(rng), (1, 1, 1, 1), 1
    for _ in range(60_000):
        if rng.random() < 1 / lasting:
            fresh = settings_at_random(rng)
            name = rng.choice([*SETTINGS, "all", "odds"])
            if name == "all":
                settings = fresh
            elif name == "odds":
                busy = rng.choice((1, 1, 0.3))
                odds = [rng.choice((0.01, 0.1, 1)) for _ in KINDS]
            elif name == "freeze":
                settings = settings | {"freeze": 1 - settings["freeze"]}
            else:
                settings = settings | {name: fresh[name]}
            if settings["freeze"] and rng.random() < 0.8:
                settings = settings | {"freeze": 0}
        kind = rng.choices(range(4), odds)[0]
        rows.append(dict(sample=int(rng.random() < busy), kind=kind, **settings))
    counters = model.PresetCounters()
    wanted = np.array([as_modelled(counters, row) for row in rows])
    found = by_name(compiled([[row[name] for name in INPUTS] for row in rows]))
    assert (wanted == found).all(), np.flatnonzero((wanted != found).any(axis=1))[:3]
    assert (wanted.sum(axis=0) > 50).all(), "every output was seen"
    assert not (found[:, 0] & found[:, 1]).any()
