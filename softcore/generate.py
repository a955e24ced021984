# SPDX-License-Identifier: Apache-2.0
"""Write the files derived from the tables: ``python -m softcore.generate``."""

import hashlib
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from constraints.boards import BOARDS
from softcore import linkmap, render
from softcore.pins import alike, board_drawing, drawn, pins_page
from softcore.registers import AXES, Block
from softcore.regmap import BASE, BLOCKS
from softcore.tables.causes import CAUSES
from softcore.tables.conditions import CONDITIONS
from softcore.tables.events import EVENTS
from softcore.tables.faults import FAULTS
from softcore.tables.grbl import GRBL_SETTINGS
from softcore.tables.settings import SETTINGS
from softcore.tables.states import CHECKS, MOTION, PULSES
from softcore.texts import PARTS

HERE = Path(__file__).parent
FIRMWARE = HERE / "firmware"
REFERENCE = HERE.parent / "docs" / "reference"
NOTICE = ("Generated from regmap.py, flashmap.py, linkmap.py, scopemap.py and tables/ in softcore "
          "by `python -m softcore.generate`; do not edit.")


def _kind(block: Block) -> str:
    """Name of a block's C struct. The blocks of all axes share one struct."""
    return "axis" if block.name.startswith("axis_") else block.name


def _struct(block: Block) -> list[str]:
    kind = _kind(block)
    lines = [f"/* {block.doc} */" if kind == block.name else "/* One axis. */",
             "typedef volatile struct {"]
    for register in block.registers:
        lone = register.fields[0] if len(register.fields) == 1 else None
        ctype = "int32_t" if lone and lone.signed else "uint32_t"
        const = "const " if all(f.access == "r" for f in register.fields) else ""
        unit = f" [{lone.unit}]" if lone and lone.unit else ""
        lines.append(f"    {const}{ctype} {register.name}; /* {register.doc}{unit} */")
    lines.append(f"}} {kind}_regs;")
    lines += [f'_Static_assert(offsetof({kind}_regs, {r.name}) == 0x{r.offset:x}, "");'
              for r in block.registers]
    for register in block.registers:
        shift = 0
        for field in register.fields:
            if len(register.fields) > 1 or field.bits < 32:
                stem = f"{kind}_{register.name}_{field.name}".upper()
                lines.append(f"#define {stem}_SHIFT {shift}")
                lines.append(f"#define {stem}_MASK 0x{((1 << field.bits) - 1) << shift:08x}u")
            shift += field.bits
    return lines


def c_header(blocks: Sequence[Block] = BLOCKS) -> str:
    """C header: a struct per kind of block, its address, and a mask and shift per field."""
    lines = [f"/* {NOTICE} */", "#pragma once", "#include <stddef.h>", "#include <stdint.h>", ""]
    done = set()
    for block in blocks:
        kind = _kind(block)
        if kind in done:
            continue
        done.add(kind)
        lines += _struct(block)
        if kind == block.name:
            lines.append(f"#define {kind.upper()} (({kind}_regs *)0x{BASE + block.base:08x}u)")
        else:
            siblings = [b for b in blocks if _kind(b) == kind]
            pitch = siblings[1].base - siblings[0].base
            lines.append(f"#define {kind.upper()}(i) (({kind}_regs *)(0x{BASE + block.base:08x}u "
                         f"+ 0x{pitch:x}u * (i)))")
        lines.append("")
    lines += ["/* Causes of the interlock, by bit of SAFETY->live and SAFETY->latched. */"]
    lines += [f"#define CAUSE_{cause.name.upper()} {index}" for index, cause in enumerate(CAUSES)]
    lines += [f"#define CAUSES {len(CAUSES)}", f"#define AXES {len(AXES)}"]
    lines += ["", "/* Bytes of the link; marks by LINK->receive. */"]
    lines += [f"#define REALTIME_{realtime.name.upper()} 0x{realtime.byte:02x}u"
              for realtime in linkmap.REALTIME]
    lines += [f"#define REALTIME_DOOR 0x{linkmap.DOOR:02x}u",
              "#define REALTIME_PASSED_OVER(byte) (" + " || ".join(
                  f"(byte) == 0x{byte:02x}u" for byte in sorted(linkmap.PASSED_OVER)) + ")"]
    # For the model of the link on a computer.
    lines += [f"#define OVERRIDE_{name.upper()}_{end} {value}"
              for name, ends in linkmap.OVERRIDES.items()
              for end, value in zip(("LEAST", "MOST"), ends, strict=True)]
    lines += [f"#define OVERRIDE_BYTES(row) {' '.join(map(_override, linkmap.OVERRIDE_BYTES))}"]
    lines += [f"#define MARK_{name.upper()} {number}"
              for number, (name, _) in enumerate(linkmap.MARKS)]
    lines += [f"#define {name} 0x{getattr(linkmap, name):02x}u"
              for name in ("FRAME_START", "FRAME_END", "FRAME_ESCAPE", "FRAME_FLIP")]
    return "\n".join(lines) + "\n"


def edition() -> int:
    """Digest of all that the firmware knows of the gateware: registers, events, bytes of the link.

    Firmware and gateware fit together if it is the same for both. It covers the descriptions too:
    a changed meaning is another edition.
    """
    known = c_header() + render.events_header(EVENTS) + render.states_header(MOTION, CHECKS)
    return int.from_bytes(hashlib.sha256(known.encode()).digest()[:4], "little")


def edition_header() -> str:
    """C header with the edition, for ``start.S`` too."""
    return f"/* {NOTICE} */\n#define GATEWARE_EDITION 0x{edition():08x}\n"


def _override(one: linkmap.Override) -> str:
    """Row of a byte that changes an override: byte, override, value to set or 0, step."""
    return f"row(0x{one.byte:02x}u, {one.of}, {one.to or 0}, {one.by})"


def realtime_page() -> str:
    """Page of the real-time bytes, and of the overrides' effect on each motion, in Markdown."""
    bytes_ = {one.byte: one.doc for one in linkmap.REALTIME}
    bytes_ |= {linkmap.DOOR: "As `!` (the safety door of grbl)."}
    bytes_ |= {one.byte: f"Override of {one.doc}." for one in linkmap.OVERRIDE_BYTES}
    bytes_ |= {byte: f"Nothing: it {why}." if not why.startswith("grbl") else f"Nothing: {why}."
               for byte, why in linkmap.PASSED_OVER.items()}
    (low, high), (slow, fast) = linkmap.OVERRIDES["feed"], linkmap.OVERRIDES["rapid"]
    lines = [
        "# Real-time bytes", "",
        "The gateware takes these bytes out of the stream, whatever came before them. In the "
        "middle of a line they do not damage it. Other bytes from 0x80 on have no meaning: between "
        "lines they are dropped, and a line that has one is refused. A frame contains none of "
        "them.", "",
        "| byte | meaning |", "| --- | --- |",
        *(f"| {_byte(byte)} | {doc} |" for byte, doc in sorted(bytes_.items())),
        "", "## Overrides", "",
        f"The override of the feed is {low} to {high} %, that of rapids {slow} to {fast} %. Both "
        "are 100 % at power-on, after Ctrl-X and after the end of a program. They act at once, "
        "also in the present block, with the ramp's acceleration. `Ov:` of the status report shows "
        "them; its third number, the spindle's in grbl, is always 100.", "",
        "| motion | override that scales it | |", "| --- | --- | --- |",
        *(f"| {what} | {which or 'nothing'} | {why} |" for what, which, why in linkmap.FEEDS),
        "",
        "On a guarded link (numbered lines) the overrides, like `~` and 0xB0, do nothing, so that "
        "no damaged byte can make the machine faster.", "",
        "0x85, `!`, 0x84, and silence of the host end a [jog](../how-to/operate.md): the axes slow "
        "down by the ramp, what is left of the path is forgotten, and the state is `Idle` without "
        "a hold. Jogs that were received before and still wait are refused by `error:172`. These "
        "bytes end a jog on a guarded link, too.", "",
        "0x9E switches the discharge off, only in `Hold:0`. It never switches it on. The order to "
        "resume does, as after M00, if the discharge is still armed; if not, the hold stays.",
    ]
    return "\n".join(lines) + "\n"


def _byte(byte: int) -> str:
    name = {0x18: "Ctrl-X, "}.get(byte, "")
    return f"`{chr(byte)}`" if 0x20 < byte < 0x7F else f"{name}0x{byte:02X}"


def reference(blocks: Sequence[Block] = BLOCKS) -> str:
    """Register reference in Markdown."""
    lines = [f"<!-- {NOTICE} -->", "# Registers", "",
             f"Base address 0x{BASE:08x}; registers are 32 bits wide, read and written whole."]
    for block in blocks:
        lines += ["", f"## `{block.name}` +0x{block.base:03x}", "", block.doc]
        for register in block.registers:
            lines += ["", f"### `{register.name}` +0x{register.offset:02x}", "", register.doc, "",
                      "| bits | field | access | reset | unit | meaning |",
                      "| --- | --- | --- | --- | --- | --- |"]
            shift = 0
            for f in register.fields:
                bits = f"{shift + f.bits - 1}:{shift}" if f.bits > 1 else f"{shift}"
                sign = " (signed)" if f.signed else ""
                lines.append(f"| {bits} | `{f.name}`{sign} | {f.access} | {f.init} | {f.unit} "
                             f"| {f.doc} |")
                shift += f.bits
    return "\n".join(lines) + "\n"


COMMENTS = {".md": "<!-- {} -->", ".svg": "<!-- {} -->", ".py": "# {}", ".c": "/* {} */",
            ".h": "/* {} */"}


def _made(path: Path, source: str, render_it: Callable[[], str]) -> tuple[Path, Callable[[], str]]:
    """Text of a generated file. Its first line names the table that it is made from."""
    source = source if "/" in source else f"softcore/tables/{source}.py"
    notice = f"Generated from {source} by `python -m softcore.generate`; do not edit."
    return path, lambda: COMMENTS[path.suffix].format(notice) + "\n" + render_it()


PINS = "constraints/pads.py and the boards"
BASE_ROOM, HAL_ROOM = FIRMWARE / "base", FIRMWARE / "hal"
OUTPUTS: dict[Path, Callable[[], str]] = {
    HAL_ROOM / "regs.h": c_header,
    HAL_ROOM / "edition.h": edition_header,
    REFERENCE / "registers.md": reference,
} | dict((
    _made(BASE_ROOM / "settings_table.h", "settings", lambda: render.settings_header(SETTINGS)),
    _made(BASE_ROOM / "settings_table.c", "settings", lambda: render.settings_source(SETTINGS)),
    _made(BASE_ROOM / "grbl_table.h", "grbl", lambda: render.grbl_header(GRBL_SETTINGS)),
    _made(BASE_ROOM / "grbl_table.c", "grbl", lambda: render.grbl_source(GRBL_SETTINGS)),
    _made(REFERENCE / "settings.md", "settings", lambda: render.settings_page(SETTINGS)),
    _made(BASE_ROOM / "fault_codes.h", "faults", lambda: render.faults_header(FAULTS)),
    _made(BASE_ROOM / "cause_texts.h", "causes", lambda: render.causes_header(CAUSES)),
    _made(REFERENCE / "alarms.md", "faults", lambda: render.faults_page(FAULTS)),
    _made(BASE_ROOM / "text_parts.h", "pairs", lambda: render.parts_header(PARTS)),
    _made(HAL_ROOM / "event_kinds.h", "events", lambda: render.events_header(EVENTS)),
    _made(HERE.parent / "rtl" / "events.py", "events", lambda: render.events_gateware(EVENTS)),
    _made(HAL_ROOM / "states.h", "states", lambda: render.states_header(MOTION, CHECKS)),
    _made(HERE.parent / "rtl" / "states.py", "states",
          lambda: render.states_gateware(MOTION, CHECKS, PULSES)),
    _made(FIRMWARE / "gap" / "built_in.h", "conditions",
          lambda: render.conditions_header(CONDITIONS)),
    _made(REFERENCE / "conditions.md", "conditions", lambda: render.conditions_page(CONDITIONS)),
    _made(REFERENCE / "pins.md", PINS, lambda: pins_page(BOARDS)),
    *(_made(REFERENCE / drawn(same[0]), PINS, partial(board_drawing, same))
      for same in alike(BOARDS)),
    _made(REFERENCE / "realtime-bytes.md", "softcore/linkmap.py", realtime_page),
    _made(REFERENCE / "events.md", "events", lambda: render.events_page(EVENTS)),
))

if __name__ == "__main__":
    for path, made in OUTPUTS.items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(made())
