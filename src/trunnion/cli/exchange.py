"""`trunnion import` and `trunnion export`: files of other programs."""

from collections.abc import Iterable
from pathlib import Path

from typer import Option

from trunnion.cli.files import verb
from trunnion.cli.options import Model
from trunnion.cli.result import YAML, check_target, end, write_text
from trunnion.cli.terminal import line, wrote
from trunnion.errors import Finding, MechanismError, counted

__all__ = ["export", "import_"]


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
