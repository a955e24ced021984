# SPDX-License-Identifier: Apache-2.0
"""Fuzz the firmware with damaged tapes: ``python -m testbench.fuzz --cases 1000 --seed 1``.

Tapes are made from good ones by damage of text and of punched rows. A tape that takes a new way
through the code is kept and damaged further. Now and then the whole firmware gets a tape, together
with random lines, real-time bytes, broken frames and events. The process ends at the first
undefined behaviour that the sanitizer detects; otherwise with one line of figures.
"""

import argparse
import contextlib
import ctypes
import os
import random
import struct
import subprocess
import sys
import time

from host.errors import TapeError
from host.firmware import characters
from host.tape.codes import EIA, ISO
from softcore.image import address_runtime, host_library
from softcore.tables.settings import SETTINGS, assign
from testbench import programs
from testbench.firmware import STATES, Checker, Controller

KEPT = 400      # tapes that are grown further
WHOLE = 25      # every so many cases the whole firmware gets the tape
PLAN = ("$BD0,1,3", "$BA50", "$BI4,66,70,76", "$BI8,102,110,122", "$BP50,100,3")
PLAN_PASSES = 20_000
# What an operator or a host sends beside tapes and blocks: every word of docs/reference/link.md.
LINES = (
    "$X", "$POSITION=HERE", "$$", "$ES", "$#", "$RESUME", "$I", "$FIRMWARE", "$INPUTS",
    "$MEMORY", "$LEVELS", "$LEVELS=400,200", "$N", "$J=G91X1F600", "$J=G91Z-.1Y2F60", "$H",
    "$FROM=1", "$FROM=3", "$FROM=5", "$FROM=9", "$RST=$", "$RST=#", "$RST=*", "$C", "$SLP",
    "$WALK=.1", "$ES=412", "$EG", "$G", "$L", "$P", "$", "$BI4,9", "$BP50,100,3", "$SCOPE",
    "$SCOPE=NOW,50", "$SCOPE=SHORT,50", "$SCOPE=RISE,50,2000", "$SCOPE=STOP", "$SCOPE=FORCE",
    "$SCOPE=READ,0,9", "$SCOPE=READ,400,200",
    f"$FIRMWARE=B{characters(struct.pack('<II', 256, 0))}",
    f"$FIRMWARE=D{characters(bytes(132))}",
    "$FIRMWARE=BAAAA", "$FIRMWARE=E", "$FIRMWARE=K", "$FIRMWARE=C",
    "G38.2 Z-1 F60", "G38.4 X.5 F10", "G28", "G10 L20 P1 X1", "G39 P1", "$RETRACT")


def damaged_rows(rng, rows):
    """Damage of punched rows: bits, bytes, pieces."""
    rows = bytearray(rows)
    for _ in range(rng.choice((1, 1, 2, 8))):
        at = rng.randrange(len(rows) + 1)
        kind = rng.randrange(5)
        if kind == 0 and at < len(rows):
            rows[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del rows[at:at + rng.randint(1, 20)]
        elif kind == 2:
            rows[at:at] = bytes(rng.randrange(256) for _ in range(rng.randint(1, 9)))
        elif kind == 3:
            rows[at:at] = rows[at:at + rng.randint(1, 60)] * rng.randint(1, 8)
        else:
            rows[at:at] = rng.choice((ISO, EIA)).punch[rng.choice("GXZ0159./(%M ")].to_bytes()
    return bytes(rows[:20_000])


def grown(rng, corpus):
    """A new tape, made from a kept one or from scratch."""
    if not corpus or rng.random() < 0.2:
        blocks = programs.program(rng, rng.randint(1, 12))
        for _ in range(rng.randrange(3)):
            at = rng.randrange(len(blocks))
            blocks[at] = programs.damage(rng, blocks[at]).replace("%", "")
        texts = [text.translate({ord(c): None for c in ":;=*#$'@[]!\"<>?"}) for text in blocks]
        with contextlib.suppress(TapeError):    # a damaged call of a subprogram has no rows
            return programs.punched(texts, rng.choice((ISO, EIA)))
        return b"%"
    rows = rng.choice(corpus)
    if rng.random() < 0.3:
        other = rng.choice(corpus)
        rows = rows[:rng.randrange(len(rows) + 1)] + other[rng.randrange(len(other) + 1):]
    return damaged_rows(rng, rows) or b"%"


def whole(rng, rows, sanitize):
    """Run the whole firmware on a tape, with random disturbances in between."""
    machine = Controller(sanitize=sanitize, jump_axis=rng.choice((0, 2, 15)))
    if rng.random() < 0.9:
        machine.unlock()
    machine.library.gk_speed(rng.choice((0, 50, 1 << 30)))
    machine.line(rng.choice(("G36 R300 L1 H600 E60 Q.1", "G92 Z.05", "G00 X1", "$$",
                             assign("tv", 1))))
    for _ in range(rng.choice((0, 0, 1, 3))):
        machine.line(operators(rng))
    if rng.random() < 0.2:
        for line in PLAN:
            machine.line(line, PLAN_PASSES if line.startswith("$BP") else 100)
        machine.line(rng.choice(("G39 P1", "$BP50,1,3", assign("current_step_ma", 500))))
    pieces = [rows[at:at + 64] for at in range(0, len(rows), 64)][:40]
    frames = [(0, b""), *((len(piece), piece) for piece in pieces), (0xFF, b"")]
    for sequence, (length, payload) in enumerate(frames):
        data = Controller.framed(length, sequence % 256, payload)
        if rng.random() < 0.05:
            data = damaged_rows(rng, data)
        machine.send(data)
        machine.run(rng.choice((10, 100, 400)))
        for _ in range(rng.randrange(3)):
            _disturb(rng, machine)
    machine.run(400)


def operators(rng):
    """A line of the operator: one of ``LINES``, or a setting with any value."""
    if rng.random() < 0.7:
        return rng.choice(LINES)
    setting = rng.choice(SETTINGS)
    return f"${setting.number}={rng.choice((setting.lowest, setting.highest, rng.randrange(9)))}"


def _disturb(rng, machine):
    kind = rng.randrange(9)
    if kind == 8:
        line = programs.damage(rng, programs.block(rng)).encode("ascii", "ignore").decode()
        number, text = rng.randrange(3), rng.choice((line, "$RESUME", "$RETRACT", "$L"))
        sent = Controller.numbered(number, text)
        machine.send(sent if rng.random() < 0.7 else damaged_rows(rng, sent))
        if rng.random() < 0.3:
            machine.library.gk_send_broken()
    elif kind == 0:
        machine.send(rng.choice((b"?", b"!", b"~", b"~", b"\xb0", b"\x92", b"\x84", b"\x18")))
    elif kind == 1:
        machine.send(programs.damage(rng, programs.block(rng)).encode() + b"\n")
    elif kind == 2:
        machine.send(operators(rng).encode() + b"\n")
    elif kind == 3:
        machine.library.gk_event(rng.randrange(10), rng.randrange(6), rng.randrange(1 << 31),
                                 rng.randrange(1 << 31))
    elif kind == 4:
        machine.state(rng.choice(STATES))
    elif kind in (5, 6):
        machine.library.gk_go(rng.randint(-5000, 5000))
    elif rng.random() < 0.1:
        machine.library.gk_trip(rng.randrange(18), rng.randrange(8))
    machine.run(rng.choice((1, 10, 50)))


def fuzz(*, cases: int, seed: int, seconds: float, sanitize: str) -> str:
    """Run until ``cases`` or ``seconds`` are over; the figures of the run."""
    rng = random.Random(seed)
    checker = Checker(sanitize)
    library = ctypes.CDLL(str(host_library(sanitize)))
    corpus, fresh, ends = [], 0, time.monotonic() + seconds
    done = 0
    while done < cases and time.monotonic() < ends:
        rows = grown(rng, corpus)
        checker.check(rows, tv=rng.random() < 0.1)
        new = library.gk_coverage() if sanitize == "coverage" else rng.random() < 0.02
        if new:
            fresh += new
            if len(corpus) == KEPT:
                corpus.pop(rng.randrange(KEPT))
            corpus.append(rows)
        done += 1
        if done % WHOLE == 0:
            whole(rng, rows, sanitize)
    return f"{done} cases, {len(corpus)} tapes kept, {int(fresh)} ways through the code"


def under_address_sanitizer(arguments: list[str]) -> subprocess.CompletedProcess:
    """Run this script with the address sanitizer's runtime loaded first."""
    environment = {**os.environ, "LD_PRELOAD": str(address_runtime()),
                   "ASAN_OPTIONS": "detect_leaks=0"}  # Python itself leaks
    return subprocess.run([sys.executable, "-m", "testbench.fuzz", "--sanitize", "address",
                           *arguments], env=environment, capture_output=True, text=True,
                          check=False)


def main():
    """Read the command line, run, print the figures."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--cases", type=int, default=1_000_000_000)
    parser.add_argument("--seconds", type=float, default=1e9)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sanitize", default="coverage",
                        choices=("undefined", "coverage", "address"))
    print(fuzz(**vars(parser.parse_args())))


if __name__ == "__main__":
    main()
