# SPDX-License-Identifier: Apache-2.0
"""The fault classes as plain data: what is injected where, and the required outcome.

An earlier state of this controller did not stop ten of them (``F1`` to ``F10``); 22 more are
faults that a finished system must survive (``C1`` to ``C22``).
"""

from dataclasses import dataclass

from testbench.cosim import contact, faults, gates, limits, line, retractions, servo, tapes
from testbench.cosim.coder import jump_between_edges
from testbench.faults import scenes
from testbench.faults.cases import Case, Coder, Scene, Trial, planted, proof
from testbench.faults.flips import BORNE, bend_code, bend_memory, turn_over
from testbench.faults.outcome import Outcome
from testbench.formal.test_machine import test_safe_means_off
from testbench.punch import broken

__all__ = ["CLASSES", "FaultClass"]

NO_EFFECT, TOLD = Outcome.NO_EFFECT, Outcome.SAFE_TOLD
PINS = 6                # clocks from a pin to safe outputs, at 2 MHz
WATCHDOG = 10_002       # from the last call of the watchdog
SPLASHES = 100_006      # 50 ms of low fluid
CODER = 100_000         # slowest detection of a faulty coder in a cut


@dataclass(frozen=True)
class FaultClass:
    """A class of faults.

    ``injected`` and ``where`` say what is done; ``must`` is the required outcome. ``lacks`` says
    which part of the class cannot be injected here, and why; it may be all of the class.
    """

    number: str
    name: str
    injected: str
    where: str
    must: str
    cases: tuple[Case, ...] = ()
    lacks: str = ""


# ---- things done in a cut

def _force(name, value=1):
    return lambda job, rng: job.session.set(f"force.{name}", value)


def _axis(name):
    """A force by axis, on any of them."""
    return lambda job, rng: job.session.set(f"force.{name}", 1 << rng.randrange(3))


def _flip(register, bits):
    return lambda job, rng: job.session.poke(
        register, job.probe(register) ^ 1 << rng.randrange(bits))


def _stand_still(job, rng):
    job.session.poke("sleep_left", 0xFFFF)


def _brown_out(job, rng):
    job.session.set("force.brown_out", 1)
    job.session.run(rng.choice((1, 2, 10, 1000)))
    job.session.set("force.brown_out", 0)


def _glitches(job, rng):
    """A phase has the wrong level for one or two clocks, again and again."""
    for _ in range(100):
        name = rng.choice(("a_low", "a_high", "b_low", "b_high"))
        job.session.set(f"force.encoder_{name}", 7)
        job.session.run(rng.choice((1, 2)))
        job.session.set(f"force.encoder_{name}", 0)
        job.session.run(rng.randrange(20, 200))


def _jump(job, rng):
    jump_between_edges(job.session)


# ---- scenes

def _tapes(*names):
    for name in names:
        assert name in broken(), name
    return Scene(f"tape {', '.join(name.removesuffix('.ptp') for name in names)}",
                 tapes.broken_tapes, {"names": list(names)})


def _way(name):
    return dict(zip(("blocks", "highest"), contact.WAYS[name], strict=True))


def _hung(kind):
    """A processor without a program cannot report it; the gateware does."""
    return Scene(f"processor: its {'clock stands' if kind == 'clock' else 'program is gone'}",
                 faults.hung, lambda seed: {"kind": kind, "delay": 1237 * seed % 10_000})


def _browned_out(clocks):
    return Scene(f"supply gone for {clocks} clocks", faults.browned_out,
                 {"clocks": clocks, "accepted": False})


BROKEN_CHARACTER = Scene("the point of `G00 Z-0.5` without its stop bit", line.broken_character,
                         {"at": 7})
STRAY_START = Scene("0x02, then `!`", line.stray_start, {"stop": b"!"}, (NO_EFFECT,))
STUCK = Scene("main gate, in a cut", gates.stuck, {"kind": "main", "when": "cut"})
IN_HOLE = {"machine": "wire", "tables": lambda: contact.with_hole(0.5)}
SETTINGS = Scene("eight settings that guard, M03 on and in a cut", scenes.settings_in_a_cut)
RESET = Scene("Ctrl-X in a cut", scenes.reset_in_motion)
GUARDED = tuple(
    Trial(f"a bit of {what}", _flip(register, bits), 6, count=3) for what, register, bits in (
        ("an axis' command", "guard_command", 32), ("the place on the path", "window_offset", 30),
        ("the parity of the segment", "window_parity", 1),
        ("the count of path pulses", "guard_apart", 32),
        ("a soft limit", "axis_y_low", 31), ("the latch of the interlock", "latch_double", 18)))

CLASSES = (
    FaultClass(
        "F1", "a lost coder", "coder cut, open, stuck in a phase, swapped, noisy",
        "the coder's lines, every machine and situation",
        "trip with axis and cause, less than 0.3 mm from where it would have been; position lost",
        (Coder("F300", "z", "cut"), Coder("F12", "z", "cut"), Coder("F1200", "z", "a_low"),
         Coder("rest, then G00", "x", "open"), Coder("retracting", "z", "b_high"),
         Coder("F300", "y", "swap", "wire"), Coder("hold", "x", "cut", "wire"))),
    FaultClass(
        "F2", "contact with the discharge off", "the work stands in the way",
        "the gap, without C and M03",
        "halt within 8 clocks with alarm 152, or trip above the start/stop speed; never the end",
        (Scene("G01 at F120", contact.touches, _way("feed")),
         Scene("G00", contact.touches, _way("rapid")), Scene("G03", contact.touches, _way("arc")),
         Scene("wire, G01 aside", contact.touches,
               {"blocks": "G01 X-1 Y0.5 F300", "highest": 300, "hole_mm": 0.5}, **IN_HOLE))),
    FaultClass(
        "F3", "a gate that stays on", "main or sensing gate stuck, transistor shorted",
        "the power supply", "safe within 1 ms of the end of the pulse, contactor off, named",
        (STUCK, Scene("sensing gate, idle", gates.stuck, {"kind": "sensing", "when": "idle"}),
         Scene("transistor, in a short", gates.stuck, {"kind": "shorted", "when": "short"}))),
    FaultClass(
        "F4", "a link that loses and bends", "framing errors, stray starts, bytes from 0x80, flood",
        "the serial line",
        "the line is refused whole and named, `!` acts at once, no watchdog trips",
        (BROKEN_CHARACTER, STRAY_START,
         Scene("0x02, then Ctrl-X", line.stray_start, {"stop": b"\x18"}),
         Scene("bytes from 0x80 on", line.strange_character),
         Scene("3 kB of short lines in a cut", line.burst, {"piece": line.PIECES[0]}))),
    FaultClass(
        "F5", "settings under fire", "`$426=0`, `$416=4`, `$417=4` and five more",
        "the link, machining", "refused; what they guard is in force", (SETTINGS,)),
    FaultClass(
        "F6", "the place after a reset in motion", "Ctrl-X, and the supply gone for some clocks",
        "link and supply",
        "the true place is told, or it is told to be lost; nothing goes on by itself",
        (RESET, _browned_out(1), _browned_out(20_000))),
    FaultClass(
        "F7", "no hand on the machine", "`$X`, M03 and a tape over the link; a limit switch",
        "the link; the travel",
        "no discharge without `arm`; off a switch only away from it, slowly",
        (Scene("nobody presses `arm`", scenes.nobody_presses),
         Scene("off a limit switch", scenes.off_the_switch))),
    FaultClass(
        "F8", "bent bits",
        "bits of guarded registers and of the memory; a processor that stands, or lost its program",
        "gateware, processor",
        "trip within some clocks, or by the watchdog; named, if need be by the gateware",
        (*GUARDED, Trial("a bit of every word of the main loop", bend_code, WATCHDOG),
         Trial("any bit of the memory", bend_memory, None, (NO_EFFECT, TOLD), count=10),
         _hung("clock"), _hung("memory")),
        "Interrupts off and jumps of the program counter: they need a hand inside the processor."),
    FaultClass(
        "F9", "tests that let breaks through", "changes of the source, on purpose", "the source",
        "a test fails by its own word",
        (planted("softcore/firmware/path/path.c: the ceiling of a block that ends above it"),),
        "One of more than a hundred; `make soak TESTS=testbench/breaks` plants them all."),
    FaultClass(
        "F10", "proofs that stop at the parts", "every input, every state", "the whole controller",
        "safe means that every output is off, by induction", (proof(test_safe_means_off),),
        "One of the proofs of the whole controller; `testbench/formal` has the others."),
    FaultClass(
        "C1", "tape parity", "one bit of one row turned over", "a tape",
        "refused, with block and character; nothing of the block is carried out",
        (Scene("20 bits", tapes.flipped_bits, lambda seed: {"count": 20, "choice": seed}),
         _tapes("parity_flip.ptp", "parity_flip.eia.ptp", "parity_in_comment.ptp"))),
    FaultClass(
        "C2", "truncated tape", "a tape that ends anywhere", "a tape",
        "no motion of the block that is not whole; the alarm names it",
        (Scene("10 places", tapes.cut_short, lambda seed: {"count": 10, "choice": seed}),
         _tapes("truncated.ptp", "missing_start.ptp", "damaged_start.ptp"))),
    FaultClass(
        "C3", "wrong code", "ISO that goes on in EIA, holes that are no character", "a tape",
        "refused before the first motion of the foreign part",
        (_tapes("other_code.ptp", "no_character.ptp", "blank_in_data.eia.ptp"),)),
    FaultClass(
        "C4", "no end of block, block too long", "a block of 300 characters, no end word", "a tape",
        "refused at the exact character", (_tapes("over_long_block.ptp", "missing_end.ptp"),)),
    FaultClass(
        "C5", "number too large or malformed", "14 digits, two decimal points", "a tape",
        "refused, with the character", (_tapes("number_overflow.ptp", "number_malformed.ptp"),)),
    FaultClass(
        "C6", "unknown, double or conflicting words", "such words", "a tape",
        "refused, with the word",
        (_tapes("unknown_word.ptp", "unknown_code.ptp", "word_twice.ptp", "open_comment.ptp",
                "limit_below_changeover.ptp", "zero_speed.ptp", "incomplete_data.ptp"),)),
    FaultClass(
        "C7", "beyond the travel", "limit switches; a limit that firmware does not know",
        "the travel", "trip; at a soft limit not a pulse further",
        (Trial("lower switch of any axis", _axis("limit_low"), 8, count=3),
         Trial("upper switch of any axis", _axis("limit_high"), 8, count=3),
         Scene("soft limit in the gateware", limits.soft_limit))),
    FaultClass(
        "C8", "encoder loss", "a phase or both", "the coder's lines of any axis, in a cut",
        "trip with axis and cause; position lost",
        (Trial("both cut", _axis("encoder_cut"), CODER, count=3),
         Trial("plug off", _axis("encoder_open"), CODER, count=3),
         Trial("A low", _axis("encoder_a_low"), CODER, count=2),
         Trial("B high", _axis("encoder_b_high"), CODER, count=2),
         Trial("wire machine, X cut", _force("encoder_cut", 1), CODER, machine="wire"))),
    FaultClass(
        "C9", "encoder noise", "glitches of one or two clocks; edges of nothing; double edges",
        "the coder's lines", "glitches: no count is lost; the others trip",
        (Trial("100 glitches", _glitches, None, (NO_EFFECT,), count=3),
         Trial("both phases at once", _jump, 300, count=5), Coder("F300", "z", "a_noise")),
        "Both phases at once within three clocks of a true edge look like one edge the other way: "
        "nothing can tell, and the count is off by two pulses. Not tried, for it is known."),
    FaultClass(
        "C10", "stuck short", "a short that stays", "the gap",
        "retraction, and the alarm at its limit; not a pulse forwards",
        (Scene("on the path", retractions.never_clearing, {"speed": 300}),
         Scene("under servo", servo.stuck_short),
         Trial("in a cut, any phase", _force("short"), None, count=3))),
    FaultClass(
        "C11", "stuck open", "no discharge comes; no progress", "the gap",
        "not further than allowed without a discharge, or for longer without progress; alarm",
        (Scene("no discharge", servo.stuck_open), Scene("no progress", servo.never_down))),
    FaultClass(
        "C12", "fluid", "the level falls; the cell's wire broken, shorted, its converter silent",
        "the fluid", "off 50 ms after the level fell; an alarm where its class cannot be known",
        (Trial("level", _force("fluid_low"), SPLASHES, count=2),
         *(Scene(f"cell {trouble}", servo.cell, {"trouble": trouble})
           for trouble in servo.TROUBLES)),
        "Heat and flow have no input of their own: they hang on the level's or a drive's contact."),
    FaultClass(
        "C13", "processor hangs", "its clock stands, its program is gone", "processor",
        "off after the watchdog's period",
        (Trial("clock stands", _stand_still, WATCHDOG, count=3), _hung("clock"), _hung("memory")),
        "A storm of interrupts and a bent program counter need a hand inside the processor."),
    FaultClass(
        "C14", "bits that turn over", "bits of the guarded registers, and of any", "gateware",
        "the guarded ones trip within six clocks, named; of the others none makes it run away",
        (*GUARDED, Trial("any bit of any register", turn_over, None, BORNE, count=20),
         Trial("any bit of the memory", bend_memory, None, (NO_EFFECT, TOLD), count=20)),
        "Bits of the processor's caches, which are arrays of their own in the model."),
    FaultClass(
        "C15", "asynchronous inputs, the clock", "", "every input",
        "synchronised; a clock that stops is found outside",
        lacks="In a simulation every input is in step with the clock; `unit/rtl/test_pads.py` "
              "checks that each comes through its synchroniser. A clock that stops stops the "
              "simulation: it takes a circuit outside that falls off without pulses; no board "
              "has one yet."),
    FaultClass(
        "C16", "power loss", "the supply gone for 1 to 1000 clocks, in a cut", "supply",
        "safe at once; locked and lost afterwards",
        (Trial("any phase", _brown_out, PINS, count=6), _browned_out(1)),
        "The supply gone while settings or the place of a job are stored: see "
        "`unit/firmware/test_journal.py`, `cosim/test_journal.py` and "
        "`unit/host/test_interrupted.py`."),
    FaultClass(
        "C17", "serial line", "overrun, framing errors, bytes lost and doubled", "the serial line",
        "nothing bent is carried out; what is lost is told",
        (BROKEN_CHARACTER, Scene("a noisy line", tapes.noisy_line, expected=(NO_EFFECT, TOLD)),
         Scene("`?` without end", line.burst, {"piece": b"?"}, (NO_EFFECT, TOLD))),
        "A wrong baud rate: the simulated line has the controller's own. See "
        "`unit/softcore/test_uart.py`."),
    FaultClass(
        "C18", "mad host", "nonsense, right lines at the wrong time, torn frames",
        "the serial line", "no discharge without a hand, no watchdog trips",
        (Scene("10 000 bytes", scenes.mad_host, lambda seed: {"count": 10_000, "choice": seed}),)),
    FaultClass(
        "C19", "tape reader jams", "the tape stops within a frame for half a second", "the tape",
        "it waits, and goes on without losing a row",
        (Scene("a frame torn in two", scenes.jammed_reader, expected=(NO_EFFECT, TOLD)),)),
    FaultClass(
        "C20", "reset, brown-out", "the supply gone, Ctrl-X, `!` in a torn frame", "supply, link",
        "outputs off during and after; the true place or none",
        (Trial("any phase", _brown_out, PINS, count=4), RESET,
         Scene("`!` in a torn frame", scenes.held_by_terminal, expected=(NO_EFFECT, TOLD)))),
    FaultClass(
        "C21", "wire break, collision", "the wire's drive reports it; the work stands in the way",
        "wire machine; travel", "trip; position kept",
        (Trial("wire broken", _force("drive_fault", 4), PINS, machine="wire", count=2),
         Scene("collision in G00", contact.touches, _way("rapid")))),
    FaultClass(
        "C22", "generator does not switch off", "gate stuck, also found after another trip",
        "the power supply", "safe within 1 ms, contactor off, named",
        (Trial("main gate, any phase", _force("gate_stuck", 1), 2000, count=3), STUCK,
         Scene("after the emergency stop", gates.later))),
)
