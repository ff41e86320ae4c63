"""The table of file formats: by extension, what reads and what writes them.

A new format is a function `read(path, options)`, which returns a Draft, or `write(positions, path)`, which returns the
findings of what it cannot hold, and an entry here.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.exchange.draft import MATERIALS, Draft, ImportOptions, faults_of, few, positions_of, refused
from trunnion.exchange.model_file import complete
from trunnion.files import reading, whole
from trunnion.model.names import nearest
from trunnion.model.quantity import Quantity
from trunnion.model.units import KINDS, UnitError

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

LINKS = "http:/", "https:/"  # how a path begins that is a link: its text is read, nothing is fetched
FEWEST = 4  # positions of a cycle of which the first is written
LARGEST = 200_000_000  # bytes of a file that is read


@dataclass(frozen=True)
class Format:
    """A file format.

    Parameters
    ----------
    name : of the format.
    reads, writes : module in `exchange` and function that read and write it; empty if none does.
    moves : whether it takes the whole cycle, not a position. magnifies : whether it is looked at, not computed with.
    parts : module and function that write the parts of a file that a model is of, where they are then.
    """

    name: str
    reads: str = ""
    writes: str = ""
    moves: bool = False
    magnifies: bool = False
    parts: str = ""


STEP = Format("STEP", "step.read", "step.write", magnifies=True, parts="step.write_moved")
PMKS = Format("PMKS+", "linkages.read")
MESH = "mesh.read"
FORMATS: dict[str, Format] = {
    ".mjcf": Format("MJCF", "mjcf.read", "mjcf.write"),
    ".sdf": Format("SDF", "sdf.read", "sdf.write"),
    ".urdf": Format("URDF", "sdf.read_urdf", "sdf.write_urdf"),
    ".step": STEP,
    ".stp": STEP,
    ".dxf": Format("DXF", "dxf.read", "drawing.write"),
    ".stl": Format("STL", MESH),
    ".3mf": Format("3MF", MESH),
    ".glb": Format("glTF", MESH, "glb.write", moves=True, magnifies=True),
    ".fcstd": Format("FreeCAD", "freecad.read"),
    ".pmks": PMKS,
    ".url": PMKS,
    ".txt": PMKS,
    ".json": Format("pylinkage", "linkages.read"),
    ".fmu": Format("FMU", writes="fmu.write"),
}


def _entry(path: Path, verb: str) -> Format:
    """The format of a file by its extension, `.xml` by its first element, which it must have; verb: reads or writes."""
    suffix = path.suffix.lower()
    if suffix == ".xml":
        text = path.read_bytes()[:65536] if verb == "reads" else b""
        roots = {b"<robot": ".urdf", b"<sdf": ".sdf"}
        suffix = next((ending for root, ending in roots.items() if root in text and b"<mujoco" not in text), ".mjcf")
    if suffix in FORMATS and getattr(FORMATS[suffix], verb):
        return FORMATS[suffix]
    possible = ", ".join(ending for ending, kind in FORMATS.items() if getattr(kind, verb))
    what = (
        f"has the extension {path.suffix or '(none)'!r}, which is not {'read' if verb == 'reads' else 'written'} here"
    )
    raise MechanismError(Finding(what, file=str(path), remedy=f"use one of {possible}"))


def _call(place: str, *arguments: Any) -> Any:
    """What a function of a format gives; MechanismError that names the extra if a library of it is missing."""
    module, _, function = place.partition(".")
    try:
        loaded = import_module(f"trunnion.exchange.{module}")
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("trunnion"):
            raise
        what = f"this format needs {error.name}, which is not installed"
        raise MechanismError(Finding(what, "file", "pip install 'trunnion[cad]'")) from None
    return getattr(loaded, function)(*arguments)


def import_file(
    path: str | os.PathLike[str],
    ground: str = "",
    drive: str = "",
    speed: str | float = "",
    material: str = "steel",
    density: str | float | None = None,
    gap: str | float = "0.5 mm",
    unit: str = "mm",
) -> Draft:
    """Read the mechanism in a file of another program.

    Parameters
    ----------
    path : the file; its extension decides the format, see `FORMATS`. Or a link that holds a drawing, as of PMKS+.
    ground, drive : names of the part that does not move and of the joint that is driven; found if not given.
    speed : of the drive; that of the file, else a usual one, if not given.
    material, density : of parts whose file states neither mass nor density.
    gap : greatest difference of the radii of a pin and its hole. unit : of lengths in a file that states none.
        Numbers are in SI, texts have a unit.

    Returns
    -------
    Draft : with `findings` of what is doubtful; `model_text` makes the text of the model file of it.

    Raises
    ------
    MechanismError : with the file and what is wrong with it.
    """
    path = Path(path)
    if density is None and material not in MATERIALS:
        remedy = nearest(material, MATERIALS)
        raise MechanismError(Finding(f"{material!r} is no material of the table", "material", remedy))
    heaviness = MATERIALS[material] if density is None else _number(density, "density", "density")
    length = _number(f"1 {unit}", "unit", "length")
    options = ImportOptions(ground, heaviness, _number(gap, "gap", "length"), drive, length, unit != "mm")
    rate, turns = None, None  # whether it is the speed of a joint that turns; a plain number may be either
    if speed != "":
        try:
            rate = _number(speed, "speed", "angular speed")
            turns = None if isinstance(speed, (int, float)) else True
        except MechanismError:
            rate, turns = _number(speed, "speed", "speed"), False
    with faults_of(path):
        if str(path).startswith(LINKS):
            draft: Draft = _call("linkages.read_link", str(path))
        else:
            reading(path)
            entry = _entry(path, "reads")
            size = path.stat().st_size
            if not size:
                raise refused("is empty")
            few(size, LARGEST, "bytes")
            draft = _call(entry.reads, path, options)
    draft.source = draft.source or path.name
    draft.name = draft.name or path.stem
    return complete(draft.checked(), ground, drive, rate, turns)


def _number(value: str | float, name: str, quantity: str) -> float:
    """An option in SI; all but the speed are above 0."""
    kind = KINDS[quantity]
    remedy = f"give a {kind.name} such as {kind.example}"
    try:
        plain = float(value)
    except ValueError:
        plain = value  # type: ignore[assignment]  # a text with a unit
    try:
        number = float(np.asarray(Quantity.read(plain, kind).evaluate()))
    except (UnitError, KeyError) as error:
        what = getattr(error, "what", f"'{value}' is no {kind.name}")
        raise MechanismError(Finding(what, name, remedy)) from None
    if not 0 < abs(number) < np.inf or (number < 0 and name != "speed"):
        raise MechanismError(Finding(f"{value!r} is out of range", name, remedy))
    return number


def export_model(
    mechanism: Mechanism,
    path: str | os.PathLike[str],
    at: float | str | None = None,
    frames: int = 120,
    original: str | os.PathLike[str] | None = None,
    magnify: float = 1.0,
) -> list[Finding]:
    """Write a mechanism in the format of another program.

    Parameters
    ----------
    mechanism : the model.
    path : the file; its extension decides the format.
    at : the position, as for `analyse`; the first of the cycle if not given. Formats that move take the whole cycle.
    frames : number of positions in a format that moves.
    original : the STEP file that the model was imported from, whose parts are written where they are then.
    magnify : factor of the displacements of the links from the ideal mechanism, in formats that are looked at.

    Returns
    -------
    list of Finding : what the format cannot hold.

    Raises
    ------
    MechanismError : if the mechanism has no solution there or the format cannot hold it.
    """
    path = Path(path)
    entry = _entry(path, "writes")
    if magnify != 1 and not entry.magnifies:
        what = f"a model in {entry.name} has the mechanism's own places; they are not magnified"
        raise MechanismError(Finding(what, "--magnify", "leave it out, or write .step or .glb"))
    if not np.isfinite(magnify):
        raise MechanismError(Finding(f"is {magnify}", "--magnify", "give a number such as 100"))
    positions = positions_of(mechanism, *((frames, None) if entry.moves else (FEWEST, at)), magnify=magnify)
    if original is not None:
        if not entry.parts:
            raise MechanismError(Finding(f"no parts are moved in {entry.name}", "--from", "write a .step file"))
        reading(original)
    with whole(path) as temporary:
        if original is None:
            findings: list[Finding] = _call(entry.writes, positions, temporary)
        else:
            findings = _call(entry.parts, positions, temporary, Path(original))
    return findings
