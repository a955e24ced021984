# SPDX-License-Identifier: Apache-2.0
"""What ends a touching cycle early, and how the machine is left then; the lock before it."""

import pytest

from host.errors import ALARM
from host.link.link import HOLD, RESET, LinkError, RefusedError
from host.link.lock import LOCKED, LockedError, leave, require_unlocked, taken
from host.link.port import PortError
from host.run.events import Scale
from host.touch.cycles import TouchError
from host.touch.ending import REST_S, AlarmError, Alarms, ending
from testbench.unit.host.test_tune_ends import Script

SCALE = Scale(2_000_000)
EVENT = "[E:alarm,1000,0,1,2,3,5,G38.2 Z has found no contact]"


@pytest.mark.parametrize("reason", [KeyboardInterrupt, TouchError("no contact"),
                                    PortError("gone"), RefusedError("G01 X3", "no")])
def test_whatever_ends_it_holds_the_machine_and_gives_up_the_motion(reason):
    link, said = Script(), []
    with pytest.raises((KeyboardInterrupt, TouchError, LinkError)), ending(
            link, Alarms(SCALE), said.append):
        raise reason
    assert link.done == [HOLD, RESET, "greeting"]
    assert said == ["The machine is held and stands; what was left of the cycle is given up."]


def test_its_own_end_holds_nothing():
    link, said = Script("Idle"), []
    with ending(link, Alarms(SCALE), said.append):
        pass
    assert (link.done, said) == ([], [])


def test_a_machine_that_does_not_rest_is_not_reset_and_this_is_told():
    class Rushing(Script):
        def poll(self, timeout_s):
            self.now += timeout_s

    link, said = Rushing(), []
    with pytest.raises(KeyboardInterrupt), ending(link, Alarms(SCALE), said.append):
        raise KeyboardInterrupt
    assert link.done == [HOLD]
    assert link.now > REST_S
    assert "has not come to rest within 3 s" in said[0]


def test_a_lost_link_is_told():
    class Lost(Script):
        def press(self, button):
            raise PortError("the connection is lost")

    said = []
    with pytest.raises(PortError, match="first"), ending(Lost(), Alarms(SCALE), said.append):
        raise PortError("first")
    assert "could not be held, as the link is lost" in said[0]


@pytest.mark.parametrize(("lines", "told"), [
    ([EVENT, "ALARM:5"], "alarm 5: G38.2 Z has found no contact Check clamping"),
    (["ALARM:5"], "alarm 5: The end of a touch-off"),
    (["[E:alarm,1000,0,1]", "ALARM:4"], "alarm 4: The electrode touches the work"),
    (["ALARM:155 watchdog: the processor does not answer"], "alarm 155: watchdog"),
])
def test_an_alarm_is_named_in_place_of_the_refusal(lines, told):
    """It may come after the refusal, and after the state."""
    heard = Alarms(SCALE)

    class Late(Script):
        def poll(self, timeout_s):
            super().poll(timeout_s)
            if lines:
                heard.hear(lines.pop(0))

    link, said = Late("Alarm"), []
    with pytest.raises(AlarmError) as ended, ending(link, heard, said.append):
        raise RefusedError("G38.2 Z-1 F60", "stopped by an alarm or a reset")
    assert str(ended.value).startswith(told)
    assert ended.value.status == ALARM
    assert (link.done, said) == ([HOLD], [])


class Locked(Script):
    """A controller that refuses every block with an error."""

    def __init__(self, code):
        super().__init__("Alarm")
        self.code = code

    def command(self, line):
        self.done.append(line)
        if line == "$X":
            self.code = 0
        elif self.code:
            raise RefusedError(line, "the machine is locked", self.code)


def test_a_lock_is_named_and_stays():
    link = Locked(LOCKED)
    with pytest.raises(LockedError, match=r"Look at the machine .* unlock it with \$X"):
        require_unlocked(link, unlock=False)
    assert "$X" not in link.done


def test_another_refusal_is_no_lock():
    with pytest.raises(RefusedError):
        require_unlocked(Locked(LOCKED + 1), unlock=False)


def test_it_is_unlocked_by_order():
    link = Locked(LOCKED)
    require_unlocked(link, unlock=True)
    assert link.done[0] == "$X"


class Stands(Script):
    """A controller whose axis goes on for some reports, whatever its state is."""

    def __init__(self, state, reports):
        super().__init__(state)
        self.reports = reports

    def status(self):
        self.reports -= self.reports > 0
        return super().status() | {"MPos": f"{self.reports},0,0"}

    def press(self, button):
        self.done.append(button)


@pytest.mark.parametrize(("state", "reports", "resets"), [
    ("Idle", 0, True), ("Alarm", 0, True), ("Alarm", 5, True), ("Run", 0, False),
    ("Alarm", 1000, False), ("Hold:1", 0, False)])
def test_it_is_reset_at_rest_only(state, reports, resets):
    link = Stands(state, reports)
    leave(link)
    assert link.reports == 0 or not resets
    assert link.done == [RESET, "greeting"] * resets


def test_it_is_left_whatever_ends_it():
    link = Stands("Idle", 0)
    with pytest.raises(KeyboardInterrupt), taken(link, unlock=True):
        raise KeyboardInterrupt
    assert link.done == ["$X", "G21", RESET, "greeting"]


def test_a_lost_link_is_left_without_a_word():
    class Lost(Script):
        def status(self):
            raise PortError("the connection is lost")

    leave(Lost())
