"""MJCF, the files of MuJoCo: read with defaults and frames, and written as a tree whose loops equalities close."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from scipy.spatial.transform import Rotation

from trunnion.errors import Finding
from trunnion.exchange.draft import Array, Body, Draft, ImportOptions, Pair, Place, Positions, refused, steiner, united
from trunnion.exchange.robots import (
    APART,
    WORLD,
    Scene,
    number,
    numbers,
    opening,
    parsed,
    spanning,
    stem,
    steps,
    tensor,  # fmt: skip
    text_of,
    turned,
    unit,
    written,
)
from trunnion.joints.pairs import PAIRS

KINDS = {"hinge": "revolute", "slide": "prismatic", "ball": "spherical"}
NAMES = {pair: name for name, pair in KINDS.items()}
BRINGS = ("include", "attach", "replicate", "composite", "flexcomp", "extension")  # elements that stand for bodies
IGNORED = {  # attributes that change the motion and are not read, by element
    "joint": ("damping", "frictionloss", "stiffness", "armature"),
    "body": ("gravcomp", "mocap"),
}


def read(path: Path, options: ImportOptions) -> Draft:
    """Read the mechanism of an MJCF file where it is drawn, at qpos0."""
    root = parsed(path, "mujoco")
    reader = _Reader(root)
    draft = reader.draft
    for part in root.findall("worldbody"):
        reader.contents(part, WORLD, Place(), part.get("childclass", "main"))
    if shaped := [name for name in reader.shaped if name != WORLD]:
        draft.lose("shape", *shaped)
    if reader.unweighed:
        what = f"have geoms whose mass is not found here, such as a mesh: {', '.join([*reader.unweighed][:10])}"
        draft.warn("exchange.shape", "links", what, "state <inertial> for them, or mass and inertia in the model")
    reader.close_loops()
    key = root.find("keyframe/key")
    control = (key.get("ctrl", "") if key is not None else "").split()
    for count, part in enumerate(root.iterfind("actuator/*")):  # its speed is that of the first key
        values = reader.with_defaults(part, "main")
        joint, rate = values.get("joint", values.get("jointinparent")), 0.0
        if joint not in draft.pairs:
            draft.lose("actuator", values.get("name", part.tag))
            continue
        if part.tag == "velocity" and count < len(control):
            gear = numbers(values.get("gear"), f"gear of {joint}", 0, (1,))[0]
            rate = number(control[count], "ctrl of key") / (float(gear) or 1.0)
        draft.drives[joint] = rate
    for part in (*root.iterfind("contact/*"), *root.iterfind("tendon/*")):
        draft.lose(part.tag, part.get("name", ""))
    for tag in BRINGS:
        if root.find(f".//{tag}") is not None:
            draft.lose(f"<{tag}> and the bodies in it, which MuJoCo writes in full when it saves the model")
    total = number(reader.compiler.get("settotalmass"), "settotalmass", -1)
    mass = sum(body.mass for body in draft.bodies.values())
    for body in draft.bodies.values() if total > 0 and mass > 0 else ():
        body.mass, body.inertia = body.mass * total / mass, body.inertia * total / mass
    return reader.settled(WORLD, options.ground)


class _Reader(Scene):
    """What the compiler of MuJoCo knows while it walks through the bodies."""

    def __init__(self, root: Element) -> None:
        super().__init__(root.get("model", ""))
        self.root = root
        self.compiler = {key: value for part in root.findall("compiler") for key, value in part.items()}
        option = {key: value for part in root.findall("option") for key, value in part.items()}
        gravity = numbers(option.get("gravity"), "option.gravity", 3, (0, 0, -9.81))
        self.draft.gravity = gravity if gravity.any() else None
        self.angle = 1.0 if self.compiler.get("angle") == "radian" else math.pi / 180
        self.defaults: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        for part in root.findall("default"):
            self._defaults(part, "main", "main")
            self.defaults[part.get("class", "main")] = self.defaults["main"]
        self.frames: dict[str, Place] = {WORLD: Place()}
        self.sites: dict[str, tuple[str, Array]] = {}
        self.weighed = {WORLD}  # bodies whose mass is not that of their geoms
        self.shaped: dict[str, None] = {}  # bodies with geoms
        self.unweighed: dict[str, None] = {}  # those with geoms whose mass is not found here
        self.add_body(WORLD)

    def _defaults(self, part: Element, name: str, parent: str) -> None:
        """Read a class of defaults: what it inherits and what it states, by element."""
        classes = {tag: dict(values) for tag, values in self.defaults[parent].items()}
        for child in part:
            if child.tag != "default":
                classes.setdefault(child.tag, {}).update(child.attrib)
        self.defaults[name] = classes
        for child in part.findall("default"):
            self._defaults(child, child.get("class", ""), name)

    def with_defaults(self, element: Element, style: str) -> dict[str, str]:
        """The attributes of an element with those of its class."""
        chosen = element.get("class", style)
        if chosen not in self.defaults:
            raise refused(f"<{element.tag}> is of the class {chosen!r}, which the file does not have")
        return {**self.defaults[chosen].get(element.tag, {}), **element.attrib}

    def contents(self, element: Element, body: str, frame: Place, style: str) -> None:
        """Read what lies in a body, or in a frame of it."""
        for child in element:
            if child.tag == "frame":
                inner = frame @ self._frame(child.attrib, "frame")
                self.contents(child, body, inner, child.get("childclass", style))
            elif child.tag == "body":
                self._body(child, body, frame, child.get("childclass", style))
            elif child.tag == "geom":
                self._geom(self.with_defaults(child, style), body, frame)
            elif child.tag == "site":
                values = self.with_defaults(child, style)
                if "name" in values:
                    place = frame.at(self._frame(values, "site").shift)
                    self.sites[values["name"]] = body, place
                    self.draft.bodies[body].points[values["name"]] = place

    def _body(self, element: Element, parent: str, outer: Place, style: str) -> None:
        """Read a body with its joints: several are a row of bodies, the first joint next to the parent."""
        name = element.get("name") or f"body{len(self.draft.bodies)}"
        body = self.add_body(name)
        self.frames[name] = frame = outer @ self._frame(element.attrib, f"body {name}")
        self._note_lost("body", element.attrib, name)
        joints = [part for part in element if part.tag in ("joint", "freejoint")]
        links = [parent, *(f"{name}.{count}" for count in range(1, len(joints))), name]
        for between in links[1:-1]:
            self.add_body(between)
            self.between.add(between)
        for part, first, second in zip(joints, links, links[1:], strict=False):
            self._joint(part, (first, second), frame, style)
        if not joints:
            self.add_pair(Pair(f"{name}.fixed", "fixed", (parent, name), frame.shift))
        inertial = element.find("inertial")
        if inertial is not None and self.compiler.get("inertiafromgeom") != "true":
            where = f"inertial of body {name}"
            placed = frame @ self._frame(inertial.attrib, where)
            body.mass, body.centre = number(inertial.get("mass"), f"mass of {where}"), placed.shift
            if "fullinertia" in inertial.attrib:
                matrix = tensor(*numbers(inertial.get("fullinertia"), f"fullinertia of {where}", 6))
            else:
                matrix = np.diag(numbers(inertial.get("diaginertia"), f"diaginertia of {where}", 3, (0, 0, 0)))
            body.inertia = placed.inertia(matrix)
            self.weighed.add(name)
        self.contents(element, name, frame, style)

    def _joint(self, part: Element, links: tuple[str, str], frame: Place, style: str) -> None:
        """Read a joint; a free one is none."""
        values = self.with_defaults(part, style)
        kind = "free" if part.tag == "freejoint" else values.get("type", "hinge")
        name = values.get("name") or f"{links[1]}.joint{len(self.draft.pairs) + 1}"
        where = f"joint {name}"
        if kind == "free":
            return
        if kind not in KINDS:
            raise refused(f"has the type {kind!r}, which is no joint of MuJoCo", where)
        axis = unit(numbers(values.get("axis"), f"axis of {where}", 3, (0, 0, 1)), f"axis of {where}")
        place = numbers(values.get("pos"), f"pos of {where}", 3, (0, 0, 0))
        pair = Pair(name, KINDS[kind], links, frame.at(place), frame.matrix @ axis)
        limited = values.get("limited", "auto")
        automatic = limited == "auto" and self.compiler.get("autolimits") != "false"
        if "range" in values and kind != "ball" and (limited == "true" or automatic):
            ends = numbers(values["range"], f"range of {where}", 2)
            ends = ends - number(values.get("ref"), f"ref of {where}", 0)
            low, high = ends * (self.angle if kind == "hinge" else 1.0)
            pair.limits = float(low), float(high)
        self._note_lost("joint", values, name)
        self.add_pair(pair)

    def _note_lost(self, tag: str, values: Mapping[str, str], name: str) -> None:
        for key in IGNORED[tag]:
            if values.get(key, "0").strip() not in ("0", "false"):
                self.draft.lose(key, name)

    def _frame(self, values: Mapping[str, str], where: str) -> Place:
        """The frame that attributes state."""
        if "fromto" in values:
            start, end = numbers(values["fromto"], f"fromto of {where}", 6).reshape(2, 3)
            return Place(_onto(start - end, f"fromto of {where}"), (start + end) / 2)

        def part(key: str, count: int, default: tuple[float, ...] | None = None) -> Array:
            return numbers(values.get(key), f"{key} of {where}", count, default)

        place, rotation = part("pos", 3, (0, 0, 0)), np.eye(3)
        if "euler" in values:
            for sign, turn in zip(self.compiler.get("eulerseq", "xyz"), self.angle * part("euler", 3), strict=False):
                if sign.lower() not in "xyz":
                    raise refused(f"is {self.compiler['eulerseq']!r}, which is no row of axes", "eulerseq")
                about = Rotation.from_euler(sign.lower(), turn).as_matrix()
                rotation = rotation @ about if sign.islower() else about @ rotation  # moving axes, or fixed
        elif "axisangle" in values:
            *axis, turn = part("axisangle", 4)
            rotation = Rotation.from_rotvec(unit(np.array(axis), where) * self.angle * turn).as_matrix()
        elif "xyaxes" in values:
            x, y = part("xyaxes", 6).reshape(2, 3)
            x = unit(x, where)
            y = unit(y - (x @ y) * x, where)
            rotation = np.column_stack([x, y, np.cross(x, y)])
        elif "zaxis" in values:
            rotation = _onto(part("zaxis", 3), where)
        elif "quat" in values:
            rotation = Rotation.from_quat(unit(part("quat", 4), where), scalar_first=True).as_matrix()
        return Place(rotation, place)

    def _geom(self, values: Mapping[str, str], name: str, outer: Place) -> None:
        """Add the mass of a geom to a body that states none."""
        self.shaped[name] = None
        frame, kind, of = outer @ self._frame(values, "geom"), values.get("type", "sphere"), f"of a geom of body {name}"
        mass_stated = number(values["mass"], f"mass {of}") if "mass" in values else None
        density = number(values.get("density"), f"density {of}", 1000)
        weightless = mass_stated == 0 or (mass_stated is None and density == 0)
        weightless |= self.compiler.get("inertiafromgeom") == "false"
        low, high = numbers(self.compiler.get("inertiagrouprange"), "inertiagrouprange", 2, (0, 5))
        weightless |= not low <= number(values.get("group"), f"group {of}", 0) <= high
        if name in self.weighed or kind in ("plane", "hfield") or weightless:
            return
        count = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}.get(kind, 0)
        if not count or "mesh" in values or values.get("shellinertia") == "true":
            self.unweighed[name] = None
            return
        size = numbers(values.get("size"), f"size {of}", 0)
        if "fromto" in values:
            ends = numbers(values["fromto"], f"fromto {of}", 6)
            half = float(np.linalg.norm(ends[3:] - ends[:3])) / 2
            size = np.array([size[0], half] if count == 2 else [size[0], size[0], half])
        if len(size) < count or not (size[:count] > 0).all():
            raise refused(f"has not {count} lengths above 0", f"size {of}")
        a, b, c = (*size[:count], 0.0, 0.0)[:3]
        if kind in ("sphere", "ellipsoid"):
            axes = np.array([a, b, c]) if kind == "ellipsoid" else np.full(3, a)
            volume, squares = 4 / 3 * math.pi * axes.prod(), axes**2 / 5
        elif kind == "box":
            volume, squares = 8 * a * b * c, np.array([a, b, c]) ** 2 / 3
        else:  # of a cylinder of radius a and length 2 b; half a ball on both ends of a capsule
            ball = 2 / 3 * a / (b + 2 / 3 * a) if kind == "capsule" else 0.0  # share of the balls
            volume = 2 * math.pi * a * a * b / (1 - ball)
            across = (1 - ball) * a * a / 4 + ball * a * a / 5
            squares = np.array([across, across, (1 - ball) * b * b / 3 + ball * (a * a / 5 + b * b + 3 / 4 * a * b)])
        mass = density * volume if mass_stated is None else mass_stated
        inertia = frame.inertia(mass * np.diag(squares.sum() - squares))
        self.draft.bodies[name] = united(self.draft.bodies[name], Body(name, mass, frame.shift, inertia), name)

    def close_loops(self) -> None:
        """Read equalities; points that two bodies share are a ball, on one line a pin, else a weld."""
        draft = self.draft
        shared: dict[tuple[str, str], list[tuple[str, Array]]] = defaultdict(list)
        for count, part in enumerate(self.root.iterfind("equality/*"), 1):
            values = self.with_defaults(part, "main")
            name = values.get("name") or f"loop{count}"
            if values.get("active") == "false":
                draft.lose("equality that is not active", name)
            elif part.tag in ("connect", "weld"):
                links, place = self._ends(values, f"equality {name}")
                if part.tag == "weld":
                    self.add_pair(Pair(name, "fixed", links, place))
                else:
                    shared[links if links[::-1] not in shared else links[::-1]].append((name, place))
            elif part.tag == "joint" and {"joint1", "joint2"} <= values.keys():
                _, ratio, *higher = numbers(values.get("polycoef"), f"polycoef of {name}", 5, (0, 1, 0, 0, 0))
                self.couplings.append((values["joint1"], values["joint2"], 0.0 if any(higher) else float(ratio)))
            else:
                draft.lose(f"equality of the kind {part.tag!r}", name)
        for links, points in shared.items():
            offsets = np.array([place for _, place in points]) - points[0][1]
            rank = int((np.linalg.svd(offsets, compute_uv=False) > APART).sum())
            axis = offsets[int(np.argmax(np.linalg.norm(offsets, axis=1)))] if rank else np.array([0.0, 0.0, 1.0])
            name = points[0][0] if len(points) == 1 else stem([name for name, _ in points])
            comment = f"closes a loop by {len(points)} connect of the file"
            pair = Pair(name, ("spherical", "revolute", "fixed", "fixed")[rank], links, points[0][1], axis)
            pair.at, pair.comments = points[0][1] + offsets.mean(axis=0), [comment]
            self.add_pair(pair)

    def _ends(self, values: Mapping[str, str], where: str) -> tuple[tuple[str, str], Array]:
        """The two bodies that an equality holds together, and where; MechanismError if they are apart as drawn."""
        if "site1" in values:
            ends = [self.sites.get(values.get(key, "")) for key in ("site1", "site2")]
            if ends[0] is None or ends[1] is None:
                raise refused("names a site that the file does not have", where)
            (first, place), (second, other) = ends[0], ends[1]
        else:
            first, second = values.get("body1", ""), values.get("body2", WORLD)
            for body in (first, second):
                if body not in self.frames:
                    raise refused(f"names the body {body!r}, which the file does not have", where)
            place = other = self.frames[first].at(numbers(values.get("anchor"), f"anchor of {where}", 3, (0, 0, 0)))
            pose = numbers(values.get("relpose"), f"relpose of {where}", 7, (0,) * 7)
            if pose[3:].any():
                relative = self._frame({"pos": text_of(pose[:3]), "quat": text_of(pose[3:])}, where)
                nominal, drawn = self.frames[first] @ relative, self.frames[second]
                other = place + nominal.shift - drawn.shift
                if np.abs(nominal.matrix - drawn.matrix).max() > APART:
                    raise refused("holds two bodies at another angle than the file draws them", where)
        gap = float(np.linalg.norm(place - other))
        if gap > APART:
            what = f"holds points together that are {1e3 * gap:.4g} mm apart as the file draws them"
            raise refused(what, where, "draw it assembled: poses of the bodies at which the loops close")
        return (first, second), place


def _onto(direction: Array, where: str) -> Array:
    """The least rotation that turns z onto a direction, as MuJoCo has it."""
    z = unit(direction, where)
    axis = np.array([-z[1], z[0], 0.0])
    sine = float(np.linalg.norm(axis))
    if sine < 1e-15:
        return np.diag([1.0, 1.0, 1.0]) if z[2] > 0 else np.diag([1.0, -1.0, -1.0])
    return np.asarray(Rotation.from_rotvec(axis / sine * math.atan2(sine, z[2])).as_matrix())


# Out

STEP = 0.001  # s, of the simulation


def write(positions: Positions, path: Path) -> list[Finding]:
    """Write the mechanism as MJCF: bodies with the global axes, each with its origin at the joint that carries it.

    A loop is closed at a ball by one `connect`, at a pin by two on its axis; at any other joint the body after it is
    halved, and a `weld` holds its halves together, so mass and mobility stay.
    """
    draft = opening(positions)
    tree, cuts = spanning(draft)
    root = Element("mujoco", model=draft.name or "mechanism")
    compiler = SubElement(root, "compiler", angle="radian", autolimits="true")
    gravity = np.zeros(3) if draft.gravity is None else draft.gravity
    SubElement(root, "option", gravity=text_of(gravity), integrator="implicitfast", timestep=text_of(STEP))
    worldbody, equality = SubElement(root, "worldbody"), Element("equality")
    base = worldbody if draft.ground == WORLD else SubElement(worldbody, "body", name=draft.ground)
    bodies, origins = {draft.ground: base}, {draft.ground: np.zeros(3)}
    for pair in [*tree, *_halved(draft, cuts)]:
        parent, child = pair.links
        origins[child] = pair.at
        bodies[child] = SubElement(bodies[parent], "body", name=child, pos=text_of(pair.at - origins[parent]))
        _write_joints(pair, bodies[child], equality)
    for name, element in bodies.items():
        body = draft.bodies[name]
        if name != draft.ground:
            matrix = body.inertia
            full = [matrix[at] for at in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
            centre = body.centre - origins[name]
            values = {"pos": text_of(centre), "mass": text_of(body.mass), "fullinertia": text_of(full)}
            element.insert(0, Element("inertial", values))
            if body.mass < 1e-15 or np.linalg.eigvalsh(matrix)[0] < 1e-15:  # mjMINVAL, below which MuJoCo refuses
                compiler.attrib.update(boundmass="1e-9", boundinertia="1e-12")
        for point, place in body.points.items():
            SubElement(element, "site", name=f"{name}.{point}", pos=text_of(place - origins[name]))
    size = np.ptp([*origins.values()], axis=0).max() or 1.0
    for pair in cuts:
        half = (pair.length or size / 10) / 2 * pair.axis / np.linalg.norm(pair.axis)
        anchors = {"spherical": {"": pair.at}, "revolute": {".1": pair.at - half, ".2": pair.at + half}}
        for suffix, anchor in anchors.get(pair.type, {}).items():
            first, second = pair.links
            ends = {"body1": first, "body2": second, "anchor": text_of(anchor - origins[first])}
            SubElement(equality, "connect", ends, name=f"{pair.name}{suffix}")
    for name in (name for name in draft.bodies if "." in name):  # half of the body before the dot
        SubElement(equality, "weld", name=name, body1=name.partition(".")[0], body2=name)
    if len(equality):
        root.append(equality)
    if draft.drives:
        actuator = SubElement(root, "actuator")
        for name in draft.drives:
            turn = f"{name}.turn" if draft.pairs[name].type in ("cylindrical", "helical") else name
            pair, parts = draft.pairs[name], draft.bodies.values()
            axis = pair.axis / np.linalg.norm(pair.axis)
            # at most what it has to move, kg m² or kg: all bodies as one. So it holds its speed within a step or so
            most = sum(float(axis @ (b.inertia + b.mass * steiner(pair.at - b.centre)) @ axis) for b in parts)
            most = most if PAIRS[pair.type].turns else sum(b.mass for b in parts)
            SubElement(actuator, "velocity", name=name, joint=turn, kv=text_of((most or 1.0) / STEP))
        SubElement(SubElement(root, "keyframe"), "key", name="drive", ctrl=text_of(list(draft.drives.values())))
    written(root, path)
    return draft.findings


def _halved(draft: Draft, cuts: list[Pair]) -> Iterator[Pair]:
    """Pairs that no connect closes, each to a part of its second body, which has a share of its mass."""
    ends: dict[str, list[Pair]] = defaultdict(list)
    for pair in cuts:
        if pair.type not in ("spherical", "revolute"):
            pair = pair if pair.links[1] != draft.ground else turned(pair)
            ends[pair.links[1]].append(pair)
    for name, pairs in ends.items():
        body = draft.bodies[name]
        share = replace(body, mass=body.mass / (1 + len(pairs)), inertia=body.inertia / (1 + len(pairs)))
        draft.bodies[name] = share
        for pair in pairs:
            half = f"{name}.{pair.name}"
            draft.bodies[half] = replace(share, name=half, points={})
            yield replace(pair, links=(pair.links[0], half))


def _write_joints(pair: Pair, body: Element, equality: Element) -> None:
    """Write a pair as the joints of a body."""
    for step in [pair] if pair.type == "spherical" else steps(pair):
        if step.type == "fixed":
            continue
        joint = SubElement(body, "joint", name=step.name, type=NAMES[step.type])
        if step.type != "spherical":
            joint.set("axis", text_of(step.axis))
            joint.attrib |= {} if step.limits is None else {"range": text_of(step.limits)}
    if pair.type == "helical" and pair.pitch is not None:
        ends = {"joint1": f"{pair.name}.slide", "joint2": f"{pair.name}.turn"}
        SubElement(equality, "joint", ends, name=pair.name, polycoef=text_of([0, pair.pitch / (2 * math.pi), 0, 0, 0]))
