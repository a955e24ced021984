# SPDX-License-Identifier: Apache-2.0
"""Random part programs, most of them right, and ways to damage them."""

import random

from host.tape.codes import ISO
from host.tape.tape import encode

LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


def number(rng: random.Random, *, signed=True, largest=99.0) -> str:
    """A number in one of the ways in which people write numbers."""
    sign = rng.choice(("", "", "-", "+")) if signed else ""
    decimals = rng.choice((0, 1, 2, 3, 4, 7, 11))
    text = f"{rng.uniform(0, largest):.{decimals}f}"
    if rng.random() < 0.2:
        text = "0" * rng.randint(1, 3) + text
    if decimals == 0 and rng.random() < 0.5:
        text += "."
    if rng.random() < 0.2 and text.startswith("0."):
        text = text[1:]
    return sign + text


def arc(rng: random.Random) -> list[str]:
    """Words of an arc; most of them have a consistent centre."""
    plane, first, second, third = rng.choice(((17, "XI", "YJ", "Z"), (18, "ZK", "XI", "Y"),
                                              (19, "YJ", "ZK", "X")))
    a, b = (round(rng.uniform(-9, 9), rng.choice((1, 3, 4, 6))) for _ in range(2))
    turned = rng.choice(((a, b), (-b, a), (-a, -b), (b, -a)))
    if rng.random() < 0.1:
        turned = turned[0] + rng.choice((0.00005, 0.0015, 0.0025)), turned[1]
    words = [f"G{plane}", "G91", rng.choice(("G2", "G03", "G02", "G3"))]
    if rng.random() < 0.9:
        words += [f"{first[0]}{turned[0] - a:.7f}", f"{second[0]}{turned[1] - b:.7f}"]
    if rng.random() < 0.3:
        words += [f"{third}{number(rng)}"]
    if rng.random() < 0.3:
        return [*words, f"R{rng.choice(('', '-'))}{rng.uniform(12, 30):.4f}"]
    return [*words, f"{first[1]}{-a:.7f}", f"{second[1]}{-b:.7f}"]


def block(rng: random.Random) -> str:
    """One block that is valid in most modal states."""
    move = [f"{axis}{number(rng)}" for axis in rng.sample("XYZ", rng.randint(1, 3))]
    kinds = [
        lambda: [rng.choice(("G00", "G1", "G01", "")), *move, f"F{number(rng, signed=False)}1"],
        lambda: [rng.choice(("G0", "G01", "")), *move],
        lambda: [rng.choice(("G90", "G91", "G20", "G21", "G94"))],
        lambda: arc(rng),
        lambda: arc(rng),
        lambda: [rng.choice(("G17", "G18", "G19", "G54", "G55", "G56 G00 X1", "G59", "G40"))],
        lambda: ["G10", f"P{rng.randint(1, 6)}", *move],
        lambda: ["G10", f"D{rng.randint(1, 15)}", f"R{number(rng, signed=False, largest=1)}"],
        lambda: ["G36", f"R{rng.randint(1, 90)}", f"L{rng.randint(5, 9)}.5",
                 f"H{number(rng, signed=False)}1", f"E{rng.randint(1, 90)}.",
                 f"Q{number(rng, signed=False, largest=5)}",
                 *([f"Z{number(rng)}"] if rng.random() < 0.3 else [])],
        lambda: ["G36", f"R{rng.randint(1, 90)}"],
        lambda: ["G38", f"P{rng.randint(0, 900)}", f"L{number(rng, signed=False)}1", "R90", "H8."],
        lambda: ["G39", *rng.choice((
            [rng.choice(("", "", "", "P1"))], [f"Z-{number(rng, signed=False)}", "C110"],
            [f"Z-{rng.randint(1, 9)}{number(rng, signed=False)}", f"C{rng.choice((120, 900))}"]))],
        lambda: ["G92", *move],
        lambda: [rng.choice(("G92.1", "G28.1", "G30.1", "G28", "G30"))],
        lambda: [rng.choice(("G28", "G30", "G91 G28", "G28G90")), *move],
        lambda: ["G53", *rng.choice((["G0"], ["G01"], [])), *move],
        lambda: rng.sample(("G49", "G61", "G64", "G80", "G98", "G99", "G90"), 3),
        lambda: ["G64", "P.01", *rng.choice(([], ["G1"], ["Q.1"])), *move],
        lambda: ["G10", rng.choice(("L2", "L20")), f"P{rng.randint(0, 6)}", *move],
        lambda: [rng.choice(("G94", "G94", "G95 P1", "G95P01", f"G95 P{rng.randint(1, 4)}"))],
        lambda: ["G10", f"C{rng.choice((130, 900))}", "P50", "Q50", f"V{rng.randint(0, 4)}.5",
                 f"U.{rng.randint(0, 9999)}"],
        lambda: ["G10", f"C{rng.choice((130, 900, rng.randint(901, 925)))}",
                 f"P{rng.randint(0, 300)}", f"Q{rng.randint(1, 90)}", *rng.sample(
                     (rng.choice(("I6", "I6.", "I3.004", "I3.02", "I64")), "R70",
                      f"E{rng.choice((20, 40, 60, 80, 120, 300, 310, 85))}",
                      f"H{rng.randint(15, 105)}", "K-1", "K1", "L.002",
                      f"X{rng.randint(0, 299)}", "Y5", "Z18", f"J{rng.randint(0, 6)}",
                      f"W{rng.randint(0, 270)}", f"S{rng.randint(0, 16)}",
                      f"F{rng.randint(0, 8)}", f"T{rng.choice((0, 4000, 1_000_001))}"),
                     rng.randint(0, 6))],
        lambda: ["G10", f"W{rng.randint(0, 4)}", "X3", "Y6", "Z14", f"H{rng.randint(50, 100)}"],
        lambda: ["G04", rng.choice((f"P{rng.randint(0, 50)}", "X0.05"))],
        lambda: [f"C{rng.choice((100, 110, 120, 130, 140, 150, 500, 900))}",
                 rng.choice(("M03", "M3", "M8"))],
        lambda: [rng.choice(("M05", "M9", "M01", "M77", "S100", "T5"))],
        lambda: ["M08", "M77", f"S{rng.randint(0, 999)}", f"T{rng.randint(0, 99)}"],
        lambda: [rng.choice(("(a comment; with G99)", "", "/ G99 A1", "; nothing"))],
    ]
    words = rng.choice(kinds)()
    if not words[0].startswith(("(", "/", ";")):
        rng.shuffle(words)
    if rng.random() < 0.2 and words != [""]:
        words.insert(0, f"N{rng.randint(1, 9999)}")
    return rng.choice(("", " ")).join(words)


def program(rng: random.Random, blocks: int) -> list[str]:
    """Blocks of a program, with its end."""
    head = ["G36R100L5H600E60Q.5", "C130G1F5", "G28.1", "G30.1"]
    return [*head, *(block(rng) for _ in range(blocks)), rng.choice(("M02", "M30"))]


def damage(rng: random.Random, text: str) -> str:
    """Change something in a block, so that it may be wrong."""
    at = rng.randrange(len(text) + 1)
    return rng.choice((
        lambda: text[:at] + text[at + 1:],
        lambda: text[:at] + rng.choice(LETTERS + "0123456789.+-/(): ") + text[at:],
        lambda: text[:at] + rng.choice(LETTERS + "0123456789.+-/():") + text[at + 1:],
        lambda: text + text,
        lambda: f"{text}{rng.choice(LETTERS)}{number(rng)}",
        lambda: f"{text} G{rng.randint(0, 99)}",
        lambda: f"{text}X{'9' * rng.randint(5, 14)}",
    ))()


def punched(blocks: list[str], code=ISO) -> bytes:
    """Rows of a tape of these blocks; the first of them stands on line 2."""
    return encode("\n".join(["%", *blocks, "%"]), code).rows
