# SPDX-License-Identifier: Apache-2.0
"""Planted breaks of the operator's panel: who holds the controls, jogging, who may reach it."""

from testbench.breaks.harness import breaks_of

__all__ = ["PANEL"]

SESSION = "unit/host/test_panel.py"
GATE = "unit/host/test_panel_page.py"

PANEL = (
    *breaks_of(
        "host/panel/session.py", SESSION,
        ("if self.sharing.holder != page:\n                return",
         "if False:\n                return",
         "a page that watches can touch nothing"),
        ("if self.sharing.holder != page:\n            self._touch",
         "if False:\n            self._touch",
         "a page that lets go of the controls ends its touching",
         "unit/host/test_panel_touch.py"),
        ("if jog.over or self.sharing.holder != page:", "if jog.over:",
         "a page that lets go of the controls ends its jog"),
        ("            self._controller.realtime(CANCEL)", "            pass",
         "the end of a jog is told to the controller"),
        ('        if sent.text.startswith("$J="):\n            self._jog = None\n', "",
         "a refused jog ends"),
        ("rests = waited > 3 * SAMPLE_S and self.heard.state in _REST", "rests = True",
         "a stop resets at rest only"),
    ),
    *breaks_of(
        "host/panel/walking.py", "unit/host/test_panel_walk.py",
        ("return place if place > 0 else None", "return place",
         "a step of a walk to the front is not offered"),
        ('begin = distance if heard.state == "Hold:0" else goal', "begin = goal",
         "a step leads on from where a hold has stopped the machine"),
        ("begin = begin if self._ordered is None else self._ordered", "pass",
         "steps of a walk add up, however fast they follow"),
        ("and not self._pending(_line(self._ordered))", "and False",
         "a step that was refused is forgotten"),
    ),
    *breaks_of(
        "host/panel/by_hand.py", "unit/host/test_panel_by_hand.py",
        ("self._last, self._open, self._reports = line, True, 0",
         "self._open, self._reports = True, 0", "a line that was sent is on its way"),
        ("if self._reports >= FRESH and not self._open:", "if self._reports >= FRESH:",
         "a line is on its way as long as it is not answered"),
        ('        self._last = ""\n        code', "        code",
         "a line that was refused is on its way no more"),
        ("if not one[0])", "if True)", "lines that wait when an alarm comes are not sent"),
        ('moves = self._moves not in ("", holder)', "moves = False",
         "what a page moves is held when it lets go of the controls"),
    ),
    *breaks_of(
        "host/panel/sharing.py", SESSION,
        ("AHEAD_S = 0.1", "AHEAD_S = 0.25", "a jog is ordered 0.2 s ahead at most"),
        ("return self._clock() > self._end", "return False", "a jog that nobody renews ends"),
        ("now - heard > SILENT_S", "False", "a silent page lets go of the controls"),
        ("if self.holder is None:", "if True:", "nobody is robbed of the controls"),
    ),
    *breaks_of(
        "host/panel/gate.py", GATE,
        ("if origin is not None and", "if False and", "a page of another site is refused"),
        ("return address.is_loopback or bool(self.token)", "return True",
         "without a token only this computer comes in"),
        ("if self.token and not (", "if False and not (", "beyond this computer a token is needed"),
    ),
)
