"""The edge of the program: whatever ends a run is one line and an exit status, never a traceback.

0 fine, 1 findings, 2 bad input, 3 a fault of the program itself, 130 stopped by Ctrl-C. Only `--debug` shows where a
fault of the program arose.

Ctrl-C ends every verb alike: no result of a part of the work is shown or written, and files of before stay. Samples
that are kept in a checkpoint are told.
"""

from __future__ import annotations

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


class _Interrupt:
    """Whether Ctrl-C came, also where what runs made another exception of it."""

    came = False


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
    except MechanismError as error:
        for finding in error.findings:
            _say(str(finding))
        code = BAD_INPUT
    except BaseException as error:
        if interrupt.came or isinstance(error, KeyboardInterrupt):
            _say("stopped")
            code = STOPPED
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
        _say(f"error: {error.filename or ''}: {error.strerror or error}")
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
    """Ctrl-C raises KeyboardInterrupt, and is remembered: a library may make an ImportError of it, or drop it.

    It is dropped where it comes while Python clears up an object: there the run ends at once.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(*_: Any) -> None:
        interrupt.came = True
        raise KeyboardInterrupt

    def lost(told: Any) -> None:
        if issubclass(told.exc_type, KeyboardInterrupt):
            leave()
        before_lost(told)

    before, before_lost = signal.getsignal(signal.SIGINT), sys.unraisablehook
    ours = before is not signal.SIG_IGN  # in the background of a shell it is not for us
    if ours:
        signal.signal(signal.SIGINT, stop)
    sys.unraisablehook = lost
    try:
        yield
    finally:
        sys.unraisablehook = before_lost
        if ours:
            signal.signal(signal.SIGINT, before)


def leave(*_: Any) -> None:
    """End the process at once, with what was printed so far: for Ctrl-C where nothing is begun that would be lost."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, RuntimeError, ValueError):  # it is being written to, or gone
            continue
    os.write(2, b"stopped\n")
    os._exit(STOPPED)
