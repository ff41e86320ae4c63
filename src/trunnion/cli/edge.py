"""The edge of the program: whatever ends a run is one line and an exit status, never a traceback.

0 fine, 1 findings, 2 bad input, 3 a fault of the program itself, 130 stopped by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP.
Only `--debug` shows where a fault of the program arose.

Ctrl-C ends every verb alike: no result of a part of the work is shown or written, and files of before stay. Samples
that are kept in a checkpoint are told.
"""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from trunnion.errors import MechanismError
from trunnion.version import __version__

__all__ = ["BAD_INPUT", "FAULT", "STOPPED", "status_of"]

BAD_INPUT, FAULT, STOPPED = 2, 3, 130
LONGEST = 300  # signs of what an exception says
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
AGAIN = 0.01  # s, after which a signal comes again that Python has dropped


class _Interrupt:
    """The signal that came to end the run, also where what runs made another exception of it; 0 if none did."""

    number = 0


def status_of(run: Callable[[], Any], debug: bool = False) -> int:
    """The exit status of a run; what ended it is said on the error stream."""
    interrupt = _Interrupt()
    code: Any = 0
    try:
        with _told_of(interrupt):
            run()
    except SystemExit as stop:  # typer's own end, of a usage error or of Ctrl-C too
        code = stop.code
        if code == STOPPED:
            _say(f"stopped; a file named above as written is whole, no other was begun{_kept(stop)}")
        elif interrupt.number:
            _say("stopped")
    except MechanismError as error:
        for finding in error.findings:
            _say(str(finding))
        code = BAD_INPUT
    except BaseException as error:
        if interrupt.number or isinstance(error, KeyboardInterrupt):
            _say("stopped")
            code = 128 + (interrupt.number or signal.SIGINT)
        else:
            if debug:
                traceback.print_exc()
            code = _unforeseen(error)
    return int(code or 0)


def _kept(stop: BaseException | None) -> str:
    """What a run that was stopped says of its work, see `studies.tolerance`."""
    while stop is not None and not (isinstance(stop, KeyboardInterrupt) and stop.args):
        stop = stop.__context__
    return f"; {stop.args[0]}" if stop is not None else ""


def _unforeseen(error: BaseException) -> int:
    """One line about an exception that no verb foresaw; the exit status."""
    if isinstance(error, OSError):
        _say(": ".join(["error", *([str(error.filename)] if error.filename else []), error.strerror or str(error)]))
        return BAD_INPUT
    if isinstance(error, MemoryError):
        _say("error: not enough memory — use fewer --steps, samples or points")
        return FAULT
    what = " ".join(str(error).split())[:LONGEST]
    place = traceback.extract_tb(error.__traceback__)[-1:]
    where = "".join(f", {os.path.basename(one.filename)}:{one.lineno}" for one in place)
    _say(
        f"error: a fault of Trunnion {__version__} itself ({type(error).__name__}{where}){': ' * bool(what)}{what} — "
        "please report this line with the command and its files; --debug shows where it arose"
    )
    return FAULT


def _say(text: str) -> None:
    print(text, file=sys.stderr)


@contextmanager
def _told_of(interrupt: _Interrupt) -> Iterator[None]:
    """A signal that ends the run is an exception, so that drafts of files are removed and workers ended.

    Ctrl-C raises KeyboardInterrupt, of which a library may make an ImportError: so it is remembered. The others raise
    SystemExit, and what clears up then is not broken off by a second one. Where Python drops the exception, while it
    clears up an object, the signal comes again.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    repeated: list[threading.Timer] = []

    def stop(number: int, _frame: Any) -> None:
        first, interrupt.number = not interrupt.number, number
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        if first:
            raise SystemExit(128 + number)

    def lost(told: Any) -> None:
        if interrupt.number and issubclass(told.exc_type, (KeyboardInterrupt, SystemExit)):
            repeated.append(threading.Timer(AGAIN, _thread.interrupt_main, [interrupt.number]))
            interrupt.number = 0
            repeated[-1].start()
        before_lost(told)

    # what is ignored, as Ctrl-C in the background of a shell, is not for us
    before = {number: signal.getsignal(number) for number in SIGNALS}
    ours = [number for number in SIGNALS if before[number] not in (signal.SIG_IGN, None)]
    before_lost = sys.unraisablehook
    for number in ours:
        signal.signal(number, stop)
    sys.unraisablehook = lost
    try:
        yield
    finally:
        for timer in repeated:
            timer.cancel()
        sys.unraisablehook = before_lost
        for number in ours:
            signal.signal(number, before[number])
