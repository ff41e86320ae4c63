"""Ctrl-C: heard at once while waiting, otherwise as soon as the tally is whole again."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, Self, TypeVar

__all__ = ["Interruption", "unheard"]

A = TypeVar("A")


class Interruption:
    """While it is entered, Ctrl-C sets `asked`; it raises only inside `during`, or if pressed a second time.

    A handler that the calling program has set itself stays, and so does what it raises.
    """

    def __init__(self) -> None:
        self.asked = False
        self._open = False
        self._previous: Any = None

    def __enter__(self) -> Self:
        ours = threading.current_thread() is threading.main_thread()
        if ours and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._previous = signal.signal(signal.SIGINT, self._hear)
        return self

    def __exit__(self, *_: object) -> None:
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)

    def _hear(self, _number: int, _frame: FrameType | None) -> None:
        again, self.asked = self.asked, True
        if self._open or again:
            self._open = False
            raise KeyboardInterrupt

    def during(self, waiting: Callable[[], A]) -> A | None:
        """What `waiting` returns; None if Ctrl-C ended it."""
        try:
            self._open = True
            found = waiting()
            self._open = False  # here and not in a `finally`, in which it could still be raised
        except KeyboardInterrupt:
            self.asked = True
            return None
        except BaseException:
            self._open = False
            raise
        return found


@contextmanager
def unheard() -> Iterator[None]:
    """Processes and threads started inside never see a Ctrl-C: they inherit that it is blocked (not on Windows)."""
    if not hasattr(signal, "pthread_sigmask"):  # pragma: no cover - Windows: the worker ignores it once it runs
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
