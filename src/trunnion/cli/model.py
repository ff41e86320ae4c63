"""`trunnion check`, `examples`, `schema` and `studio`: the model file itself; `import` and `export`: files of other
programs."""

import math
import os
import socket
from collections.abc import Iterable
from pathlib import Path
from typing import Literal

from typer import Argument, Option

from trunnion.cli.options import Model, placed, verb
from trunnion.cli.result import YAML, check_target, end, line, say, show_rows, write_text, wrote
from trunnion.errors import Finding, MechanismError, counted
from trunnion.files import folder, whole

HEAD = ["name", "value", "unit"]


@verb(
    lacks="seat",
    assemblies="Also draw the assembly modes of each group: a .png, .svg or .pdf file.",
    list="List what can be set, swept and measured, with units and values.",
)
def check(model: Model, assemblies: Path | None = None, list_: bool = False) -> None:
    """Check a model: findings, mobility, structure, assembly modes."""
    if list_:
        _list(model)
        return
    from trunnion.cycle.inspect import check as inspect
    from trunnion.views.assembly import lines

    if assemblies:
        from trunnion.views.draw import check_figure

        check_figure(assemblies)
    mechanism = model.read()
    with model.lines():
        checked = inspect(mechanism)
    rank = checked.rank_mobility
    by_rank = "by rank unknown: no position can be assembled" if rank is None else f"{rank} by rank"
    line(mechanism.name or model.file.name, "bold")
    line(f"mobility {checked.mobility} by formula, {by_rank}; drivers: {len(mechanism.drivers)}")
    line(f"formula  {checked.formula or '(no moving link)'}")
    for number, (module, count) in enumerate(zip(checked.plan.modules, checked.assemblies, strict=True)):
        modes = "" if module.rank == 1 else f", {count} assembly {'mode' if count == 1 else 'modes'}"
        solver = "general group" if module.kind == "general" else "closed form"
        joints = ", ".join(module.joints)
        line(f"  {module.label:<24} links {', '.join(module.links)}; joints {joints}; {solver}{modes}")
        for choice in (choice for choice in checked.choices if choice.module == number):
            for text in lines(choice):
                line(f"    {text}")
    if assemblies:
        from trunnion.views.draw import save
        from trunnion.views.mode_drawings import ways as drawings

        save(drawings(mechanism, checked.choices), assemblies)
        wrote(assemblies)
    end(checked.findings, model.file, "assembly measures", every=True)


def _list(model: Model) -> None:
    """Print what can be set, swept and measured."""
    from trunnion.cycle.model_measures import vocabulary

    mechanism = model.read()
    with model.lines():
        names, findings = vocabulary(mechanism)
    groups = {
        ("sweep",): ("parameters for --set and sweep --over", "written as"),
        ("set",): ("parameters for --set only", "written as"),
        ("stated", "measure"): ("measures: figures of the cycle, or values at the start", "what"),
    }
    for uses, (title, text) in groups.items():
        rows = [
            [entry.name, f"{entry.value + 0.0:.6g}" if math.isfinite(entry.value) else "",
             "" if entry.unit in ("1", "SI") else entry.unit, entry.text]
            for entry in names if entry.use in uses
        ]  # fmt: skip
        if rows:
            show_rows(title, [*HEAD, text], rows)
    say(placed(findings, model.file, ["measures"]))


USUAL = 8765


@verb(
    file="Model to open, or the folder of models.",
    port="Port on this machine; default: 8765, or any if that is taken.",
    open=Option("--open/--no-open", help="Open the browser."),
)
def studio(file: Path | None = None, port: int | None = None, open_: bool = True) -> None:
    """Draw a mechanism in the browser, drag it, watch its forces."""
    from trunnion.cli.forms import forms

    try:
        from trunnion.studio.server import Studio
    except ImportError:
        what = "the studio is not installed"
        raise MechanismError(Finding(what, remedy="install it: pip install 'trunnion[studio]'")) from None
    path = Path(os.path.realpath(file or Path()))  # a link in a circle stays one, and does not exist
    if file is not None and not path.exists():
        raise MechanismError(Finding("does not exist", str(file), "name a model file or a folder"))
    folder, opened = (path, None) if path.is_dir() else (path.parent, path.name)
    bound = _bound(port)
    server = Studio(folder, opened, bound.getsockname()[1], forms=forms())
    line(f"studio: {server.address}")
    line("It answers this machine alone. Ctrl-C ends it.")
    if open_:
        import webbrowser

        webbrowser.open(server.entrance())
    server.server().run(sockets=[bound])


def _bound(stated: int | None) -> socket.socket:
    """A socket on the loopback, at the stated port; else at the usual one, where the browser finds unsaved work again,
    or at any if that is taken. MechanismError if it cannot be had."""
    reason = ""
    for port in [USUAL, 0] if stated is None else [stated]:
        try:  # a browser that comes before the server runs waits in the backlog instead of being refused
            return socket.create_server(("127.0.0.1", port), backlog=128)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or str(error)
    raise MechanismError(Finding(f"port {stated} cannot be had: {reason}", "--port", "choose another, or 0"))


@verb(
    name=Argument(help="Example to copy; without it, all are listed."),
    to="Folder to copy it into.",
    force="Overwrite a file of that name.",
)
def examples(name: str | None = None, to: Path = Path(), force: bool = False) -> None:
    """List the example models, rigs and drawings, or copy one."""
    here = Path(__file__).resolve().parent.parent
    place = here / "examples" if (here / "examples").is_dir() else here.parents[1] / "examples"  # of the source tree
    paths = {path.stem: path for kind in ("*.yaml", "rig/*-rig.yaml", "*.step") for path in sorted(place.glob(kind))}
    for path in paths.values() if name is None else ():
        texts = path.read_text("utf-8").splitlines()
        drawing = "a drawing for `trunnion import`" if path.suffix == ".step" else ""
        line(f"{path.stem:<28} {next((text[5:].strip() for text in texts if text.startswith('name:')), drawing)}")
    if name is None:
        return
    source = paths.get(name.removesuffix(".yaml").removesuffix(".step"))
    if source is None:
        raise MechanismError(Finding(f"there is no example '{name}'", remedy=f"use one of {', '.join(paths)}"))
    folder(to)
    target = to / source.name
    if target.exists() and not force:
        raise MechanismError(Finding("exists already", str(target), "use --force to overwrite it"))
    with whole(target) as temporary:
        temporary.write_bytes(source.read_bytes())
    wrote(target)


@verb(of="File: model, or data for the mapping of measured data.", out="Write it to a file.")
def schema(of: Literal["model", "data"] = "model", out: Path | None = None) -> None:
    """Print the JSON Schema of model or mapping file, for editors."""
    if of == "data":
        from trunnion.rig.reading.mapping import schema_text

        text = schema_text()
    else:
        from trunnion.model.schema import SCHEMA_FILE

        text = SCHEMA_FILE.read_text("utf-8")
    if out is None:
        print(text, end="")
    else:
        write_text(text, out)


@verb(
    file="Drawing or model of another program, by extension.",
    out="The model file to write: .yaml.",
    ground="The part that does not move.",
    drive="The joint that is driven.",
    speed="Speed of the driver: 60rpm, 0.1m/s.",
    material="Material of parts without one: steel, aluminium, …",
    density="Density instead: 7850kg/m^3.",
    gap="Greatest difference of the radii of a pin and its hole.",
    unit="Length unit of a file that states none, such as mm, in, m.",
    force="Overwrite the model file if it exists.",
)
def import_(
    file: Path, out: Path, ground: str = "", drive: str = "", speed: str = "", material: str = "steel",
    density: str | None = None, gap: str = "0.5mm", unit: str = "mm", force: bool = False,
) -> None:  # fmt: skip
    """Make a model file of a drawing or a model of another program."""
    from trunnion.exchange import import_file, model_text
    from trunnion.model.file import entries_of, place
    from trunnion.model.mechanism import Mechanism

    check_target(out, "--out", "a model", YAML, force)
    draft = import_file(file, ground, drive, speed, material, density, gap, unit)
    text = model_text(draft)
    write_text(text, out)
    line(f"{draft.source}: {counted(len(draft.bodies), 'link')}, {counted(len(draft.pairs), 'joint')}")
    wrote(out)
    data, lines = entries_of(text)
    checked: Iterable[Finding] = ()  # links without joints, as those of a mesh, are no mechanism yet
    if draft.pairs:
        try:
            checked = Mechanism.model_validate(data).checked
        except MechanismError as error:
            checked = error.findings
    end([*draft.findings, *place(checked, str(out), lines, data)], out, every=True)


@verb(
    lacks="table friction seat",
    out="The file to write; its extension is the format.",
    at="Position of the mechanism: 60deg, 20mm, 0.1s.",
    frames="Number of positions in a file that moves.",
    original=Option("--from", metavar="FILE", help="The STEP file it was imported from, whose parts are to be moved."),
    magnify="Factor of the links' displacements by errors and play: 100.",
)
def export(
    model: Model, out: Path, at: str | None = None, frames: int = 120, original: str | None = None,
    magnify: float = 1.0,
) -> None:  # fmt: skip
    """Write a mechanism for another program, at a position."""
    from trunnion.exchange import export_model

    mechanism = model.read()
    with model.lines():
        findings = export_model(mechanism, out, at, frames, original, magnify)
    wrote(out)
    end(findings, model.file, every=True)
