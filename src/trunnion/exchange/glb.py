"""An animated glTF (GLB) of a mechanism for any viewer: a node for each link, its poses as keys over the cycle.

The solids are rods between the joints and cylinders as pins; they show the motion, not the parts.
"""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from trunnion.errors import Finding, MechanismError
from trunnion.exchange.draft import Array, Draft, Pair, Positions, perpendicular
from trunnion.version import __version__

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
