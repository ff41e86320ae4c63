"""Mass properties of meshes: STL, 3MF and GLB. Each closed mesh is a body; meshes hold no joints."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from defusedxml import DefusedXmlException, ElementTree

from trunnion.errors import Finding, MechanismError
from trunnion.exchange.draft import Array, Body, Draft, ImportOptions, free_name

__all__ = ["read"]

MOST_BYTES, MOST_XML = 30_000_000, 20_000_000  # of a file; of the model of a 3MF, unpacked
MOST_BODIES = 500
DEEPEST = 8  # components of components in a 3MF
UNITS = {"micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0}
TROUBLE = (
    ArithmeticError, AttributeError, DefusedXmlException, ElementTree.ParseError, EOFError, ImportError, LookupError,
    NotImplementedError, RuntimeError, TypeError, ValueError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
Mesh = tuple[str, Array, Array]  # name, vertices in m, triangles


def read(path: Path, options: ImportOptions) -> Draft:
    """Mass, centre and inertia of every mesh of a file.

    Parameters
    ----------
    path : the file. options : `density` of the parts, `unit` of an STL, which states none.

    Returns
    -------
    Draft : bodies without pairs, in the frame of the file; a mesh that is not closed has no mass.

    Raises
    ------
    MechanismError : if the file cannot be read.
    """
    draft, suffix = Draft(), path.suffix.lower()
    if path.stat().st_size > MOST_BYTES:
        raise MechanismError(Finding(f"is larger than {MOST_BYTES:,} bytes", file=str(path), remedy="coarsen the mesh"))
    try:
        if suffix == ".3mf":
            meshes = list(_of_3mf(path))
        elif suffix == ".stl":
            what = f"an STL states no unit; {1e3 * options.unit:g} mm is taken for 1"
            if not options.unit_stated:
                draft.warn("exchange.unit", "file", what, "state it with --unit")
            mesh = trimesh.load_mesh(io.BytesIO(path.read_bytes()), file_type="stl")
            meshes = [(path.stem, *_triangles(mesh, options.unit))]
        else:
            scene = trimesh.load_scene(io.BytesIO(path.read_bytes()), file_type="glb")
            meshes = [(mesh.metadata.get("name", "part"), *_triangles(mesh, 1.0)) for mesh in scene.dump()]
    except TROUBLE as error:
        if isinstance(error, MechanismError):
            raise
        raise MechanismError(Finding("cannot be read as a mesh, or is damaged", file=str(path))) from None
    if not any(len(faces) for _, _, faces in meshes) or len(meshes) > MOST_BODIES:
        what = f"holds no triangles, is cut off, or holds more than {MOST_BODIES} meshes"
        raise MechanismError(Finding(what, file=str(path)))
    draft.ground = "ground"
    draft.bodies["ground"] = Body("ground")
    for name, vertices, faces in meshes:
        body = _weighed(draft, free_name(name, draft.bodies), vertices, faces, options.density)
        draft.bodies[body.name] = body
    draft.note("exchange.joints", "file", "a mesh holds no joints", "copy the links into a model, or import STEP")
    return draft


def _triangles(mesh: Any, unit: float) -> tuple[Array, Array]:
    return unit * np.asarray(mesh.vertices, float), np.asarray(mesh.faces, int)


def _weighed(draft: Draft, name: str, vertices: Array, faces: Array, density: float) -> Body:
    """A body with the mass of a closed mesh; one that is open has none, and says so."""
    body = Body(name)
    mesh = trimesh.Trimesh(vertices, faces, process=True)
    if not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
        what = "has no triangles, or corners that are no numbers"
        draft.warn("exchange.mesh", f"links.{name}", what, "export it again")
        return body
    size = ", ".join(f"{1e3 * extent:.6g}" for extent in mesh.extents)
    body.comments.append(f"a mesh of {len(mesh.faces):,} triangles, {size} mm large")
    if not mesh.is_watertight or not mesh.is_winding_consistent:
        what = "is not closed, or its triangles do not all face outwards; it has no mass here"
        draft.warn("exchange.open_mesh", f"links.{name}", what, "mend the mesh, or state mass, centre and inertia")
        return body
    mesh.density = density
    properties = mesh.mass_properties
    if mesh.body_count > 1:
        what = f"holds {mesh.body_count} separate shells; they are weighed as one body"
        draft.note("exchange.shells", f"links.{name}", what, "export parts that move against each other apart")
    sign = -1.0 if properties.volume < 0 else 1.0  # inside out throughout
    if not sign * properties.volume > 0:
        draft.warn("exchange.open_mesh", f"links.{name}", "encloses no volume; it has no mass here", "mend the mesh")
        return body
    body.mass, body.centre = float(sign * properties.mass), np.array(properties.center_mass)
    body.inertia = sign * np.array(properties.inertia)
    body.comments.append(f"mass by a density of {density:g} kg/m³; a mesh cuts the corners of curved faces")
    return body


# ---- 3MF ----------------------------------------------------------------------------------------------------------


def _of_3mf(path: Path) -> Iterator[Mesh]:
    """The meshes of a 3MF where they are built, m: a zip with an XML model that states its unit."""
    with zipfile.ZipFile(path) as archive:
        names = [entry.filename for entry in archive.infolist() if entry.filename.lower().endswith(".model")]
        main = next((name for name in names if "3dmodel" in name.lower()), None)
        if main is None:
            raise ValueError("no model")
        if archive.getinfo(main).file_size > MOST_XML:
            raise MechanismError(Finding(f"unpacks to more than {MOST_XML:,} bytes", file=str(path)))
        with archive.open(main) as stream:
            root = ElementTree.fromstring(stream.read(MOST_XML), forbid_dtd=True)
    unit = UNITS[root.get("unit", "millimeter")]
    objects = {part.get("id", ""): part for part in root.iterfind("{*}resources/{*}object")}
    count = [0]

    def placed(number: str, transform: Array, depth: int) -> Iterator[Mesh]:
        part = objects[number]
        count[0] += 1
        if depth > DEEPEST or count[0] > MOST_BODIES:
            raise MechanismError(Finding(f"holds more than {MOST_BODIES} parts", file=str(path)))
        name = part.get("name") or f"part {number}"
        for mesh in part.iterfind("{*}mesh"):
            corners = [[float(v.get(k, "nan")) for k in "xyz"] for v in mesh.iterfind("{*}vertices/{*}vertex")]
            corners_of = mesh.iterfind("{*}triangles/{*}triangle")
            faces = [[int(t.get(k, "-1")) for k in ("v1", "v2", "v3")] for t in corners_of]
            vertices, triangles = np.array(corners).reshape(-1, 3), np.array(faces, int).reshape(-1, 3)
            if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(vertices):
                raise ValueError("a triangle without a corner")
            yield name, unit * (vertices @ transform[:3] + transform[3]), triangles
        for component in part.iterfind("{*}components/{*}component"):
            yield from placed(component.get("objectid", ""), _chained(_matrix(component), transform), depth + 1)

    for item in root.iterfind("{*}build/{*}item"):
        yield from placed(item.get("objectid", ""), _matrix(item), 0)


def _matrix(part: Any) -> Array:
    """The transform of a part of a 3MF, (4, 3): points are rows to its left, the last row is the shift."""
    text = part.get("transform")
    return np.array(text.split(), float).reshape(4, 3) if text else np.eye(4)[:, :3]


def _chained(inner: Array, outer: Array) -> Array:
    """The transform that is first the inner one, then the outer."""
    return np.vstack([inner[:3] @ outer[:3], inner[3] @ outer[:3] + outer[3]])
