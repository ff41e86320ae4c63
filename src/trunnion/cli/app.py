"""The command line: every verb of the library, with the same words; whatever ends a run is one line and an exit status.

0 fine, 1 findings (cannot be assembled somewhere, locks, dead centre), 2 bad input, 3 a fault of the program itself,
130 stopped by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP. Only `--debug` shows where a fault of the program arose. A signal
ends every verb alike: no result of a part of the work is shown or written, and files of before stay.
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
from itertools import chain
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from trunnion.cli.built import allocate, assemble, play, tolerance
from trunnion.cli.measured import compare, data, identify, rig
from trunnion.cli.model import check, examples, export, import_, schema, studio
from trunnion.cli.motion import analyse, design, locking, plot, report, simulate, sweep
from trunnion.errors import MechanismError
from trunnion.version import __version__

BAD_INPUT, FAULT, STOPPED = 2, 3, 130
LONGEST = 300  # signs of what an exception says
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
AGAIN = 0.05  # s, after which what ends a run is raised anew where it got lost
GROUPS = {
    "Model": (check, examples, schema, studio),
    "Motion and forces": (analyse, simulate, locking, design),
    "As built": (assemble, play, tolerance, allocate),
    "Many mechanisms": (sweep,),
    "Measured data": (rig, data, compare, identify),
    "Pictures": (plot, report),
    "Other programs": (import_, export),
}
# Each runs in a folder with the models that `trunnion examples NAME` copies; mapping.yaml is one of measured data.
EXAMPLES = {
    "check": ("durango-fourbar.yaml", "durango-fourbar.yaml --list"),
    "examples": ("", "durango-fourbar"),
    "schema": ("-o model.schema.json",),
    "studio": ("durango-fourbar.yaml", "."),
    "analyse": (
        "durango-fourbar.yaml",
        "durango-fourbar.yaml --set AB=2.1m --friction off -o cycle.csv",
        "durango-fourbar.yaml --at 60deg",
    ),
    "simulate": ("flywheel-press.yaml --time 3s -o start.png", "flywheel-press.yaml --steady --report steady.html"),
    "locking": ("drawing-press.yaml --near 1.2 -o margin.png",),
    "design": ("durango-fourbar.yaml --fluctuation 0.02",),
    "assemble": ("misaligned-hinges.yaml -o clearance.csv",),
    "play": ("toleranced-slider-crank.yaml --measure piston.Q.x --at 60deg",),
    "tolerance": ("toleranced-fourbar.yaml --samples 100000 --report yield.html",),
    "allocate": ("toleranced-fourbar.yaml --yield 0.99 --write cheapest.yaml",),
    "sweep": ("durango-fourbar.yaml --over AB=1.6m:2.4m:9 -o efficiency.png",),
    "rig": ("pezzuti-cardan.yaml cardan-rig.yaml", "pezzuti-cardan.yaml cardan-rig.yaml -o lab"),
    "data": ("lab/mapping.yaml -o turns.csv",),
    "compare": ("pezzuti-cardan.yaml lab/mapping.yaml --report lab.html",),
    "identify": ("pezzuti-cardan.yaml lab/mapping.yaml --parameter joint_defaults.friction.coefficient",),
    "plot": ("durango-fourbar.yaml --kind torque -o torque.png", "durango-fourbar.yaml -o plots"),
    "report": ("durango-fourbar.yaml -o durango.html",),
    "import": ("crank.step -o crank.yaml --material aluminium", "robot.urdf -o robot.yaml --ground base"),
    "export": ("durango-fourbar.yaml -o fourbar.xml --at 60deg", "durango-fourbar.yaml -o fourbar.dxf"),
}


def _name(verb: Callable[..., None]) -> str:
    return verb.__name__.rstrip("_")  # `import` is a word of Python


class Verbs(TyperGroup):
    """The verbs under the questions that they answer."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the verbs, group by group."""
        for title, verbs in GROUPS.items():
            names = [name for name in map(_name, verbs) if name in self.commands]
            rows = [(name.ljust(9), self.commands[name].get_short_help_str(68)) for name in names]
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


app = typer.Typer(
    name="trunnion",
    cls=Verbs,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Analysis of linkages as built, with friction, play, axis errors and tolerances.",
    no_args_is_help=True,
    add_completion=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


for function in chain.from_iterable(GROUPS.values()):
    lines = "\n".join(f"  trunnion {_name(function)} {words}".rstrip() for words in EXAMPLES[_name(function)])
    app.command(_name(function), epilog=f"\b\nExamples:\n{lines}")(function)

VERBS = app.registered_commands


def _version(show: bool) -> None:
    if show:
        print(f"trunnion {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of a program fault. With any verb.")
    ] = False,
) -> None:
    """Options of the program itself."""


def main() -> None:
    """Run the command line; every failure is a message and an exit status, never a traceback."""
    for stream in (sys.stdout, sys.stderr):  # names may be Greek whatever the terminal's code page is
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(encoding="utf-8", errors="replace")
    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    debug = "--debug" in words[:end]  # before or behind the verb
    words = [word for place, word in enumerate(words) if word != "--debug" or place > end]
    sys.argv[1:] = words
    named = [command for command in VERBS if command.callback and command.name in words[:1]]
    app.registered_commands = named or VERBS  # Typer reads the options of all: those of one verb are a twentieth
    try:
        status = status_of(app, debug)
    finally:
        app.registered_commands = VERBS
    sys.exit(status)


# ---- the edge of the program -----------------------------------------------------------------------------------------


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
            code = BAD_INPUT if isinstance(error, OSError) else FAULT
            if isinstance(error, OSError):
                name = [str(error.filename)] if error.filename else []
                _say(": ".join(["error", *name, error.strerror or str(error)]))
            elif isinstance(error, MemoryError):
                _say("error: not enough memory — use fewer --steps, samples or points")
            else:
                what = " ".join(str(error).split())[:LONGEST]
                place = traceback.extract_tb(error.__traceback__)[-1:]
                where = "".join(f", {os.path.basename(frame.filename)}:{frame.lineno}" for frame in place)
                fault = f"{__version__} itself ({type(error).__name__}{where}){': ' * bool(what)}{what}"
                remedy = "please report this line with the command and its files; --debug shows where it arose"
                _say(f"error: a fault of Trunnion {fault} — {remedy}")
    return int(code or 0)


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


if __name__ == "__main__":
    main()
