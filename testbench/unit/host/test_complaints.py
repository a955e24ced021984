# SPDX-License-Identifier: Apache-2.0
"""The doctor's reading of what a controller says: each sentence leads to its wires and pins."""

import pytest

from constraints.boards import BOARDS
from host.doctor.complaints import PLACES, place, suspects, touched
from softcore.tables.causes import CAUSES

ULX3S = BOARDS[0]
EVENT = "[E:alarm,476269,0,0,0,0,140,interlock: {}; the position is lost.]"


@pytest.mark.parametrize(("said", "wires"), [
    ("[MSG:the interlock stays open: emergency stop.]", {"estop"}),
    ("[MSG:the interlock stays open: a drive reports a fault (axis Y).]", {"drive_fault[1]"}),
    (EVENT.format("a drive reports a fault (axes X and Z)"), {"drive_fault[0]", "drive_fault[2]"}),
    ("[MSG:On the lower limit switch of axis X: only away from it, slowly, without discharge.]",
     {"limit_low[0]"}),
    ("[MSG:On the upper limit switch of axes X, Y and Z: only away from it, slowly, without "
     "discharge.]", {"limit_high[0]", "limit_high[1]", "limit_high[2]"}),
    ("[MSG:On the limit switch of axis Y: only away from it, slowly, without discharge.]",
     {"limit_low[1]", "limit_high[1]"}),
    (EVENT.format("coder of axis X: phase A is silent"), {"enc_a[0]"}),
    (EVENT.format("coder of axis Z: phase B is silent"), {"enc_b[2]"}),
    (EVENT.format("coder of axis Y: both phases are silent"), {"enc_a[1]", "enc_b[1]"}),
    (EVENT.format("coder of axis Y: it counts against the command"),
     {"enc_a[1]", "enc_b[1]", "dac_negative[1]"}),
    (EVENT.format("an encoder made an illegal transition (axis Z)"), {"enc_a[2]", "enc_b[2]"}),
    (EVENT.format("the gap had current or voltage with both sources off"),
     {"gap_current", "gap_short", "gap_on", "gap_sense"}),
    ("[MSG:the interlock stays open: the wire has a break or its drive reports a fault.]",
     {"drive_fault[2]"}),
    ("[VER:1.1h:Gapkeeper 0.1]", set()),
])
def test_a_sentence_leads_to_its_wires(said, wires):
    assert {one.wire for _, places in suspects(ULX3S, [said]) for one in places} == wires


def test_a_coder_that_counts_the_wrong_way_may_lack_its_settings():
    said = EVENT.format("coder of axis Y: it counts against the command")
    (meaning, _), = suspects(ULX3S, [said])
    assert "--machine" in meaning


@pytest.mark.parametrize(("said", "touches"), [
    ("contact with the discharge off; from here only a move away from the work is possible", True),
    ("the electrode touched the work with the discharge off", True),
    ("emergency stop", False),
])
def test_a_touch_is_told_from_other_alarms(said, touches):
    assert touched(EVENT.format(said)) is touches


def test_the_sentences_of_the_causes_are_known():
    """Each cause that a wire can be guilty of, in the words of the table."""
    wired = {"estop", "drive_fault", "limit_low", "limit_high", "fluid_low", "encoder", "contact",
             "gate"}
    known = {cause.name for cause in CAUSES if suspects(ULX3S, [cause.sentence])}
    assert known == wired


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.name)
def test_every_wire_that_can_be_accused_has_a_pin(board):
    for _, pads, _ in PLACES:
        for pad in (pad.partition("[")[0] for pad in pads):
            wire = next(wire for wire in board.wires if wire.pad == pad)
            for bit, site in enumerate(board.sites_of(wire)):
                assert f"(site {site})" in place(board, pad, bit).pin


def test_places_are_as_they_are_printed_on_the_board():
    assert str(place(ULX3S, "estop")) == "estop at J1 GN6 (site C7)"
    assert str(place(BOARDS[-1], "limit_low", 2)) == "limit_low[2] at P4 17 (site J5)"
    assert str(place(ULX3S, "rx")) == "rx at site M1, on the board"
