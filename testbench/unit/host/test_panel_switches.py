# SPDX-License-Identifier: Apache-2.0
"""Single block, dry run, and a start at a block, from the panel without its page.

The controller is the firmware.
"""

from host.panel.job import Job
from softcore.tables.settings import named
from testbench.unit.host.test_panel import Board, serve, until

__all__ = ["serve"]     # a fixture


def short_job(folder):
    path = folder / "short.nc"
    path.write_text("%\nG21 G91 G94\nG01 X0.1 F60\nX0.1\nX0.1\nM02\n%\n")
    return Job.of(path)


def test_the_operators_switches_are_turned_while_a_tape_runs(serve, tmp_path):
    """Single block stops the tape after its blocks; a setting that is no switch is refused."""
    single, tv = named("single_block").number, named("tv").number
    session = serve(Board(pulses_per_pass=20))
    session.take("a")
    session.order("a", "choose", short_job(tmp_path))
    session.order("a", "arm")
    until(lambda: "Armed" in session.heard.fields, lambda: session.seen("a"))
    session.order("a", "line", f"${single}=1")
    until(lambda: session.heard.settings[single] == "1", lambda: session.seen("a"))
    session.order("a", "run")
    until(lambda: session.heard.state == "Hold:0", lambda: session.seen("a"))
    first = session.heard.line
    session.order("a", "resume")
    until(lambda: session.heard.line > first and session.heard.state == "Hold:0",
          lambda: session.seen("a"))
    session.order("a", "line", f"${tv}=1")
    until(lambda: f"${tv}=1 is refused" in session.notice, lambda: session.seen("a"))
    session.order("a", "line", f"${single}=0")
    until(lambda: session.heard.settings[single] == "0", lambda: session.seen("a"))
    session.order("a", "resume")
    until(lambda: session.heard.ended == "end", lambda: session.seen("a"))


def test_a_dry_run_needs_no_arming(serve, tmp_path):
    dry = named("dry_run_mm_min").number
    session = serve(Board(pulses_per_pass=20))
    session.take("a")
    session.order("a", "choose", short_job(tmp_path))
    assert "not armed" in session.order("a", "run")
    session.order("a", "line", f"${dry}=900")
    until(lambda: session.heard.settings[dry] == "900", lambda: session.seen("a"))
    assert session.order("a", "run") == ""
    until(lambda: session.heard.ended == "end", lambda: session.seen("a"))


def test_a_tape_begins_at_a_block_after_resume(serve, tmp_path):
    session = serve(Board(pulses_per_pass=20))
    session.take("a")
    session.order("a", "choose", short_job(tmp_path))
    session.order("a", "arm")
    until(lambda: "Armed" in session.heard.fields, lambda: session.seen("a"))
    assert session.order("a", "run", 5) == ""
    until(lambda: session.heard.state == "Hold:0", lambda: session.seen("a"))
    assert session.notice.startswith("Block 5 begins at X0.2000 Y0.0000 Z")
    assert ": Resume goes there" in session.notice
    assert session.heard.place[0] == 0
    session.order("a", "resume")
    until(lambda: session.heard.ended == "end", lambda: session.seen("a"))
    until(lambda: session.heard.place[0] == 0.3, lambda: session.seen("a"))


def test_a_start_that_the_controller_refuses_is_told_and_the_connection_stays(serve, tmp_path):
    session = serve(Board(pulses_per_pass=20))
    session.take("a")
    session.order("a", "choose", short_job(tmp_path))
    session.order("a", "arm")
    until(lambda: "Armed" in session.heard.fields, lambda: session.seen("a"))
    assert session.order("a", "run", 10**9) == ""   # more digits than `$FROM` takes
    until(lambda: "takes the number of a block" in session.notice, lambda: session.seen("a"))
    assert (session.link, session.running) == ("connected", False)
