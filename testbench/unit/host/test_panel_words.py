# SPDX-License-Identifier: Apache-2.0
"""What the panel says of events, and the path that it draws of a tape."""

import pytest

from host.panel.heard import CLASSES, Heard, condition_words, on_beginning, sentence
from host.panel.outline import outline
from host.run.events import Scale
from host.tape.tape import encode
from softcore.tables import events as table
from softcore.tables.settings import assign
from testbench.punch import TAPES


def test_every_event_has_a_sentence():
    place = {"line": 1, "pos": {"x": 0.0, "y": 0.0, "z": 0.0}, "t": 0.0, "cycle": 0}
    values = {"cause": "short", "distance": 0.5, "reason": "cleared", "speed": 60.0, "limit": 1.0,
              "phase": "low", "high": 600.0, "low": 60.0, "changeover": 0.1, "number": 130,
              "ip": 6.0, "code": 8, "letter": "m", "class": 1, "measured": 2, "text": "Text."}
    for event in table.EVENTS:
        text = sentence({"event": event.name, **place, **values})
        assert text[0].isupper()
        assert text.endswith(".")
    assert "6 IP (9 A), on 100 µs" in condition_words({"number": 130, "ip": 6.0})
    assert condition_words({"number": 7, "ip": 6.0}).endswith("entered by G10")
    assert len(CLASSES) == 4


# ---- the path that a tape programs

def test_an_outline_has_the_corners_of_the_tape():
    lines = (TAPES / "wire_punch.nc").read_text().splitlines()
    drawn = outline(lines)
    corners = [(round(x, 3), round(y, 3)) for x, y, _, _ in drawn.points]
    for corner in ((0.5, 0.0), (0.5, 0.4), (0.6, 0.5), (1.05, 0.5), (1.55, 0.5), (2.1, 0.5),
                   (2.1, -0.3), (1.9, -0.5), (0.6, -0.5), (0.5, -0.4), (0.0, 0.0)):
        assert corner in corners
    assert len(drawn.rapid) == len(drawn.points)
    hollow = [(x, y) for x, y, _, number in drawn.points if number == 20][:-1]
    assert all(((x - 1.3) ** 2 + (y - 0.6) ** 2) ** 0.5 == pytest.approx(0.2693, abs=1e-3)
               for x, y in hollow)
    assert min(y for _, y in hollow) < 0.4      # it is hollow


def test_an_outline_goes_round_a_full_circle_and_down_in_steps():
    drawn = outline(["G91 G03 X0 Y0 Z-1 I-1", "(X9) G00 Z2", "G90 G10 X5", "G02 I1"])
    assert min(x for x, *_ in drawn.points) == pytest.approx(-2.0)
    assert max(x for x, *_ in drawn.points) == pytest.approx(2.0)
    assert drawn.points[-1][2] == pytest.approx(1.0)


# ---- how a program has ended

@pytest.mark.parametrize(("lines", "words"), [
    (["[E:end,9,7,0,0,0]"], "the program has ended."),
    (["[MSG:No way.]", "ALARM:1"],
     'the program has ended with an alarm in block 7. In "from block", "last" goes on where it was '
     "left; 7 begins that block again."),
    ([assign("dry_run_mm_min", 250), "ALARM:1"],
     'the program has ended with an alarm in block 7. In "from block", 7 begins that block again.'),
    (["[E:start,9,1,0,0,0]", "ALARM:1"], "the program has ended with an alarm."),
], ids=["end", "alarm", "dry run", "before the first block"])
def test_it_is_told_where_the_program_may_begin_again(lines, words):
    heard = Heard(Scale(2_000_000, 10_000, encode("(leader)\n%\nG21\nM02\n%\n").line))
    for line in ("[E:start,1,1,0,0,0]", "[E:block,5,7,0,0,0,G01 X1]", *lines):
        heard.hear(line, 0.0)
    assert heard.ending == words


def test_it_is_told_after_a_stop_too():
    heard = Heard(Scale(2_000_000, 10_000))
    heard.hear("[E:block,5,7,0,0,0,G01 X1]", 0.0)
    heard.ended = "stopped"
    assert heard.ending.startswith("the program has ended by the stop in block 7. In ")


@pytest.mark.parametrize(("message", "words"), [
    ("block 5 begins at X0.2 Y0 Z1: ~ goes there without discharge, and on from there",
     "block 5 begins at X0.2 Y0 Z1: Resume goes there without discharge, and on from there"),
    ("block 5 was left at X0.2 Y0 Z1: ~ goes there without discharge, and on from there",
     "block 5 was left at X0.2 Y0 Z1: Resume goes there without discharge, and on from there"),
    ("a tape was interrupted in block 20: $H, $FROM=last and the same tape go on there.",
     "a tape was interrupted in block 20: home the axes ($H), choose that tape again, and start it "
     'with "last" in "from block".'),
    ("no tape was interrupted", "")])
def test_where_a_tape_begins_is_told_in_the_words_of_the_page(message, words):
    assert on_beginning(message) == words
