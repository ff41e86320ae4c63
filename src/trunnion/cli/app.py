"""The command line: every verb of the library, with the same words.

Exit status: 0 fine, 1 findings (cannot be assembled somewhere, locks, dead centre), 2 bad input, 3 a fault of its own.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from itertools import chain
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from trunnion.cli.built import allocate, assemble, play, tolerance
from trunnion.cli.edge import status_of
from trunnion.cli.exchange import export, import_
from trunnion.cli.measured import compare, data, identify, rig
from trunnion.cli.model import check, examples, schema, studio
from trunnion.cli.motion import analyse, design, locking, plot, report, simulate
from trunnion.cli.sweep import sweep
from trunnion.version import __version__

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


if __name__ == "__main__":
    main()
