"""The edge of the program: whatever ends a run is one line and an exit status, never a traceback.

0 fine, 1 findings, 2 bad input, 3 a fault of the program itself, 130 stopped by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP.
Only `--debug` shows where a fault of the program arose.

A signal ends every verb alike: no result of a part of the work is shown or written, and files of before stay.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import copy_context
from typing import Any

from trunnion.errors import MechanismError
from trunnion.version import __version__

__all__ = ["BAD_INPUT", "FAULT", "STOPPED", "status_of"]

BAD_INPUT, FAULT, STOPPED = 2, 3, 130
LONGEST = 300  # signs of what an exception says
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
AGAIN = 0.05  # s, after which what ends a run is raised anew where it got lost


class _Interrupt:
    """The signal that came to end the run, 0 if none did, and the exception that was made of it."""

    number = 0
    raised: BaseException = KeyboardInterrupt()


def status_of(run: Callable[[], Any], debug: bool = False) -> int:
    """The exit status of a run; what ended it is said on the error stream."""
    interrupt = _Interrupt()
    code: Any = 0
    try:
        with _raised_by_signals(interrupt):
            copy_context().run(run)  # units that a model is shown in end with it
    except SystemExit as stop:  # typer's own end, of a usage error or of Ctrl-C too
        code = stop.code
        if code == STOPPED or interrupt.number:
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
    where = "".join(f", {os.path.basename(frame.filename)}:{frame.lineno}" for frame in place)
    _say(
        f"error: a fault of Trunnion {__version__} itself ({type(error).__name__}{where}){': ' * bool(what)}{what} — "
        "please report this line with the command and its files; --debug shows where it arose"
    )
    return FAULT


def _say(text: str) -> None:
    print(text, file=sys.stderr)


@contextmanager
def _raised_by_signals(interrupt: _Interrupt) -> Iterator[None]:
    """A signal that ends the run is an exception, so that drafts of files are removed and workers ended.

    Ctrl-C raises KeyboardInterrupt, the others SystemExit; what clears up then is not broken off by another of those.
    The exception can get lost: Python drops it while it clears up an object, and a library may catch it. So a timer
    raises it anew until the run has ended, unless it is just being handled.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, _frame: Any) -> None:
        first, interrupt.number = not interrupt.number, number
        if first or number == signal.SIGINT:
            interrupt.raised = KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number)
            if hasattr(signal, "setitimer"):
                signal.setitimer(signal.ITIMER_REAL, AGAIN, AGAIN)
            raise interrupt.raised

    def again(*_: Any) -> None:
        handled = sys.exc_info()[1]
        while handled is not None:
            if handled is interrupt.raised:
                return
            handled = handled.__context__
        raise interrupt.raised

    # what is ignored, as Ctrl-C in the background of a shell, is not for us
    before = {number: signal.getsignal(number) for number in SIGNALS}
    handlers: dict[int, Any] = {number: stop for number in SIGNALS if before[number] not in (signal.SIG_IGN, None)}
    if hasattr(signal, "setitimer"):
        before[signal.SIGALRM] = signal.getsignal(signal.SIGALRM)
        handlers[signal.SIGALRM] = again
    for number, handler in handlers.items():
        signal.signal(number, handler)
    try:
        yield
    finally:
        if interrupt.number and hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0)
        for number in handlers:
            signal.signal(number, before[number])
