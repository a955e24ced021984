# SPDX-License-Identifier: Apache-2.0
"""One axis: from command pulses and an encoder to a velocity command or steps."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from rtl.motion.backlash import BACKLASH_BITS, PITCH_BITS, TAKEN_BITS, Backlash
from rtl.motion.coder_gear import CoderGear
from rtl.motion.dac import Dac, check_modulator
from rtl.motion.drive_lag import SHARE_BITS, SHARE_INIT, DriveLag
from rtl.motion.encoder import Encoder
from rtl.motion.error_counter import ErrorCounter
from rtl.motion.feed_forward import FORWARD_BITS
from rtl.motion.gear import GEAR_BITS, Gear
from rtl.motion.supervision import GAIN_BITS, Supervision

__all__ = ["Axis"]

FULL_SCALE_BITS = 15
FULL_SCALE = (1 << FULL_SCALE_BITS) - 1  # of the DAC, in pulses of Er
OFFSET_BITS, FRICTION_BITS = 12, 8       # of what a drive needs beside its speed


class Overshoot(wiring.Component):
    """How far a position has been beyond a mark.

    ``mark`` makes the command, with the Pi of its clock, the new mark. From then on ``furthest`` is
    the greatest distance by which the position has been beyond the mark (from the FP of that clock
    on), in the direction that ``reverse`` had then; it is never below 0. ``furthest`` follows
    ``mark`` and FP three clocks later. Reset is a mark at 0, upwards.

    Members
    -------
    mark : In(1)
        Take the command as the mark.
    reverse : In(1)
        The travel at the mark is down. Read with ``mark``.
    fp : In(1)
        Feedback pulse.
    fp_reverse : In(1)
        Its direction.
    size : In(width - 1)
        Magnitude of Er, one clock after Er.
    negative : In(1)
        Sign of Er, one clock after Er.
    furthest : Out(travel)
        Distance, in pulses.
    """

    def __init__(self, *, width, travel):
        self.travel = travel
        super().__init__({
            "mark":       In(1),
            "reverse":    In(1),
            "fp":         In(1),
            "fp_reverse": In(1),
            "size":       In(width - 1),
            "negative":   In(1),
            "furthest":   Out(travel),
        })

    def elaborate(self, platform):
        m = Module()

        # The magnitude of Er is two clocks late. So the mark and the feedback pulses are delayed
        # by as much.
        mark, down, fp, up = (Signal(2, name=f"{name}_delay")
                              for name in ("mark", "down", "fp", "up"))
        m.d.sync += [mark.eq(Cat(self.mark, mark)), down.eq(Cat(self.reverse, down)),
                     fp.eq(Cat(self.fp, fp)), up.eq(Cat(~self.fp_reverse, up))]

        # Two counters take the place of a subtraction: ``furthest``, and ``back``, the pulses by
        # which the position is short of the furthest point.
        back = Signal(self.travel)
        travel_down = Signal()
        onward = up[1] != travel_down
        with m.If(mark[1]):
            # The command lies Er ahead of the position. Er in the direction of travel is distance
            # still to go; Er against it is an overshoot already made.
            behind = self.negative != down[1]
            m.d.sync += [
                travel_down.eq(down[1]),
                self.furthest.eq(Mux(behind, self.size, 0)),
                back.eq(Mux(behind, 0, self.size)),
            ]
        with m.Elif(fp[1] & onward & (back == 0)):
            m.d.sync += self.furthest.eq(self.furthest + 1)
        with m.Elif(fp[1]):
            m.d.sync += back.eq(back + Cat(1, onward.replicate(self.travel - 1)))  # +-1

        return m


class Axis(wiring.Component):
    """Error counter, encoder, DAC and step output of one axis, and its supervision.

    ``command``, ``position`` and ``error`` are those of ``ErrorCounter``:
    ``command == position + error`` in every clock in which ``status_saturated`` is low. Pi is
    accepted in any clock, also while ``safe``. FP comes from the encoder or, with ``mode_step``,
    from the ``Gear``: Er is then the queue of the pulses whose steps are not sent yet, and DAC and
    encoder are not used. A coder that is coarser than a pulse, with n edges for m pulses and n
    below m, has its edges made into pulses by a ``CoderGear``. In any case ``Backlash`` stands
    between, and has its own pulses in FP.

    The velocity command is Er in the plain loop. With feed-forward, ``ahead``, it is Er plus
    ``forward`` less the way by which the drive is behind anyway (``DriveLag``). So the drive moves
    as if the path's speed were given to it alone, stops at the end of the command and not beyond
    it, and Er corrects only what the drive does otherwise. ``forward`` is no part of Er.

    For the DAC, ``offset`` is added, and ``friction`` in the direction in which the model's drive
    moves: what a real drive needs beside its speed. The model has neither. The command is limited
    to +-32767 pulses, in 2**-15 of full scale: the DAC saturates at a quarter of the error
    counter's range; the alarm comes at the end of that range.

    The coder is supervised whenever the velocity command is in force, whatever the settings; see
    ``Supervision``: its model of the drive gets the velocity command without offset and friction.
    With ``mode_step`` there is no coder and no supervision.

    Latency, in clocks after the one that has Pi or ``fp``: 1 to ``command``, ``position`` and
    ``error``; 2 to ``in_position``; 3 to ``dac`` (sigma-delta), 2 to ``step``, 3 to the following
    errors. From ``forward`` to ``dac`` it takes 3, from the offset and the friction 5. ``safe``
    takes ``dac`` and ``step`` low in 1 clock. From an edge of the encoder to ``fp``: ``Encoder``,
    3.

    ``adopt`` works only while ``safe``: it also clears ``status_illegal`` and ``status_check``. It
    does not touch the mark of the overshoot, which is a position, nor gear and backlash. Without
    ``mode_step`` the gear does not count.

    Parameters
    ----------
    error_bits : int
        Bits of Er, at least 17.
    dac : str
        Modulator, ``"sigma_delta"`` or ``"pwm"``.
    rest_clocks : int
        Clocks without Pi after which the axis counts as at rest, at least 1. They should be some
        time constants of the position loop, so that Er has decayed. Default 0.1 s at 2 MHz.
    travel : int
        Bits of the positions.
    allowance, fastest : int
        See ``Supervision``; in pulses.

    Members
    -------
    pi : In(1)
        Command pulse.
    pi_reverse : In(1)
        Its direction, high for down.
    enc_a : In(1)
        First phase of the encoder, synchronous to the clock.
    enc_b : In(1)
        Second phase.
    forward : In(signed(16))
        Velocity feed-forward, in pulses of Er; 0 at rest. See ``FeedForward``.
    ahead : In(1)
        The feed-forward is in force, also at rest.
    safe : In(1)
        No output.
    adopt : In(1)
        Take the position as command; ignored unless ``safe``.
    mark : In(1)
        Measure the overshoot from here: from the command with this clock's Pi.
    mark_reverse : In(1)
        The axis went down at the mark. Read with ``mark``.
    follow_stopped : In(18)
        Following error allowed at rest, in pulses.
    follow_moving : In(18)
        Following error allowed in motion, in pulses.
    window : In(12)
        Following error up to which the axis is in position, in pulses.
    mode_step : In(1)
        Step/direction instead of DAC and encoder.
    mode_reverse : In(1)
        The encoder counts the other way.
    mode_swap : In(1)
        The drive turns the other way: ``dir`` and ``dac_negative`` are inverted.
    mode_offset : In(signed(12))
        Velocity command at which the axis stands still, in pulses of Er.
    mode_friction : In(8)
        Velocity command that friction takes, in pulses of Er.
    resting : In(1)
        No path pulses are commanded; see ``Supervision``.
    gear_steps, gear_surplus : In(16), gear_strobe : In(1)
        n and m - n of the ``Gear``, or of the ``CoderGear``; the strobe begins to count with them.
    backlash_size : In(13), backlash_strobe : In(1)
        See ``Backlash``; the strobe clears.
    pitch : In(signed(13))
        See ``Backlash``.
    step_time_width : In(8)
        See ``StepDir``; so are the next two.
    step_time_space : In(8)
        In clocks.
    step_time_setup : In(8)
        In clocks.
    tick : In(1), model_gain : In(14)
        See ``Supervision``; ``Backlash`` makes a pulse a tick.
    model_lag : In(13)
        ``share`` of the ``DriveLag``.
    command : Out(signed(travel))
        Sum of Pi, in pulses.
    position : Out(signed(travel))
        Sum of FP, in pulses.
    error : Out(signed(32))
        Er, in pulses.
    overshoot : Out(travel)
        Furthest position beyond the last mark, in pulses; see ``Overshoot``.
    status_saturated : Out(1)
        Er could not take a pulse, since ``adopt``.
    status_illegal : Out(1)
        The encoder has jumped, or was too fast for its gear, since ``adopt``.
    damaged : Out(1)
        See ``ErrorCounter``, ``Backlash`` and ``CoderGear``.
    status_check : Out(3)
        What the supervision of the coder has found (``Check``), since ``adopt``.
    following_stopped : Out(1)
        At rest, and Er further from 0 than ``follow_stopped``.
    following_moving : Out(1)
        In motion, and Er further from 0 than ``follow_moving``.
    dac : Out(1)
        Velocity command, as density of pulses.
    dac_negative : Out(1)
        Its sign.
    step : Out(1)
        Step pulse.
    dir : Out(1)
        Its direction, high for down.
    backlash_taken_up : Out(signed(15))
        See ``Backlash``.
    fp : Out(1)
        Feedback pulse, those of backlash and pitch included.
    fp_reverse : Out(1)
        Its direction, high for down. Valid while ``fp`` is high.
    in_position : Out(1)
        Er is no further from 0 than ``window``, and backlash and pitch are made up for.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, error_bits=18, dac="sigma_delta", rest_clocks=200_000, travel=32,
                 allowance=200, fastest=2458):
        if not 17 <= error_bits <= 32:
            raise ValueError(f"error counter must have 17 to 32 bits, more than the DAC, "
                             f"not {error_bits!r}")
        if rest_clocks < 1:
            raise ValueError(f"an axis must be at rest after 1 clock or more, not {rest_clocks!r}")
        check_modulator(dac)
        self.error_bits = error_bits
        self.dac_modulator = dac
        self.rest_clocks = rest_clocks
        self.travel = travel
        self.supervision = Supervision(allowance=allowance, fastest=fastest)
        self.coder_gear = CoderGear()
        super().__init__({
            "pi":                In(1),
            "pi_reverse":        In(1),
            "enc_a":             In(1),
            "enc_b":             In(1),
            "forward":           In(signed(FORWARD_BITS)),
            "ahead":             In(1),
            "safe":              In(1),
            "adopt":             In(1),
            "mark":              In(1),
            "mark_reverse":      In(1),
            "follow_stopped":    In(18),
            "follow_moving":     In(18),
            "window":            In(12),
            "mode_step":         In(1),
            "mode_reverse":      In(1),
            "mode_swap":         In(1),
            "mode_offset":       In(signed(OFFSET_BITS)),
            "mode_friction":     In(FRICTION_BITS),
            "resting":           In(1),
            "gear_steps":        In(GEAR_BITS, init=1),
            "gear_surplus":         In(GEAR_BITS),
            "gear_strobe":       In(1),
            "backlash_size":     In(BACKLASH_BITS),
            "backlash_strobe":   In(1),
            "pitch":             In(signed(PITCH_BITS)),
            "step_time_width":   In(8),
            "step_time_space":   In(8),
            "step_time_setup":   In(8),
            "tick":              In(1),
            "model_gain":        In(GAIN_BITS),
            "model_lag":         In(SHARE_BITS, init=SHARE_INIT),
            "command":           Out(signed(travel)),
            "position":          Out(signed(travel)),
            "error":             Out(signed(32)),
            "overshoot":         Out(travel),
            "status_saturated":  Out(1),
            "status_illegal":    Out(1),
            "status_check":      Out(3),
            "damaged":           Out(1),
            "following_stopped": Out(1),
            "following_moving":  Out(1),
            "dac":               Out(1),
            "dac_negative":      Out(1),
            "step":              Out(1),
            "dir":               Out(1),
            "backlash_taken_up": Out(signed(TAKEN_BITS)),
            "fp":                Out(1),
            "fp_reverse":        Out(1),
            "in_position":       Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.error_counter = counter = ErrorCounter(width=self.error_bits,
                                                            travel=self.travel)
        m.submodules.encoder = encoder = Encoder()
        m.submodules.dac = dac = Dac(self.dac_modulator)
        m.submodules.gear = gear = Gear()
        m.submodules.coder_gear = coder = self.coder_gear
        m.submodules.backlash = backlash = Backlash()
        m.submodules.overshoot = overshoot = Overshoot(width=self.error_bits, travel=self.travel)
        m.submodules.supervision = supervision = self.supervision
        m.submodules.drive_lag = drive_lag = DriveLag()

        adopt = Signal()
        coarse = Signal()                           # the coder is
        edge_reverse = Signal()
        moved, moved_reverse = Signal(), Signal()   # pulse of the drive
        m.d.comb += [
            adopt.eq(self.adopt & self.safe),

            encoder.a.eq(self.enc_a),
            encoder.b.eq(self.enc_b),
            encoder.clear.eq(adopt | self.mode_step),
            self.status_illegal.eq(encoder.illegal | coder.lost),

            coarse.eq(~self.mode_step & (self.gear_surplus != 0)),
            edge_reverse.eq(encoder.fp_reverse ^ self.mode_reverse),
            coder.edge.eq(encoder.fp),
            coder.edge_reverse.eq(edge_reverse),
            coder.steps.eq(self.gear_steps),
            coder.surplus.eq(self.gear_surplus),
            coder.clear.eq(self.gear_strobe | ~coarse),
            coder.forget.eq(adopt | self.mode_step),

            gear.pending.eq(counter.error != 0),
            gear.negative.eq(counter.error < 0),
            gear.steps.eq(self.gear_steps),
            gear.surplus.eq(self.gear_surplus),
            gear.clear.eq(self.gear_strobe | ~self.mode_step),
            gear.width.eq(self.step_time_width),
            gear.space.eq(self.step_time_space),
            gear.setup.eq(self.step_time_setup),
            gear.safe.eq(self.safe | ~self.mode_step),
            self.step.eq(gear.step),
            self.dir.eq(gear.dir ^ self.mode_swap),

            moved.eq(Mux(self.mode_step, gear.fp, Mux(coarse, coder.fp, encoder.fp))),
            moved_reverse.eq(Mux(self.mode_step, gear.fp_reverse,
                                 Mux(coarse, coder.fp_reverse, edge_reverse))),

            backlash.size.eq(self.backlash_size),
            backlash.pitch.eq(self.pitch),
            backlash.tick.eq(self.tick),
            backlash.pi.eq(self.pi),
            backlash.pi_reverse.eq(self.pi_reverse),
            backlash.moved.eq(moved),
            backlash.moved_reverse.eq(moved_reverse),
            backlash.safe.eq(self.safe),
            backlash.clear.eq(self.backlash_strobe),
            self.backlash_taken_up.eq(backlash.taken_up),
            self.fp.eq(backlash.fp),
            self.fp_reverse.eq(backlash.fp_reverse),

            counter.pi.eq(self.pi),
            counter.pi_reverse.eq(self.pi_reverse),
            counter.fp.eq(self.fp),
            counter.fp_reverse.eq(self.fp_reverse),
            counter.adopt.eq(adopt),
            self.command.eq(counter.command),
            self.position.eq(counter.position),
            self.error.eq(counter.error),
            self.status_saturated.eq(counter.saturated),
            self.damaged.eq(counter.damaged | backlash.damaged | coder.damaged),
        ]

        # The counter never takes its lowest code, so the magnitude needs one bit less.
        size = Signal(self.error_bits - 1)
        negative = Signal()
        m.d.sync += [
            size.eq((counter.error ^ counter.error[-1].replicate(self.error_bits))
                    + counter.error[-1]),
            negative.eq(counter.error[-1]),
        ]
        # The velocity command: Er and the feed-forward, less the lag that the drive has anyway. The
        # DAC's has what the drive needs besides.
        lag = Mux(self.ahead, drive_lag.lag, 0)
        beside = Signal(signed(OFFSET_BITS + 1))    # offset and friction
        less = Signal(signed(len(drive_lag.lag) + 1))
        m.d.sync += [
            beside.eq(self.mode_offset + Mux(supervision.up, self.mode_friction,
                                             Mux(supervision.down, -self.mode_friction, 0))),
            less.eq(beside - lag),
        ]
        told, backwards = self._command(m, counter.error, self.forward - lag, "told")
        sent, reverse = self._command(m, counter.error, self.forward + less, "sent")
        m.d.comb += [
            self.in_position.eq((size <= self.window) & backlash.done),

            dac.magnitude.eq(sent),
            dac.reverse.eq(reverse ^ self.mode_swap),
            dac.safe.eq(self.safe | self.mode_step),
            self.dac.eq(dac.pulse),
            self.dac_negative.eq(dac.negative),

            overshoot.mark.eq(self.mark),
            overshoot.reverse.eq(self.mark_reverse),
            overshoot.fp.eq(self.fp),
            overshoot.fp_reverse.eq(self.fp_reverse),
            overshoot.size.eq(size),
            overshoot.negative.eq(negative),
            self.overshoot.eq(overshoot.furthest),

            supervision.tick.eq(self.tick),
            supervision.gain.eq(self.model_gain),
            supervision.size.eq(told),
            supervision.negative.eq(backwards),
            supervision.standing.eq(self.in_position),
            supervision.resting.eq(self.resting),
            supervision.fp.eq(moved),
            supervision.fp_reverse.eq(moved_reverse),
            supervision.a.eq(encoder.a_level),
            supervision.b.eq(encoder.b_level),
            supervision.coarse.eq(coarse),
            supervision.on.eq(~self.safe & ~self.mode_step),
            supervision.clear.eq(adopt),
            self.status_check.eq(supervision.check),

            drive_lag.tick.eq(self.tick),
            drive_lag.share.eq(self.model_lag),
            drive_lag.tell.eq(supervision.tell),
            drive_lag.told.eq(supervision.told),
        ]

        # This counts down through 0 and stops at -1, so that its sign alone tells the end.
        rest = Signal(range(-1, self.rest_clocks), init=-1)
        resting = rest[-1]
        with m.If(self.pi):
            m.d.sync += rest.eq(self.rest_clocks - 1)
        with m.Elif(~resting):
            m.d.sync += rest.eq(rest - 1)

        too_far = size > Mux(resting, self.follow_stopped, self.follow_moving)
        m.d.sync += [
            self.following_stopped.eq(too_far & resting),
            self.following_moving.eq(too_far & ~resting),
        ]

        return m

    def _command(self, m, error, more, name):
        """Magnitude, at most full scale, and sign of Er and ``more``, which gets a register."""
        added = Signal(more.shape(), name=f"{name}_added")
        total = Signal(signed(self.error_bits + 2), name=f"{name}_total")
        size = Signal(self.error_bits + 1, name=name)
        negative = Signal(name=f"{name}_negative")
        m.d.comb += total.eq(error + added)
        m.d.sync += [
            added.eq(more),
            size.eq((total ^ total[-1].replicate(len(total))) + total[-1]),
            negative.eq(total[-1]),
        ]
        return Mux(size[FULL_SCALE_BITS:].any(), FULL_SCALE, size), negative
