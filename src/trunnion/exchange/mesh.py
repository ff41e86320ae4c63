"""Meshes as bodies: mass properties of STL, 3MF and GLB; each closed mesh is a body, and meshes hold no joints."""

from __future__ import annotations

import io
import itertools
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from defusedxml import ElementTree

from trunnion.exchange.draft import Array, Body, Draft, ImportOptions, Place, few, free_name, refused

MOST_BYTES, MOST_XML = 30_000_000, 20_000_000  # of a file; of the model of a 3MF, unpacked
MOST_BODIES = 500
DEEPEST = 8  # components of components in a 3MF
UNITS = {"micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0}
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
    few(path.stat().st_size, MOST_BYTES, "bytes")
    if suffix == ".3mf":
        meshes = list(_of_3mf(path))
    elif suffix == ".stl":
        unit, mesh = draft.assumed_unit(options), trimesh.load_mesh(io.BytesIO(path.read_bytes()), file_type="stl")
        meshes = [(path.stem, unit * np.asarray(mesh.vertices, float), np.asarray(mesh.faces, int))]
    else:
        parts: Any = trimesh.load_scene(io.BytesIO(path.read_bytes()), file_type="glb").dump()
        meshes = [
            (part.metadata.get("name", "part"), np.asarray(part.vertices, dtype=float), np.asarray(part.faces))
            for part in parts
        ]
    few(len(meshes), MOST_BODIES, "meshes")
    if not any(len(faces) for _, _, faces in meshes):
        raise refused("holds no triangles, or is cut off")
    draft.ground = "ground"
    draft.bodies["ground"] = Body("ground")
    for name, vertices, faces in meshes:
        if np.any(faces >= len(vertices)) or np.any(faces < 0):
            raise refused("has a triangle without a corner")
        body = Body(free_name(name, draft.bodies))
        draft.bodies[body.name] = body
        mesh = trimesh.Trimesh(vertices, faces, process=True)
        if not np.isfinite(mesh.vertices).all():
            raise refused("has corners that are no numbers")
        shells = f" in {mesh.body_count} shells" if mesh.body_count > 1 else ""
        size = ", ".join(f"{1e3 * extent:.6g}" for extent in mesh.extents) if len(mesh.faces) else 0
        body.comments.append(f"a mesh of {len(mesh.faces):,} triangles{shells}, {size} mm large")
        mesh.density = options.density
        with np.errstate(all="ignore"):  # of a sheet, which has no volume
            properties = mesh.mass_properties
        sign = -1.0 if properties.volume < 0 else 1.0  # inside out throughout
        if mesh.is_watertight and mesh.is_winding_consistent and sign * properties.volume > 0:
            body.mass, body.centre = float(sign * properties.mass), np.array(properties.center_mass)
            body.inertia = sign * np.array(properties.inertia)
            density = f"{options.density:g} kg/m³"
            body.comments.append(f"mass by a density of {density}; a mesh cuts the corners of curved faces")
        else:
            what = "is not closed, encloses no volume, or its triangles do not all face outwards; it has no mass here"
            draft.warn(
                "exchange.open_mesh", f"links.{body.name}", what, "mend the mesh, or state mass, centre and inertia"
            )
    draft.lose("joints, which a mesh does not hold")
    return draft


# ---- 3MF ----------------------------------------------------------------------------------------------------------


def _of_3mf(path: Path) -> Iterator[Mesh]:
    """The meshes of a 3MF where they are built, m: a zip with an XML model that states its unit."""
    with zipfile.ZipFile(path) as archive:
        names = [entry.filename for entry in archive.infolist() if entry.filename.lower().endswith(".model")]
        main = next((name for name in names if "3dmodel" in name.lower()), None)
        if main is None:
            raise ValueError("no model")
        few(archive.getinfo(main).file_size, MOST_XML, "bytes unpacked")
        with archive.open(main) as stream:
            root = ElementTree.fromstring(stream.read(MOST_XML), forbid_dtd=True)
    unit = UNITS[root.get("unit", "millimeter")]
    objects = {part.get("id", ""): part for part in root.iterfind("{*}resources/{*}object")}
    count = itertools.count()

    def placed(number: str, place: Place, depth: int) -> Iterator[Mesh]:
        part = objects[number]
        few(next(count), MOST_BODIES, "parts")
        few(depth, DEEPEST, "parts in one another")
        name = part.get("name") or f"part {number}"
        for mesh in part.iterfind("{*}mesh"):
            corners = [[float(v.get(k, "nan")) for k in "xyz"] for v in mesh.iterfind("{*}vertices/{*}vertex")]
            corners_of = mesh.iterfind("{*}triangles/{*}triangle")
            faces = [[int(t.get(k, "-1")) for k in ("v1", "v2", "v3")] for t in corners_of]
            vertices = np.array(corners).reshape(-1, 3) @ place.matrix.T + place.shift
            yield name, unit * vertices, np.array(faces, int).reshape(-1, 3)
        for component in part.iterfind("{*}components/{*}component"):
            yield from placed(component.get("objectid", ""), place @ _place(component), depth + 1)

    for item in root.iterfind("{*}build/{*}item"):
        yield from placed(item.get("objectid", ""), _place(item), 0)


def _place(part: Any) -> Place:
    """The place of a part of a 3MF; its transform is written for rows of points, which stand to its left."""
    text = part.get("transform")
    rows = np.array(text.split(), float).reshape(4, 3) if text else np.eye(4)[:, :3]
    return Place(rows[:3].T, rows[3])
