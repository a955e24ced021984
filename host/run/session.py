# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper run``: a tape on a machine, simulated or real, and the folder of its results."""

import json
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.status import Status

from host import alarms
from host.errors import TapeError, UsageError, UserError
from host.link.framing import check_line
from host.link.port import Port
from host.machines import machine as machines
from host.machines.machine import Machine
from host.machines.machine_file import DRIVES
from host.run import report, simulation
from host.run.controller import Controller
from host.run.interrupted import FILE, Interrupted, Last, last
from host.run.run import STATUS_OF, Run, count_retractions, write_events
from host.run.summary import (
    Summary,
    columns_of,
    discharged,
    plan_of,
    summary_of,
    summary_of_controller,
    summary_of_unpunched,
)
from host.run.workpiece import Columns
from host.scope.acquire import Acquisition, Trigger
from host.scope.record import write
from host.scope.record_at import told
from host.tape.machine import machine_named
from host.tape.start import LAST, block_of
from host.tape.tape import Tape, decode, is_punched, load, text_of
from host.terminal import enter_pressed
from host.words import counted

RUNS = Path("build") / "runs"
DEFAULT = "sinker"      # machine of a tape that names none
FILES = ("events.jsonl", "summary.json", "trace.npz", "workpiece.npz", "report.html",
         "scope.csv", "scope.fst")
# Time between lines of progress if the output is no terminal.
QUIET_STEP_S = 10.0
# Entries of a machine's file that a real controller needs too; all others describe the simulation.
CONTROLLERS = ("kind", "pulses_per_mm", *DRIVES, "settings")


def run_tape(path: Path, *, machine: str | None, seed: int, waves: bool, folder: Path | None,
             mdi: list[str], until_s: float | None, clock_hz: int | None, scope: str | None,
             console: Console, flash: Path | None = None, start: str | None = None) -> int:
    """Run a tape on a simulated machine, write its folder, print the result; return the status.

    Without ``machine`` it is the one that the tape names, or else the sinker.
    """
    given = None if machine is None else machines.load(machine)
    folder, wanted = _checked(folder or RUNS / path.stem, mdi), _scope(scope)
    tape = _punched(path, folder, given or machines.load(DEFAULT), seed, clock_hz)
    chosen = given or _chosen(tape, console)
    clock_hz = clock_hz or chosen.clock_hz
    begin, zero = _begin(folder, tape, start)
    with console.status("starting") as status:
        machine_on = simulation.start(chosen, clock_hz=clock_hz, seed=seed,
                                      progress=lambda text: _say(console, status, text),
                                      waves=folder if waves else None, flash=flash)
        began = time.perf_counter()
        job = Run(chosen, tape, machine_on, mdi=mdi, until_s=until_s, scope=wanted,
                  from_block=begin, zero=zero,
                  watch=Watch(console, status, chosen))
        try:
            _execute(job, folder)
        finally:
            wall_s = time.perf_counter() - began
            machine_on.close()
        status.update("drawing the report")
        trace = columns_of(job, machine_on)
        summary = summary_of(job, machine_on, trace, seed=seed, wall_s=wall_s)
        plan = plan_of(machine_on, chosen, job.offset)
        _write(folder, path, job, trace, summary, plan, chosen.tables)
    _tell(console, summary, folder, chosen.kind)
    _write_scope(console, job, folder)
    return STATUS_OF[summary["outcome"]]


def run_tape_at(url: str, path: Path, *, baud: int, machine: str | None, folder: Path | None,
                mdi: list[str], until_s: float | None, clock_hz: int | None, at_start: bool,
                arm: bool, reset: bool, scope: str | None, console: Console,
                start: str | None = None) -> int:
    """Run a tape on the controller at a port; otherwise as ``run_tape``.

    ``at_start``, ``arm``: see ``Run``. With ``reset`` even a busy controller is reset and used.
    What stands at the port the tape cannot know: if it names another machine than the sinker,
    ``machine`` must be given.
    """
    tape = load(path)
    if machine is None and (named := machine_named(tape)) not in {None, DEFAULT}:
        raise UsageError(f"{path.name} is for the machine {named}: say with --machine which one is "
                         "at the port, as its settings are entered there.")
    chosen = machines.load(DEFAULT if machine is None else machine)
    folder, clock_hz = _checked(folder or RUNS / path.stem, mdi), clock_hz or chosen.clock_hz
    wanted = _scope(scope)
    record = start is not None and start.lower() == LAST
    unknown = record and not (folder / FILE).exists()
    begin, zero = (0, {}) if unknown else _begin(folder, tape, start)
    if record and at_start:
        raise UsageError(f"--from {LAST} and --at-start: the machine stands where the tape was "
                         "interrupted, and not at its start.")
    if unknown:
        console.print(f"the folder {folder} has no interrupted run: the tape goes on where the "
                      "controller says", soft_wrap=True, markup=False)
    port = Port(url, baud)
    try:
        with console.status("asking the controller who it is") as status:
            def say(text: str) -> None:
                console.print(text, soft_wrap=True, markup=False)

            controller = Controller(port, chosen, clock_hz=clock_hz, say=say)
            controller.identify(reset=reset)
            job = Run(chosen, tape, controller, mdi=mdi, until_s=until_s, at_start=at_start,
                      arm=arm, goes_on=Stop(say), scope=wanted, from_block=begin,
                      from_record=record, zero=zero, say=say,
                      watch=Watch(console, status, chosen))
            block = _execute(job, folder)
            status.update("drawing the report")
            trace = columns_of(job, controller)
            summary = summary_of_controller(job, controller, trace)
            _write(folder, path, job, trace, summary, {}, {
                name: chosen.tables[name] for name in CONTROLLERS if name in chosen.tables})
    finally:
        port.close()
    _tell(console, summary, folder, chosen.kind)
    if record and begin and job.outcome == "rejected":
        console.print(f"  --from {begin} begins the tape at the block that {folder / FILE} has",
                      soft_wrap=True, markup=False)
    if block > 1:
        place = tape.told(f"Block {block}").replace("B", "b", 1)
        console.print(f"  --from {LAST} begins the tape at {place}, where it was interrupted",
                      soft_wrap=True)
    _write_scope(console, job, folder)
    return STATUS_OF[summary["outcome"]]


class Stop:
    """A stop at a real machine that the program or its start asked for.

    Enter resumes it, or a button at the machine.
    """

    def __init__(self, say: simulation.Progress) -> None:
        self.say = say
        self._told = False

    def __call__(self, asked: str) -> bool:
        if not self._told:
            self.say(f"{asked} (Enter)" if asked else "programmed stop (M00): Enter goes on")
        self._told = not enter_pressed()
        return not self._told


def _checked(folder: Path, mdi: list[str]) -> Path:
    """Make the folder of a run; check all that can be checked before the start.

    Files of an earlier run stay until this run has begun its tape.
    """
    for line in mdi:
        check_line(line)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise UsageError(f"{folder} can be no folder: it is a file, or would stand in one."
                         ) from error
    except OSError as error:
        raise UserError(f"{folder} cannot be written: {error.strerror}.") from error
    return folder


def _scope(trigger: str | None) -> Acquisition | None:
    """The record of the gap that is wanted, if one is."""
    return None if trigger is None else Acquisition(Trigger.of(trigger))


def _write_scope(console: Console, job: Run, folder: Path) -> None:
    """Write the record of the gap, and tell what is in it, or why there is none."""
    if job.scope is None:
        return
    if job.scope.record is None:
        console.print(f"  no record of the gap: {job.scope_failed}", style="yellow", markup=False,
                      soft_wrap=True)
        return
    for name in ("scope.csv", "scope.fst"):
        write(job.scope.record, folder / name)
    console.print(f"  {folder / 'scope.csv'}: {told(job.scope.record)}", markup=False,
                  soft_wrap=True)


def _punched(path: Path, folder: Path, machine: Machine, seed: int, clock_hz: int | None) -> Tape:
    """The tape; if it cannot be punched, the run's outcome is ``rejected``."""
    try:
        return load(path)
    except TapeError as error:
        _clear(folder)
        _write_summary(folder, summary_of_unpunched(error, machine, seed,
                                                    clock_hz or machine.clock_hz))
        raise


def _chosen(tape: Tape, console: Console) -> Machine:
    """The machine that the tape names, or else the sinker; told if it is another."""
    named = machine_named(tape)
    if named in {None, DEFAULT}:
        return machines.load(DEFAULT)
    if named in machines.built_in():
        console.print(f"on the machine {named}, which the tape names", markup=False)
        return machines.load(named)
    console.print(f"on the machine {DEFAULT}: the tape is for the machine {named}, which does not "
                  "come with Gapkeeper (--machine chooses one)", style="yellow", markup=False,
                  soft_wrap=True)
    return machines.load(DEFAULT)


def _begin(folder: Path, tape: Tape, start: str | None) -> Last:
    """Block at which the tape begins, 0 for its beginning, and where its zero must be, if known."""
    if start is None:
        return 0, {}
    return last(folder, tape) if start.lower() == LAST else (block_of(tape, start), {})


def _execute(job: Run, folder: Path) -> int:
    """Run the tape; write the events even if the run breaks off.

    Return the block in which it was interrupted, or 0.
    """
    interrupted, watch, block = Interrupted(folder, job.tape), job.watch, 0

    def keep(run: Run) -> None:
        interrupted.zero = run.offset
        interrupted.keep()
        watch(run)

    job.at_block, job.watch = interrupted.at, keep
    try:
        with _interruptible(job):
            job.execute()
    finally:
        if job.began:
            _clear(folder)
            write_events(job.events, folder / "events.jsonl")
            block = interrupted.over(job.outcome)
    return block


@contextmanager
def _interruptible(job: Run) -> Iterator[None]:
    """Let Ctrl-C end a tape that has begun, as ``--until`` does; a second Ctrl-C breaks off."""
    pressed = 0

    def on_interrupt(_signal: int, _frame: FrameType | None) -> None:
        nonlocal pressed
        pressed += 1
        if pressed > 1 or not job.began:
            raise KeyboardInterrupt
        job.interrupt()

    if threading.current_thread() is not threading.main_thread():
        yield   # only the main thread gets signals
        return
    before = signal.signal(signal.SIGINT, on_interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _clear(folder: Path) -> None:
    """Remove the files of an earlier run."""
    for name in FILES:
        (folder / name).unlink(missing_ok=True)


def _say(console: Console, status: Status, text: str) -> None:
    """Show the progress of a start: in one line on a terminal, else line by line."""
    status.update(text)
    if not console.is_terminal:
        console.print(text, soft_wrap=True)


def _write(folder: Path, path: Path, job: Run, trace: Columns, summary: Summary, plan: Columns,
           parameters: machines.Tables) -> None:
    """Write the files of a run except its events."""
    _write_summary(folder, summary)
    np.savez_compressed(folder / "trace.npz", allow_pickle=False, **trace)
    if plan:
        np.savez_compressed(folder / "workpiece.npz", allow_pickle=False, **plan)
    page = report.render(
        title=path.stem, listing=_listing(job.tape, path), machine=job.machine.name, plan=plan,
        parameters=parameters, summary=summary, events=job.events, trace=trace)
    (folder / "report.html").write_text(page, encoding="utf-8")


class Watch:
    """Shows the progress of a run: all the time on a terminal, else a line now and then."""

    def __init__(self, console: Console, status: Status, machine: Machine) -> None:
        self.console, self.status, self.machine = console, status, machine
        self.began = self.shown = time.perf_counter()

    def __call__(self, run: Run) -> None:
        now = time.perf_counter()
        if now - self.shown < (0.2 if self.console.is_terminal else QUIET_STEP_S):
            return
        self.shown = now
        machine_on = run.simulation
        places = {axis: place / self.machine.pulses_per_mm - run.offset[axis]
                  for axis, place in machine_on.positions().items()}
        where = "  ".join(f"{axis.upper()} {places[axis]:8.3f}"
                          for axis in ("xy" if self.machine.kind == "wire" else "z"))
        text = (f"{machine_on.time_s():7.2f} s "
                f"{'connected' if machine_on.cycle is None else 'on the machine'}  {where} mm  "
                f"{counted(count_retractions(run.events)['count'], 'retraction'):>15}")
        if machine_on.cycle is not None:
            text += f"  {machine_on.cycle / (now - self.began) / 1e6:.1f} million clocks/s"
        self.status.update(text)
        if not self.console.is_terminal:
            self.console.print(text, soft_wrap=True)


def _write_summary(folder: Path, summary: Summary) -> None:
    (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")


def _listing(tape: Tape, path: Path) -> list[tuple[int, str]]:
    """Lines of the tape with their numbers; a damaged punched tape has no listing."""
    if not is_punched(path):
        return list(enumerate(text_of(path, path.read_bytes()).splitlines(), start=1))
    try:
        return list(enumerate(decode(tape.rows)[0].splitlines(), start=1))
    except TapeError as error:
        return [(0, f"(cannot be listed: {error})")]


def _tell(console: Console, summary: Summary, folder: Path, kind: str) -> None:
    """Print the main results."""
    name, _ = report.OUTCOMES[summary["outcome"]]
    if summary["alarm"]:
        console.print(f"{name}: {summary['alarm']['text']}", style="red", markup=False,
                      soft_wrap=True)
        if remedy := alarms.remedy(summary["alarm"]["code"]):
            console.print(f"What to do: {remedy}", markup=False, soft_wrap=True)
    else:
        console.print(name, style="green")
    if begun := report.begun_at(summary):
        console.print(begun, soft_wrap=True)
    if masked := report.guards_off(summary):
        console.print(masked, style="yellow", soft_wrap=True)
    if collision := report.collision(summary):
        console.print(collision, style="red", soft_wrap=True)
    counts, pulses = summary["retractions"], summary["discharges"]
    cut = (f"deepest {summary['max_depth_mm']:.3f} mm, " if kind != "wire" else
           f"removed {summary['removed_mm3']:.3f} mm3, " if "removed_mm3" in summary else "")
    page = folder / "report.html"
    time = "since the connection" if "port" in summary else "of the machine's time"
    lines = [f"{cut}{summary['time_s']:.2f} s {time}, "
             f"{counted(discharged(pulses), 'discharge')} in "
             f"{counted(sum(pulses.values()), 'pulse')}",
             f"{counted(counts['count'], 'retraction')}: {counts['short']} short, "
             f"{counts['jump']} jump, {counts['operator']} operator"]
    if "port" in summary:
        lines.append("not known, as no controller tells it: " + ", ".join(summary["unknown"]))
    else:
        lines.append(f"{summary['cycles'] / 1e6:.1f} million clocks in {summary['wall_s']:.1f} s "
                     f"({summary['cycles_per_s'] / 1e6:.2f} million a second)")
    for line in [*lines, f"[link={page.resolve().as_uri()}]{escape(str(page))}[/link]"]:
        console.print(f"  {line}", soft_wrap=True)
