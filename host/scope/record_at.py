# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper scope``: a record from the controller at a port, which is not reset for it."""

from collections.abc import Callable
from pathlib import Path

from rich.console import Console

from host.link.link import ANSWER_TIMEOUT_S, POLL_S, BytePipe, LinkError
from host.link.port import Port
from host.scope.acquire import TRIGGERS, Acquisition, Trigger
from host.scope.record import PULSES, Record, check, write
from host.words import counted

__all__ = ["acquire", "record_at", "told"]

EMPTY_S = 0.3       # wait for the answer to an empty line


def record_at(url: str, trigger: str, *, before: int, auto_s: float | None, targets: list[Path],
              baud: int, console: Console) -> None:
    """Arm, wait, read, write the files, tell what is in them.

    Raises
    ------
    UserError
        If a word is wrong, or the controller cannot be reached or refuses.
    """
    for target in targets:
        check(target)
    wanted = Acquisition(Trigger.of(trigger, before))
    port = Port(url, baud)
    try:
        with console.status("arming the oscilloscope") as status:
            record = acquire(port, wanted, auto_s=auto_s, show=lambda text: status.update(text))
    finally:
        port.close()
    for target in targets:
        write(record, target)
    for line in (told(record), *map(str, targets)):
        console.print(line, markup=False, soft_wrap=True)


def told(record: Record) -> str:
    """A sentence that describes a record: its length in time, samples and pulses."""
    classes = [f"{count} {PULSES[number].replace('_', ' ')}" for number in range(1, len(PULSES))
               if (count := int((record.pulse == number).sum()))]
    first, last = record.time_us[0], record.time_us[-1]
    return (f"{counted(len(record), 'entry').replace('entrys', 'entries')} from "
            f"{first:.1f} to {last:.1f} µs around the trigger: "
            f"{counted(len(record.samples), 'sample')} of the voltage; pulses: "
            f"{', '.join(classes) or 'none'}")


def acquire(pipe: BytePipe, wanted: Acquisition, *, auto_s: float | None = None,
            show: Callable[[str], None] = lambda text: None) -> Record:
    """Arm, wait for the trigger and read the record, over plain lines.

    Other lines of the controller are ignored. With ``auto_s`` the trigger is forced after that
    time.

    Raises
    ------
    LinkError
        If the controller does not answer.
    UserError
        If it refuses a line.
    """
    began = pipe.time_s()
    sent_s: float | None = None     # when the line without an answer was sent
    rest, message = b"", ""
    forced = False
    pipe.write(b"\n")               # ends a line that an earlier program has left half sent
    skip = True                     # ignore the answer to that; a numbered link gives none
    try:
        while wanted.record is None:
            now = pipe.time_s()
            if auto_s is not None and wanted.state == "armed" and now - began > auto_s:
                if not forced:
                    wanted.force()
                forced = True
            skip = skip and now - began < EMPTY_S
            if not skip and (line := wanted.line(now)) is not None:
                pipe.write(line.encode() + b"\n")
                sent_s = now
                show(f"waiting for the trigger: {TRIGGERS[wanted.trigger.word][1]}"
                     if wanted.state == "armed" else f"the oscilloscope is {wanted.state}")
            if sent_s is not None and now - sent_s > ANSWER_TIMEOUT_S:
                raise LinkError("nobody answers: the controller is off, a cable is unplugged, or "
                                "the baud rate is wrong.")
            *lines, rest = (rest + pipe.read(POLL_S)).split(b"\n")
            for raw in lines:
                text = raw.decode("ascii", "replace").strip()
                if wanted.hear(text):
                    continue
                if text.startswith("[MSG:"):
                    message = text[5:-1]
                elif text == "ok" or text.startswith("error:"):
                    if not skip:
                        sent_s = None
                        wanted.answered(text, message)
                    skip, message = False, ""
    except KeyboardInterrupt:
        pipe.write(b"$SCOPE=STOP\n")
        raise
    return wanted.record
