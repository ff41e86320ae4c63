"""The table of file formats: by extension, what reads and what writes them, and the module that does it.

A new format is a module with `read(path, options)`, which returns a Draft, or `write(positions, path)`, and
an entry here. One with `write_moved(positions, path, original)` also moves the parts of the file that a model is of.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.exchange.draft import Draft
from trunnion.exchange.model_file import complete
from trunnion.exchange.skeleton import positions_of
from trunnion.files import reading, whole
from trunnion.model.names import nearest
from trunnion.model.quantity import Quantity
from trunnion.model.units import KINDS, Kind, UnitError

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

__all__ = ["FORMATS", "MATERIALS", "Format", "ImportOptions", "export_model", "import_file"]

MATERIALS = {"steel": 7850.0, "stainless": 7900.0, "aluminium": 2700.0, "brass": 8500.0, "cast-iron": 7200.0,
             "titanium": 4430.0, "nylon": 1140.0, "pom": 1410.0, "abs": 1050.0, "pla": 1240.0}  # fmt: skip
LINKS = "http:/", "https:/"  # how a path begins that is a link: its text is read, nothing is fetched
FEWEST = 4  # positions of a cycle of which the first is written
LARGEST = 200_000_000  # bytes of a file that is read


@dataclass(frozen=True)
class Format:
    """A file format: its name, and the modules in `exchange` that read and write it; empty if none does."""

    name: str
    reads: str = ""
    writes: str = ""


FORMATS: dict[str, Format] = {
    ".mjcf": Format("MJCF", "mjcf", "mjcf"),
    ".sdf": Format("SDF", "sdf", "sdf"),
    ".urdf": Format("URDF", "urdf", "urdf"),
    ".step": Format("STEP", "step", "step"),
    ".stp": Format("STEP", "step", "step"),
    ".dxf": Format("DXF", "dxf", "drawing"),
    ".stl": Format("STL", "mesh"),
    ".3mf": Format("3MF", "mesh"),
    ".glb": Format("glTF", "mesh", "glb"),
    ".fcstd": Format("FreeCAD", "freecad"),
    ".pmks": Format("PMKS+", "pmks"),
    ".url": Format("PMKS+", "pmks"),
    ".txt": Format("PMKS+", "pmks"),
    ".json": Format("pylinkage", "pylinkage"),
    ".fmu": Format("FMU", writes="fmu"),
}


@dataclass(frozen=True)
class ImportOptions:
    """How a file is read.

    Parameters
    ----------
    ground : the part that does not move; found by the reader if empty.
    density : kg/m³ of parts whose file states none.
    gap : greatest difference of the radii of a pin and its hole that still is a joint, m.
    drive : the joint that is driven; found by the reader if empty.
    unit : length unit of a file that states none, in m; unit_stated : whether the user stated it.
    """

    ground: str = ""
    density: float = MATERIALS["steel"]
    gap: float = 0.5e-3
    drive: str = ""
    unit: float = 1e-3
    unit_stated: bool = False


def _format_of(path: Path, reads: bool) -> Format:
    """The format of a file by its extension, `.xml` by its first element; MechanismError if there is none."""
    suffix = path.suffix.lower()
    if suffix == ".xml":
        suffix = _xml_kind(path) if reads else ".mjcf"
    entry = FORMATS.get(suffix)
    possible = ", ".join(ending for ending, kind in FORMATS.items() if (kind.reads if reads else kind.writes))
    if entry is None or not (entry.reads if reads else entry.writes):
        what = f"has the extension {path.suffix or '(none)'!r}, which is not {'read' if reads else 'written'} here"
        raise MechanismError(Finding(what, file=str(path), remedy=f"use one of {possible}"))
    return entry


def _xml_kind(path: Path) -> str:
    """The format of an `.xml` file by the name of its first element."""
    with _readable(path), path.open("rb") as stream:
        text = stream.read(65536)
    for root, suffix in ((b"<mujoco", ".mjcf"), (b"<robot", ".urdf"), (b"<sdf", ".sdf")):
        if root in text:
            return suffix
    return ".mjcf"


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """What the system refuses is a finding about the file."""
    try:
        yield
    except OSError as error:
        raise MechanismError(Finding(f"cannot be read: {error.strerror or error}", file=str(path))) from None


def _module(entry: Format, name: str, path: Path) -> Any:
    """A module of a format; MechanismError that names the extra if a library is missing."""
    try:
        return import_module(f"trunnion.exchange.{name}")
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("trunnion"):
            raise
        what = f"{entry.name} needs {error.name}, which is not installed"
        raise MechanismError(Finding(what, file=str(path), remedy="pip install 'trunnion[cad]'")) from None


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
    heaviness = _material(material) if density is None else _number(density, "density", KINDS["density"])
    largest, length = _number(gap, "gap", KINDS["length"]), _number(f"1 {unit}", "unit", KINDS["length"])
    options = ImportOptions(ground, heaviness, largest, drive, length, unit != "mm")
    rate, turns = _speed(speed)
    if str(path).startswith(LINKS):
        draft = import_module("trunnion.exchange.pmks").read_link(str(path), options)
    else:
        draft = _read(path, options)
    draft.source = draft.source or path.name
    draft.name = draft.name or path.stem
    return complete(draft.checked(), ground, drive, rate, turns)


def _read(path: Path, options: ImportOptions) -> Draft:
    """The draft of a file."""
    entry = _format_of(path, reads=True)
    reading(path)
    with _readable(path):
        size = path.stat().st_size
    if not size or size > LARGEST:
        what = "is empty" if not size else f"has {size:,} bytes; at most {LARGEST:,} are read"
        raise MechanismError(Finding(what, file=str(path), remedy="export the mechanism again, with fewer parts"))
    module = _module(entry, entry.reads, path)
    try:
        with _readable(path):
            draft: Draft = module.read(path, options)
    except MechanismError as error:
        raise MechanismError([replace(finding, file=finding.file or str(path)) for finding in error.findings]) from None
    except (RecursionError, MemoryError):
        raise MechanismError(Finding("is nested too deeply or too large to be read", file=str(path))) from None
    return draft


def _speed(speed: str | float) -> tuple[float | None, bool | None]:
    """A speed in SI, and whether it is one of a joint that turns; a plain number may be either."""
    if speed == "":
        return None, None
    try:
        rate = _number(speed, "speed", KINDS["angular speed"])
    except MechanismError:
        return _number(speed, "speed", KINDS["speed"]), False
    return rate, None if isinstance(speed, (int, float)) else True


def _number(value: str | float, name: str, kind: Kind) -> float:
    """An option in SI, above 0."""
    try:
        plain = float(value)
    except ValueError:
        plain = value  # type: ignore[assignment]  # a text with a unit
    try:
        number = float(np.asarray(Quantity.read(plain, kind).evaluate()))
    except (UnitError, KeyError) as error:
        what = getattr(error, "what", f"'{value}' is no {kind.name}")
        raise MechanismError(Finding(what, name, f"give a {kind.name} such as {kind.example}")) from None
    if not 0 < abs(number) < np.inf or (number < 0 and name != "speed"):
        raise MechanismError(Finding(f"{value!r} is out of range", name, f"give a {kind.name} such as {kind.example}"))
    return number


def _material(name: str) -> float:
    """The density of a material of the table, kg/m³."""
    if name in MATERIALS:
        return MATERIALS[name]
    remedy = nearest(name, MATERIALS)
    raise MechanismError(Finding(f"{name!r} is no material of the table", "material", remedy))


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
    entry = _format_of(path, reads=False)
    module = _module(entry, entry.writes, path)
    moves = getattr(module, "MOVES", False)
    if magnify != 1 and not getattr(module, "MAGNIFIES", False):
        what = f"a model in {entry.name} has the mechanism's own places; they are not magnified"
        raise MechanismError(Finding(what, "--magnify", "leave it out, or write .step or .glb"))
    if not np.isfinite(magnify):
        raise MechanismError(Finding(f"is {magnify}", "--magnify", "give a number such as 100"))
    span = (frames, None) if moves else (FEWEST, at)
    positions = positions_of(mechanism, *span, magnify=magnify)
    if original is None:
        with whole(path) as temporary:
            findings: list[Finding] = module.write(positions, temporary)
        return findings
    if not hasattr(module, "write_moved"):
        raise MechanismError(Finding(f"no parts are moved in {entry.name}", "--from", "write a .step file"))
    source = Path(original)
    reading(source)
    with _readable(source):
        source.open("rb").close()
    with whole(path) as temporary:
        findings = module.write_moved(positions, temporary, source)
    return findings
