"""Meshes: mass properties of STL, 3MF and GLB, and an animated glTF (GLB) of a mechanism for any viewer.

Read, each closed mesh is a body; meshes hold no joints. Written, a node for each link has its poses as keys over the
cycle; its solids are rods between the joints and cylinders as pins, which show the motion and not the parts.
"""

from __future__ import annotations

import io
import itertools
import json
import math
import struct
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from defusedxml import DefusedXmlException, ElementTree
from scipy.spatial.transform import Rotation

from trunnion.errors import Finding, MechanismError
from trunnion.exchange.draft import (
    Array,
    Body,
    Draft,
    ImportOptions,
    Pair,
    Place,
    few,
    free_name,
    perpendicular,
    refused,
)
from trunnion.exchange.skeleton import Positions
from trunnion.version import __version__

__all__ = ["read", "write"]

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
    few(path.stat().st_size, MOST_BYTES, "bytes")
    try:
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
    except MechanismError:
        raise
    except TROUBLE:
        raise refused("cannot be read as a mesh, or is damaged") from None
    few(len(meshes), MOST_BODIES, "meshes")
    if not any(len(faces) for _, _, faces in meshes):
        raise refused("holds no triangles, or is cut off")
    draft.ground = "ground"
    draft.bodies["ground"] = Body("ground")
    for name, vertices, faces in meshes:
        body = _weighed(draft, free_name(name, draft.bodies), vertices, faces, options.density)
        draft.bodies[body.name] = body
    draft.lose("joints, which a mesh does not hold")
    return draft


def _weighed(draft: Draft, name: str, vertices: Array, faces: Array, density: float) -> Body:
    """A body with the mass of a closed mesh; one that is open has none, and says so."""
    if np.any(faces >= len(vertices)) or np.any(faces < 0):
        raise refused("cannot be read as a mesh, or is damaged")
    body, mesh = Body(name), trimesh.Trimesh(vertices, faces, process=True)
    if not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
        draft.warn("exchange.mesh", f"links.{name}", "has no triangles, or corners that are no numbers")
        return body
    size = ", ".join(f"{1e3 * extent:.6g}" for extent in mesh.extents)
    shells = f" in {mesh.body_count} shells" if mesh.body_count > 1 else ""
    body.comments.append(f"a mesh of {len(mesh.faces):,} triangles{shells}, {size} mm large")
    mesh.density = density
    with np.errstate(all="ignore"):  # of a sheet, which has no volume
        properties = mesh.mass_properties
    sign = -1.0 if properties.volume < 0 else 1.0  # inside out throughout
    if not (mesh.is_watertight and mesh.is_winding_consistent and sign * properties.volume > 0):
        what = "is not closed, encloses no volume, or its triangles do not all face outwards; it has no mass here"
        draft.warn("exchange.open_mesh", f"links.{name}", what, "mend the mesh, or state mass, centre and inertia")
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
            vertices, triangles = np.array(corners).reshape(-1, 3), np.array(faces, int).reshape(-1, 3)
            if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(vertices):
                raise ValueError("a triangle without a corner")
            yield name, unit * (vertices @ place.matrix.T + place.shift), triangles
        for component in part.iterfind("{*}components/{*}component"):
            yield from placed(component.get("objectid", ""), place @ _place(component), depth + 1)

    for item in root.iterfind("{*}build/{*}item"):
        yield from placed(item.get("objectid", ""), _place(item), 0)


def _place(part: Any) -> Place:
    """The place of a part of a 3MF; its transform is written for rows of points, which stand to its left."""
    text = part.get("transform")
    rows = np.array(text.split(), float).reshape(4, 3) if text else np.eye(4)[:, :3]
    return Place(rows[:3].T, rows[3])


# ---- GLB out ------------------------------------------------------------------------------------------------------

ROD, PIN, LONG = 0.012, 0.02, 3.0  # radius of a rod and of a pin that states none, of the size; rails by their sliders
SIDES = 24  # of a cylinder
COLOURS = [(0.45, 0.47, 0.5), (0.84, 0.37, 0.0), (0.0, 0.45, 0.7), (0.0, 0.62, 0.45), (0.8, 0.47, 0.65),
           (0.9, 0.62, 0.0), (0.34, 0.71, 0.91)]  # fmt: skip
FLOAT, INDEX = 5126, 5125  # component types of glTF: float32, unsigned int32
Z_UP = [-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]  # turns a model whose z is up to glTF, whose y is


def write(positions: Positions, path: Path) -> list[Finding]:
    """Write the links with their poses at all solved positions of the cycle."""
    solved = np.all([np.isfinite(origin).all(axis=1) for origin in positions.origins.values()], axis=0)
    if not solved.any():
        what = "has no position that is solved"
        raise MechanismError(Finding(what, "file", "`trunnion analyse` says why"))
    first = int(np.argmax(solved))
    draft = positions.draft(first)
    if not solved.all():
        what = f"{np.count_nonzero(~solved)} of {len(solved)} positions have no solution; the motion jumps over them"
        draft.warn("exchange.unsolved", "file", what, "`trunnion analyse` says why")
    places = [pair.at for pair in draft.pairs.values()] + [p for b in draft.bodies.values() for p in b.points.values()]
    size = float(np.ptp(places, axis=0).max()) or 0.1
    scene = _Scene()
    times = positions.result["time"].values[solved].astype(float)
    keys = scene.accessor((times - times[0]).astype(np.float32)[:, None], bounds=True)
    channels: list[tuple[int, str, int]] = []
    for number, link in enumerate(draft.bodies):
        rotation, origin = positions.rotations[link][solved], positions.origins[link][solved]
        vertices, faces = _solids(draft, link, size)
        node: dict[str, Any] = {"name": link}
        if len(vertices):
            node["mesh"] = scene.mesh(link, (vertices - origin[0]) @ rotation[0], faces, COLOURS[number % len(COLOURS)])
        turns = Rotation.from_matrix(rotation).as_quat()
        flips = np.cumprod(np.where(np.sum(turns[1:] * turns[:-1], axis=1) < 0, -1.0, 1.0))
        turns[1:] *= flips[:, None]  # a quaternion and its negative are one turn; viewers go the short way
        node |= {"translation": origin[0].tolist(), "rotation": turns[0].tolist()}
        if link != draft.ground:
            channels += [(number + 1, "translation", scene.accessor(origin.astype(np.float32)))]
            channels += [(number + 1, "rotation", scene.accessor(turns.astype(np.float32)))]
        scene.nodes.append(node)
    root: dict[str, Any] = {"name": draft.name or "mechanism", "children": list(range(1, len(scene.nodes) + 1))}
    if not draft.plane:
        root["rotation"] = Z_UP
    scene.nodes.insert(0, root)
    path.write_bytes(scene.glb(draft.name or "mechanism", keys, channels))
    draft.note("exchange.lost", "file", "a GLB holds no masses, friction, loads or drivers", "keep the model file")
    return draft.findings


def _solids(draft: Draft, link: str, size: float) -> tuple[Array, Array]:
    """Vertices, m, and triangles of a link in the global frame: rods between its joints, pins, rails and sliders."""
    pairs, points = draft.pairs_of(link), list(draft.bodies[link].points.values())
    places = [pair.element(link)[0] for pair in pairs] + points
    parts = [
        _bar(a, b, ROD * size, SIDES)
        for a, b in zip(places, places[1:] + (places[:1] if len(places) > 2 else []), strict=False)
        if np.linalg.norm(b - a) > 1e-9 * size
    ]
    parts += [_joint(pair, link, size) for pair in pairs]
    if not parts:
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    counts = np.cumsum([0] + [len(vertices) for vertices, _ in parts[:-1]])
    faces = [triangles + count for (_, triangles), count in zip(parts, counts, strict=True)]
    return np.vstack([vertices for vertices, _ in parts]), np.vstack(faces)


def _joint(pair: Pair, link: str, size: float) -> tuple[Array, Array]:
    """The pin of a joint, thicker and shorter on its second link as a sleeve; of a guide a rail and a slider."""
    second = link == pair.links[1]
    place, axis = pair.element(link)
    axis = axis / np.linalg.norm(axis)
    if pair.type == "prismatic":
        half = (pair.length or 10 * PIN * size) / 2 * (1.0 if second else LONG)
        return _bar(place - half * axis, place + half * axis, (2.2 if second else 1.2) * ROD * size, 4)
    radius = (pair.pin_radius or PIN * size) * (1.2 if second else 1.0)
    half = (pair.length or 4 * PIN * size) / 2 * (0.8 if second else 1.0)
    return _bar(place - half * axis, place + half * axis, radius, SIDES)


def _bar(start: Array, end: Array, radius: float, sides: int) -> tuple[Array, Array]:
    """Vertices and outward triangles of a closed prism from start to end."""
    axis = (end - start) / np.linalg.norm(end - start)
    u = perpendicular(axis)
    v = np.cross(axis, u)
    angle = 2 * math.pi * (np.arange(sides) + 0.5) / sides
    ring = radius * (np.outer(np.cos(angle), u) + np.outer(np.sin(angle), v))
    vertices = np.vstack([start + ring, end + ring, start, end])
    i = np.arange(sides)
    j = (i + 1) % sides
    low, high = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    sheets = [(i, j, j + sides), (i, j + sides, i + sides), (low, j, i), (high, i + sides, j + sides)]
    faces = np.vstack([np.column_stack(sheet) for sheet in sheets])
    return vertices, faces


class _Scene:
    """Nodes, meshes and arrays of a glTF, and the bytes that the arrays are in."""

    def __init__(self) -> None:
        self.nodes: list[dict[str, Any]] = []
        self.meshes: list[dict[str, Any]] = []
        self.materials: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.views: list[dict[str, Any]] = []
        self.data = bytearray()

    def accessor(self, array: Any, bounds: bool = False, target: int | None = None) -> int:
        """The number of an array (count, components) that is appended to the bytes; bounds: with least and largest."""
        count, parts = array.shape
        kind = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[parts]
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes}
        self.views.append(view | ({} if target is None else {"target": target}))
        self.data += np.ascontiguousarray(array).tobytes()
        component = INDEX if array.dtype == np.uint32 else FLOAT
        entry = {"bufferView": len(self.views) - 1, "componentType": component, "count": count, "type": kind}
        if bounds:
            entry |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        self.accessors.append(entry)
        return len(self.accessors) - 1

    def mesh(self, name: str, vertices: Array, faces: Array, colour: tuple[float, ...]) -> int:
        """The number of a mesh of one colour."""
        look = {"baseColorFactor": [*colour, 1.0], "metallicFactor": 0.2, "roughnessFactor": 0.6}
        self.materials.append({"name": name, "pbrMetallicRoughness": look})
        place = self.accessor(vertices.astype(np.float32), bounds=True, target=34962)
        index = self.accessor(faces.astype(np.uint32).reshape(-1, 1), target=34963)
        part = {"attributes": {"POSITION": place}, "indices": index, "material": len(self.materials) - 1}
        self.meshes.append({"name": name, "primitives": [part]})
        return len(self.meshes) - 1

    def glb(self, name: str, keys: int, channels: list[tuple[int, str, int]]) -> bytes:
        """The file: header, JSON and bytes. keys: accessor of the times; channels: node, path and accessor."""
        gltf: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": f"Trunnion {__version__}"},
            "scene": 0,
            "scenes": [{"name": name, "nodes": [0]}],
            "nodes": self.nodes,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.data)}],
        }
        gltf |= {"meshes": self.meshes, "materials": self.materials} if self.meshes else {}
        if channels:
            samplers = [{"input": keys, "output": output, "interpolation": "LINEAR"} for *_, output in channels]
            targets = [
                {"sampler": i, "target": {"node": node, "path": what}} for i, (node, what, _) in enumerate(channels)
            ]
            gltf["animations"] = [{"name": "cycle", "samplers": samplers, "channels": targets}]
        text = json.dumps(gltf, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        data = bytes(self.data) + b"\0" * (-len(self.data) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
