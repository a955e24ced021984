# SPDX-License-Identifier: Apache-2.0
"""Each table exists once: it is well formed, and generated text follows a change of one entry.

``test_registers`` checks that no generated file is stale.
"""

import re
from dataclasses import replace

import pytest
from amaranth.hdl import Shape

from constraints import ulx3s
from constraints.pads import CHAIN, FIXED, FLASH_CLOCK, PADS
from constraints.wires import resource
from host import alarms
from host.run.events import EventError, Scale, parse
from host.scope import record
from rtl import pads
from rtl.events import Cause, Event, Halt, Happened, Phase, Queued, Reason
from rtl.states import Check, Pulse, State
from softcore import render
from softcore.image import SOURCES
from softcore.pins import board_drawing, pins_page
from softcore.tables import causes, conditions, events, faults, settings, states
from softcore.tables.conditions import CONDITIONS
from softcore.tables.events import EVENTS
from softcore.tables.faults import FAULTS
from softcore.tables.grbl import GRBL_SETTINGS
from softcore.tables.references import filled, plain
from softcore.tables.settings import SETTINGS


def altered(table, name, /, **changes):
    """A copy of a table with one entry changed."""
    assert [one.name for one in table].count(name) == 1
    return tuple(replace(one, **changes) if one.name == name else one for one in table)


def cells(page, first):
    """Cells of the one row of a Markdown page's tables that begins with a cell."""
    found = [line for line in page.splitlines() if line.startswith(f"| {first} |")]
    assert len(found) == 1, first
    return [cell.strip() for cell in found[0].strip("|").split("|")]


# ---- settings


def test_settings_are_well_formed():
    for one in SETTINGS:
        assert 0 <= one.lowest <= one.default <= one.highest < 1 << 32, one.name
        assert re.fullmatch("[a-z][a-z0-9_]*", one.name), one.name
        assert one.meaning.endswith("."), one.name
        assert one.group in settings.GROUPS, one.name
        assert one.guards or not one.switches_off, one.name
        assert filled(one.meaning), "or a name that it cites is unknown"
        assert not re.search(r"\$\d|[Aa]larm \d", one.meaning), f"{one.name} cites a bare number"
    for key in ("number", "name", "title"):
        assert len({getattr(one, key) for one in SETTINGS}) == len(SETTINGS), key
    assert min(one.number for one in SETTINGS) == settings.FIRST


def test_settings_of_grbl_are_well_formed():
    numbers = [one.number for one in GRBL_SETTINGS]
    assert numbers == sorted(set(numbers))
    assert numbers[-1] < settings.FIRST, "those from there on are ours"
    for one in GRBL_SETTINGS:
        assert filled(one.meaning).endswith("."), one.number
        assert len(one.follows) <= 2, one.number
        assert all(settings.named(name) for name in one.follows), one.number
        assert one.source == "constant" or not one.value, one.number
    # `$ES` has this sign between what it tells.
    assert not [one.title for one in (*SETTINGS, *GRBL_SETTINGS) if "|" in one.title + one.unit]


def test_a_setting_of_grbl_is_changed_in_one_place():
    table = tuple(replace(one, number=114, title="haste of Y", follows=("repeats",))
                  if one.number == 111 else one for one in GRBL_SETTINGS)
    assert "    {114, GRBL_SPEED, 1, {SET_REPEATS, SETTINGS},\n        \"haste of Y\", " in (
        render.grbl_source(table))
    page = render.settings_page(altered(SETTINGS, "repeats", number=508), grbl=table)
    assert cells(page, "`$114`")[1:4] == ["haste of Y", "mm/min", "`$508`"]
    assert "`$111`" not in page
    assert cells(page, "`$10`")[3] == "fixed"
    assert f"#define GRBL_ROWS {len(table) - 1}u" in render.grbl_header(table[1:])


def test_a_setting_is_changed_in_one_place():
    table = altered(SETTINGS, "no_progress_s", number=699, highest=7, default=5, unit="min",
                    guards=False, title="new title", meaning="New meaning.")
    source = render.settings_source(table)
    units = list(dict.fromkeys(one.unit for one in table))
    assert '    {5, 0, 7, "new title",\n' \
           f'        699, {units.index("min")}, GROUP_GAP, false, false}},' in source
    assert '    {SET_NO_PROGRESS_S, "no progress"},' in source
    assert '    "min",' in source
    assert cells(render.settings_page(table), "`$699`") == [
        "`$699`", "`no_progress_s`", "min", "5", "0 to 7", "no program", "New meaning."]
    assert "| `$444` |" not in render.settings_page(table)
    assert settings.assign("no_progress_s", 7, table) == "$699=7"
    with pytest.raises(ValueError, match=r"^setting 699 \(no_progress_s\) must be 0 to 7, not 8$"):
        settings.assign("no_progress_s", 8, table)


def test_a_setting_more_is_one_more_everywhere():
    table = (*SETTINGS, replace(SETTINGS[0], number=499, name="fresh"))
    assert "    SET_FRESH,\n    SETTINGS,\n" in render.settings_header(table)
    source = render.settings_source(table)
    assert source.count("GROUP_") == render.settings_source(SETTINGS).count("GROUP_") + 1
    assert "        499, 0, GROUP_DETECTOR, true, false},\n};" in source, "the last row"
    assert cells(render.settings_page(table), "`$499`")[1] == "`fresh`"
    assert settings.of_number(499, table).name == "fresh"
    assert settings.of_number(499) is None


def test_no_setting_of_an_unknown_name():
    with pytest.raises(KeyError, match="nothing"):
        settings.assign("nothing", 1)


def test_a_meaning_follows_the_number_that_it_cites():
    table = altered(SETTINGS, "short_window", number=501)
    page = render.settings_page(table, altered(FAULTS, "halt_burst", number=243))
    assert "(`$501`)" in cells(page, "`$400`")[-1]
    assert cells(page, "`$408`")[-1].startswith("Alarm 243 comes ")


# ---- alarms and errors


def test_faults_are_well_formed():
    for one in FAULTS:
        assert re.fullmatch("[a-z][a-z_]*", one.name), one.name
        assert one.part in faults.PARTS, one.name
        assert not re.search(r"%|\.$", one.sentence), one.name
        for text in (one.cause, one.remedy):
            assert re.match("[A-Z`].*[.]$", filled(text)), one.name
            assert not re.search(r"\$\d|[Aa]larm \d", text), f"{one.name} cites a bare number"
            assert not re.search(r"[`\]{}]", plain(filled(text))), one.name
    for key in ("number", "name", "sentence"):
        assert len({getattr(one, key) for one in FAULTS}) == len(FAULTS), key
    assert min(one.number for one in FAULTS) >= faults.FIRST
    # What the page calls alarms is told by number alone: no two have the same.
    assert len({one.alarm for one in FAULTS}) == len(FAULTS)
    # Numbers of grbl 1.1: errors 1 to 38, alarms 1 to 10; 0 for none.
    assert {one.grbl_error for one in FAULTS} < set(range(39))
    assert {one.grbl_alarm for one in FAULTS} < set(range(11))


def test_numbers_of_grbl_are_told_where_it_has_the_same():
    assert faults.error_line("locked") == "error:9"
    assert faults.alarm_line("travel") == "ALARM:2"
    assert faults.error_line("travel") == "error:134"
    assert faults.alarm_line("stuck") == "ALARM:156"
    assert faults.of_error(9).name == "locked"
    assert faults.of_alarm(10) is None
    table = altered(altered(FAULTS, "locked", grbl_error=0), "stuck", grbl_alarm=7, grbl_error=5)
    header = render.faults_header(table)
    assert "FAULT_LOCKED, 9" not in header
    errors, alarms = header.split("#define FAULT_ERRORS")[1].split("#define FAULT_ALARMS")
    assert "{FAULT_STUCK, 5}" in errors
    assert "{FAULT_STUCK, 7}" in alarms
    page = render.faults_page(table)
    assert "### 156, `error:5`, `ALARM:7`: nothing moves" in page
    assert "### 137: the machine is locked" in page


def test_a_fault_is_changed_in_one_place():
    table = altered(FAULTS, "stuck", number=256, sentence="it stands", cause="A cause.",
                    remedy="Push; see `${repeats}`.")
    header = render.faults_header(table)
    assert "    FAULT_STUCK = 256,\n" in header
    assert '#define FAULT_TEXT_STUCK \\\n    "it stands"\n' in header
    page = render.faults_page(table, altered(SETTINGS, "repeats", number=508))
    assert "### 256: it stands\n\nCause: A cause.\n\nWhat to do: Push; see `$508`.\n" in page
    assert "### 156:" not in page
    assert faults.of_alarm(256, table).sentence == "it stands"
    assert faults.of_alarm(156, table) is None


def test_a_cause_of_a_trip_is_changed_in_one_place():
    table = altered(causes.CAUSES, "estop", name="panic", sentence="a red button",
                    remedy="Let it go.")
    assert '    [CAUSE_PANIC] = "a red button", \\\n' in render.causes_header(table)
    assert cells(render.faults_page(FAULTS, causes=table), "a red button")[1] == "Let it go."
    for one in causes.CAUSES:
        assert re.match(r"[a-z].*[^.]$", one.sentence), one.name
        assert re.match(r"[A-Z].*\.$", one.remedy), one.name
    assert causes.numbers()["estop"] == 1


def test_an_alarm_is_told_to_a_person_as_the_table_has_it():
    stuck = faults.named("stuck")
    assert alarms.sentence(stuck.number) == "Nothing moves, although the path goes on."
    assert alarms.cause(stuck.number) == stuck.cause
    assert alarms.remedy(stuck.number).endswith("report it with the tape and events.jsonl.")
    halt = faults.named("halt_burst").number
    assert "$408 says at which return of the short" in alarms.remedy(halt)
    assert (alarms.sentence(0), alarms.cause(0), alarms.remedy(0)) == ("", "", "")


@pytest.mark.parametrize(("code", "machine"), [(101, False), (139, False), (140, True),
                                               (156, True), (1, True), (2, False), (3, True),
                                               (99, True)])
def test_whose_fault_it_is(code, machine):
    assert alarms.of_machine(code) == machine


def test_what_the_firmware_knows_of_faults_is_used():
    """Each code is raised somewhere, and each sentence of the firmware is used."""
    text = "".join(path.read_text() for path in SOURCES.rglob("*.c"))
    words = set(re.findall(r"\bFAULT_\w+", text))
    for one in FAULTS:
        assert f"FAULT_{one.name.upper()}" in words, one.name
        assert not one.spoken or f"FAULT_TEXT_{one.name.upper()}" in words, one.name


# ---- events


def test_events_are_well_formed():
    for one in EVENTS:
        assert re.fullmatch("[a-z][a-z_]*", one.name), one.name
        assert one.word or one.number, f"{one.name} is nowhere"
        assert not one.fields or one.word, f"{one.name} has fields and no line"
        for text in (one.doc, *(field.doc for field in one.fields)):
            assert text.endswith("."), one.name
        optional = [field.optional for field in one.fields]
        assert optional == sorted(optional), f"{one.name}: only its end may be left out"
        kinds = [field.kind for field in one.fields]
        assert "text" not in kinds[:-1], f"{one.name}: a text may have commas"
    for found in ([one.name for one in EVENTS], [one.word for one in EVENTS if one.word]):
        assert len(set(found)) == len(found)
    assert [one.number for one in events.numbered()] == [*range(1, 11)]


def test_the_gateware_has_the_numbers_of_the_table():
    assert {one.name.lower(): one.value for one in Event} == {
        "none": 0, **{one.name: one.number for one in events.numbered()}}
    for choices, made in ((events.CAUSES, Cause), (events.REASONS, Reason),
                          (events.PHASES, Phase), (events.HALTS, Halt)):
        assert {one.name.lower(): one.value for one in made} == {
            "none": 0, **{choice.name: choice.number for choice in choices}}
    for struct, values in ((Queued, list(events.QUEUE)), (Happened, list(events.TOLD))):
        fields = dict(struct.as_shape())
        assert list(fields) == ["kind", *values]
        for value in values:
            shape = Shape.cast(fields[value].shape)
            assert (shape.width, shape.signed) == events.QUEUE[value]


def test_the_gateware_has_the_states_of_the_table():
    for table, made in ((states.MOTION, State), (states.CHECKS, Check), (states.PULSES, Pulse)):
        assert {one.name.lower(): one.value for one in made} == {
            one.name: one.number for one in table}
    assert tuple(one.name for one in states.MOTION) == record.STATES
    assert ("none", *record.PULSES[1:]) == tuple(one.name for one in states.PULSES)


def test_a_state_is_changed_in_one_place():
    motion = altered(states.MOTION, "retracting", name="backing", number=9, doc="Going home.")
    checks = altered(states.CHECKS, "silent", text="nothing comes")
    header = render.states_header(motion, checks)
    assert "    MOTION_BACKING = 9,\n" in header
    assert '    [CHECK_SILENT] = "nothing comes", \\\n' in header
    gateware = render.states_gateware(motion, checks, states.PULSES)
    assert re.search(r"^    BACKING = 9 +# Going home\.$", gateware, re.M)


def test_an_event_is_changed_in_one_place():
    end = events.named("retraction_end")
    reason, distance, *_ = end.fields
    way = replace(distance, name="way", doc="How far.")
    table = altered(EVENTS, "retraction_end", name="way_back", word="wayback", number=12,
                    detail="why", fields=(way, reason))
    header = render.events_header(table)
    assert "    EVENT_WAY_BACK = 12,\n" in header
    assert '#define EVENT_WORD_WAY_BACK "wayback"\n' in header
    assert '#define EVENT_FORMAT_WAY_BACK ",%d,%c"\n' in header
    assert "    # Detail: why; first: " in render.events_gateware(table)
    assert "    WAY_BACK = 12\n" in render.events_gateware(table)
    page = render.events_page(table)
    assert "## `way_back`" in page
    assert cells(page, "`way`") == ["`way`", "mm", "How far."]
    scale = Scale(clock_hz=1)
    line = "[E:wayback,0,0,0,0,0,4123,c]"
    assert list(parse(line, scale, table).items())[2:] == [
        ("event", "way_back"), ("line", 0), ("pos", {"x": 0.0, "y": 0.0, "z": 0.0}),
        ("way", 0.4123), ("reason", "cleared")]
    with pytest.raises(EventError, match="cannot be read"):
        parse(line, scale)


@pytest.mark.parametrize("line", [
    "[E:alarm,1,7,0,0,0,5]", "[E:aux,1,7,0,0,0,M]", "[E:aux,1,7,0,0,0,M,3,4]",
    "[E:condition,1,7,0,0,0,5]", "[E:condition,1,7,0,0,0,5,1000,3,3]", "[E:,1,7,0,0,0]",
])
def test_a_line_with_too_few_or_too_many_fields_is_no_event(line):
    with pytest.raises(EventError, match="cannot be read"):
        parse(line, Scale(clock_hz=1))


# ---- conditions


def test_conditions_are_well_formed():
    numbers = [row.number for row in CONDITIONS]
    assert numbers == sorted(set(numbers))
    assert numbers[-1] < conditions.PLANNED
    currents = [row[0] for row in conditions.ladder()]
    assert currents == sorted(set(currents))
    positive = [not row.negative for row in CONDITIONS]
    assert positive == sorted(positive, reverse=True), "the firmware plans with the first of them"
    for row in CONDITIONS:
        assert min(row.milli_ip, row.on_us, row.off_us, row.rest_us) > 0, row.number
        assert row.negative or row.milli_ip % 1000 == 0, row.number


def test_a_condition_is_changed_in_one_place():
    first, *others = CONDITIONS
    table = (replace(first, number=105, milli_ip=3000, on_us=44, off_us=33, rest_us=22), *others)
    assert "{.number = 105, .milli_ip = 3000, .on_us = 44, .off_us = 33, .rest_us = 22, " \
           ".negative = false, " in render.conditions_header(table)
    assert cells(render.conditions_page(table), "105") == [
        "105", "3", "4.5", "44", "33", "22", "positive", "from the gate"]
    assert conditions.ladder(table)[0] == (3, 105, 44, 33)
    assert ".open_v = 99, " in render.conditions_header(table, replace(conditions.USUAL, open_v=99))
    assert "open voltage of 99 V" in render.conditions_page(
        table, replace(conditions.USUAL, open_v=99))


# ---- pins


def test_a_signal_at_the_pins_is_changed_in_one_place():
    table = altered((*PADS, CHAIN, *FIXED), "estop", direction="o", width=2, level=0,
                    doc="The red button.")
    before, after = pads.levels(PADS), pads.levels(table)
    assert (before[0]["estop"], after[1]["estop"]) == ((1, 1), (2, 0))
    assert "estop" not in after[0]
    assert pads.levels((*PADS, FLASH_CLOCK)) == (pads.INPUTS, pads.OUTPUTS), "of the gateware"
    row = cells(pins_page(ulx3s.BOARDS, table), "`estop`")
    assert row[:5] == ["`estop`", "out", "J1 GN6 (C7)", "yes", "LVCMOS33, pull down"]
    assert row[5].startswith("The red button. A closed contact ")


def test_the_place_of_a_signal_is_changed_in_one_place():
    """Page, drawing and the resource of the pin list follow the board's wires."""
    board = ulx3s.BOARDS[0]
    wires = tuple(replace(wire, pins="0+") if wire.pad == "estop" else wire
                  for wire in board.wires if wire.pins != "0+")
    moved = replace(board, wires=wires)
    assert cells(pins_page([board]), "`estop`")[2] == "J1 GN6 (C7)"
    assert cells(pins_page([moved]), "`estop`")[2] == f"J1 GP0 ({board.sites['0+']})"
    assert board_drawing([moved]) != board_drawing([board])
    found = [resource(wire, "i", ulx3s.HEADER).ios[0].names for one in (board, moved)
             for wire in one.wires if wire.pad == "estop"]
    assert found == [["gpio_0:6-"], ["gpio_0:0+"]]


def test_the_page_of_pins_has_every_pad_of_the_board():
    assert all(pad.doc.endswith(".") for pad in (*PADS, CHAIN, *FIXED))
    page = pins_page(ulx3s.BOARDS)
    resources = ulx3s.BOARDS[0].platform().resources
    for pad in (*PADS, CHAIN, *FIXED):
        if (pad.name, 0) in resources:
            assert len(cells(page, f"`{pad.name}`")[2].split(", ")) == pad.width, pad.name
    assert cells(page, "`rx`")[1:4] == ["in", "M1", ""]
