"""MJCF, the files of MuJoCo: read with its defaults and frames, and written as a tree with loops closed by equalities."""

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
from trunnion.exchange.draft import Array, Body, Draft, Pair, united
from trunnion.exchange.formats import ExportOptions, ImportOptions
from trunnion.exchange.robots import (
    APART,
    WORLD,
    Frame,
    coupled,
    numbers,
    opening,
    parsed,
    refused,
    settled,
    spanning,
    stem,
    steps,
    text_of,
    turned,
    unit,
    written,
)
from trunnion.exchange.skeleton import Positions

__all__ = ["read", "write"]

BRINGS = ("include", "attach", "replicate", "composite", "flexcomp", "extension")  # elements that stand for bodies
IGNORED = {  # attributes that change the motion and are not read, by element
    "joint": ("damping", "frictionloss", "stiffness", "armature"),
    "body": ("gravcomp", "mocap"),
}


def read(path: Path, options: ImportOptions) -> Draft:
    """Read the mechanism of an MJCF file where it is drawn, at qpos0."""
    return _Reader(parsed(path, "mujoco")).draft_of(options)


class _Reader:
    """What the compiler of MuJoCo knows while it walks through the bodies."""

    def __init__(self, root: Element) -> None:
        self.root, self.draft = root, Draft(root.get("model", ""), ground=WORLD)
        self.compiler = {key: value for part in root.findall("compiler") for key, value in part.items()}
        self.angle = 1.0 if self.compiler.get("angle") == "radian" else math.pi / 180
        self.defaults: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        for part in root.findall("default"):
            self._defaults(part, "main", "main")
        self.sites: dict[str, tuple[str, Array]] = {}
        self.frames: dict[str, Frame] = {}
        self.geoms: dict[str, list[tuple[Frame, Mapping[str, str]]]] = defaultdict(list)
        self.between: set[str] = set()
        self.weighed: set[str] = set()
        self.lost: dict[str, list[str]] = defaultdict(list)

    def draft_of(self, options: ImportOptions) -> Draft:
        """The draft of the file."""
        option = {key: value for part in self.root.findall("option") for key, value in part.items()}
        gravity = numbers(option.get("gravity"), "option.gravity", 3, (0, 0, -9.81))
        self.draft.gravity = gravity if gravity.any() else None
        self.draft.bodies[WORLD], self.frames[WORLD] = Body(WORLD), Frame()
        for part in self.root.findall("worldbody"):
            self._contents(part, WORLD, Frame(), part.get("childclass", "main"))
        for brings in BRINGS:
            count = sum(1 for _ in self.root.iter(brings))
            if count:
                what = f"{count} of <{brings}> and the bodies in it are not read"
                self.draft.warn("brings", "", what, "save the model by MuJoCo, which writes it in full")
        self._weights()
        self._equalities()
        self._actuators()
        self.lost["contact and tendon"] += [
            part.get("name", part.tag) for tag in ("contact", "tendon") for part in self.root.iterfind(f"{tag}/*")
        ]
        lost = [
            f"{key} of {', '.join(names[:8])}{' …' * (len(names) > 8)}" for key, names in self.lost.items() if names
        ]
        if lost:
            self.draft.note("lost", "", f"is read without {'; '.join(lost)}")
        return settled(self.draft, self.between, WORLD, options.ground)

    def _defaults(self, part: Element, name: str, parent: str) -> None:
        """Read a class of defaults: what it inherits and what it states, by element."""
        classes = {tag: dict(values) for tag, values in self.defaults[parent].items()}
        for child in part:
            if child.tag != "default":
                classes.setdefault(child.tag, {}).update(child.attrib)
        self.defaults[name] = classes
        for child in part.findall("default"):
            self._defaults(child, child.get("class", ""), name)

    def _with_defaults(self, element: Element, style: str) -> dict[str, str]:
        """The attributes of an element with those of its class."""
        chosen = element.get("class", style)
        if chosen not in self.defaults:
            raise refused(f"<{element.tag}> is of the class {chosen!r}, which the file does not have")
        return {**self.defaults[chosen].get(element.tag, {}), **element.attrib}

    def _contents(self, element: Element, body: str, frame: Frame, style: str) -> None:
        """Read what lies in a body, or in a frame of it."""
        for child in element:
            inner_style = child.get("childclass", style)
            if child.tag == "frame":
                self._contents(child, body, frame.then(self._frame(child.attrib, "frame")), inner_style)
            elif child.tag == "body":
                self._body(child, body, frame, inner_style)
            elif child.tag == "geom":
                values = self._with_defaults(child, style)
                self.geoms[body].append((frame.then(self._shape_frame(values)), values))
            elif child.tag == "site":
                values = self._with_defaults(child, style)
                place = frame.then(self._frame(values, "site")).place
                name = values.get("name", "")
                self.sites[name] = body, place
                if name:
                    self.draft.bodies[body].points[name] = place

    def _body(self, element: Element, parent: str, outer: Frame, style: str) -> None:
        """Read a body with its joints: several are a row of bodies, the first joint next to the parent."""
        name = element.get("name") or f"body{len(self.draft.bodies)}"
        if name in self.draft.bodies:
            raise refused(f"the body {name!r} stands in it twice")
        frame = outer.then(self._frame(element.attrib, f"body {name}"))
        self.frames[name] = frame
        self.draft.bodies[name] = Body(name)
        self._note_lost("body", element.attrib, name)
        joints = [part for part in element if part.tag in ("joint", "freejoint")]
        links = [parent, *(f"{name}.{number + 1}" for number in range(len(joints) - 1)), name]
        for between in links[1:-1]:
            self.draft.bodies[between] = Body(between)
            self.between.add(between)
        for number, part in enumerate(joints):
            self._joint(part, (links[number], links[number + 1]), frame, style)
        if not joints:
            self._add(Pair(f"{name}.fixed", "fixed", (parent, name), frame.place))
        self._contents(element, name, frame, style)
        inertial = element.find("inertial")
        if inertial is not None and self.compiler.get("inertiafromgeom") != "true":
            body = self._inertial(inertial, name, frame)
            self.draft.bodies[name] = replace(body, points=self.draft.bodies[name].points)
            self.weighed.add(name)

    def _joint(self, part: Element, links: tuple[str, str], frame: Frame, style: str) -> None:
        values = self._with_defaults(part, style)
        kind = "free" if part.tag == "freejoint" else values.get("type", "hinge")
        if kind == "free":
            return
        types = {"hinge": "revolute", "slide": "prismatic", "ball": "spherical"}
        name = values.get("name") or f"{links[1]}.joint{len(self.draft.pairs) + 1}"
        if kind not in types:
            raise refused(f"has the type {kind!r}, which is no joint of MuJoCo", f"joint {name}")
        axis = unit(numbers(values.get("axis"), f"axis of joint {name}", 3, (0, 0, 1)), f"axis of joint {name}")
        place = numbers(values.get("pos"), f"pos of joint {name}", 3, (0, 0, 0))
        pair = Pair(name, types[kind], links, frame.at(place), frame.rotation @ axis)
        scale = self.angle if kind == "hinge" else 1.0
        limited = values.get("limited", "auto")
        if (
            "range" in values
            and kind != "ball"
            and limited != "false"
            and (limited == "true" or self.compiler.get("autolimits") != "false")
        ):
            low, high = scale * (
                numbers(values["range"], f"range of joint {name}", 2)
                - float(numbers(values.get("ref"), f"ref of joint {name}", 1, (0,))[0])
            )
            pair.limits = float(low), float(high)
        self._note_lost("joint", values, name)
        self._add(pair)

    def _add(self, pair: Pair) -> None:
        if pair.name in self.draft.pairs:
            raise refused(f"the joint {pair.name!r} stands in it twice")
        self.draft.pairs[pair.name] = pair

    def _note_lost(self, tag: str, values: Mapping[str, str], name: str) -> None:
        for key in IGNORED[tag]:
            if values.get(key, "0").strip() not in ("0", "false"):
                self.lost[key].append(name)

    # Frames and masses

    def _frame(self, values: Mapping[str, str], where: str) -> Frame:
        """The frame that attributes state."""

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
        return Frame(rotation, place)

    def _shape_frame(self, values: Mapping[str, str]) -> Frame:
        """The frame of a geom, in that of its body."""
        if "fromto" not in values:
            return self._frame(values, "geom")
        start, end = numbers(values["fromto"], "fromto of geom", 6).reshape(2, 3)
        return Frame(_onto(start - end, "fromto of geom"), (start + end) / 2)

    def _inertial(self, part: Element, name: str, outer: Frame) -> Body:
        where = f"inertial of body {name}"
        frame = outer.then(self._frame(part.attrib, where))
        mass = float(numbers(part.get("mass"), f"mass of {where}", 1)[0])
        if "fullinertia" in part.attrib:
            xx, yy, zz, xy, xz, yz = numbers(part.get("fullinertia"), f"fullinertia of {where}", 6)
            inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        else:
            inertia = np.diag(numbers(part.get("diaginertia"), f"diaginertia of {where}", 3, (0, 0, 0)))
        return Body(name, mass, frame.place, frame.inertia(inertia))

    def _weights(self) -> None:
        """Give bodies that state no mass the masses of their geoms; scale all if the file says so."""
        source = self.compiler.get("inertiafromgeom", "auto")
        low, high = numbers(self.compiler.get("inertiagrouprange"), "inertiagrouprange", 2, (0, 5))
        guessed = []
        for name, geoms in self.geoms.items():
            if source == "false" or name in self.weighed or name == WORLD:
                continue
            solids = [
                _solid(frame, values, name)
                for frame, values in geoms
                if low <= float(numbers(values.get("group"), "group of geom", 1, (0,))[0]) <= high
            ]
            if any(solid is None for solid in solids):
                guessed.append(name)
            for solid in solids:
                if solid is not None:
                    self.draft.bodies[name] = united(self.draft.bodies[name], solid, name)
        if guessed:
            what = f"have geoms of a shape whose mass is not found here, a mesh for one: {', '.join(guessed[:10])}"
            self.draft.warn(
                "shape", "links", what, "state <inertial> for these bodies, or mass and inertia in the model"
            )
        total = float(numbers(self.compiler.get("settotalmass"), "settotalmass", 1, (-1,))[0])
        mass = sum(body.mass for body in self.draft.bodies.values())
        if total > 0 and mass > 0:
            for name, body in self.draft.bodies.items():
                share = total / mass
                self.draft.bodies[name] = replace(body, mass=body.mass * share, inertia=body.inertia * share)

    # Loops and drives

    def _equalities(self) -> None:
        """Read what closes loops; points that two bodies share are a ball, on one line a pin, else a weld."""
        shared: dict[tuple[str, str], list[tuple[str, Array]]] = defaultdict(list)
        for part in self.root.iterfind("equality/*"):
            values = self._with_defaults(part, "main")
            name = values.get("name") or f"loop{len(self.draft.pairs) + len(shared) + 1}"
            if values.get("active") == "false":
                self.lost["equality that is not active"].append(name)
            elif part.tag in ("connect", "weld"):
                links, point = self._ends(part.tag, values, name)
                if part.tag == "weld":
                    self._add(Pair(name, "fixed", links, point))
                else:
                    shared[links if links[::-1] not in shared else links[::-1]].append((name, point))
            elif part.tag == "joint" and "joint2" in values:
                _, ratio, *higher = numbers(values.get("polycoef"), f"polycoef of {name}", 5, (0, 1, 0, 0, 0))
                joints = values.get("joint1"), values["joint2"]
                coupled(self.draft, joints, 0.0 if any(higher) else float(ratio), self.between)
            else:
                self.draft.warn("equality", name, f"is an equality of the kind {part.tag!r}, which is not read")
        for links, points in shared.items():
            places = np.array([place for _, place in points])
            _, spread, axes = np.linalg.svd(places - places.mean(axis=0))
            rank = int((spread > APART).sum())
            names = [name for name, _ in points]
            name = names[0] if len(names) == 1 else stem(names)
            kind = ("spherical", "revolute")[rank] if rank < 2 else "fixed"
            comment = f"closes a loop by {len(points)} connect of the file" + (" on its axis" if rank == 1 else "")
            self._add(Pair(name, kind, links, places.mean(axis=0), _signed(axes[0], places), comments=[comment]))

    def _ends(self, tag: str, values: Mapping[str, str], name: str) -> tuple[tuple[str, str], Array]:
        """The two bodies that an equality holds together, and where; MechanismError if they are apart as drawn."""
        if "site1" in values:
            ends = [self.sites.get(values.get(key, "")) for key in ("site1", "site2")]
            if ends[0] is None or ends[1] is None:
                raise refused("names a site that the file does not have", f"equality {name}")
            (first, place), (second, other) = ends[0], ends[1]
        else:
            first, second = values.get("body1", ""), values.get("body2", WORLD)
            for body in (first, second):
                if body not in self.frames:
                    raise refused(f"names the body {body!r}, which the file does not have", f"equality {name}")
            place = other = self.frames[first].at(numbers(values.get("anchor"), f"anchor of {name}", 3, (0, 0, 0)))
        relative = numbers(values.get("relpose"), f"relpose of {name}", 7, (0,) * 7)
        if tag == "weld" and relative[3:].any():
            stated = self.frames[first].then(
                self._frame({"pos": text_of(relative[:3]), "quat": text_of(relative[3:])}, name)
            )
            other = place + stated.place - self.frames[second].place
            if np.abs(stated.rotation - self.frames[second].rotation).max() > APART:
                raise refused("holds two bodies at another angle than the file draws them", f"equality {name}")
        gap = float(np.linalg.norm(place - other))
        if gap > APART:
            what = f"holds points together that are {1e3 * gap:.4g} mm apart as the file draws them"
            raise refused(what, f"equality {name}", "draw it assembled: poses of the bodies at which the loops close")
        return (first, second), place

    def _actuators(self) -> None:
        """Read driven joints; the speed is that of the first key for an actuator of velocity."""
        key = self.root.find("keyframe/key")
        control = (key.get("ctrl", "") if key is not None else "").split()
        for number, part in enumerate(self.root.iterfind("actuator/*")):
            values = self._with_defaults(part, "main")
            joint = values.get("joint", values.get("jointinparent"))
            if joint not in self.draft.pairs:
                self.lost["actuator"].append(values.get("name", part.tag))
                continue
            rate = 0.0
            if part.tag == "velocity" and number < len(control):
                gear = numbers(values.get("gear"), f"gear of {joint}", 0, (1,))[0]
                rate = float(numbers(control[number], "ctrl of key", 1)[0] / (gear or 1.0))
            self.draft.drives[joint] = rate


def _signed(axis: Array, places: Array) -> Array:
    """An axis through places, from the first towards the last."""
    return axis if axis @ (places[-1] - places[0]) >= 0 else -axis


def _onto(direction: Array, where: str) -> Array:
    """The least rotation that turns z onto a direction, as MuJoCo has it."""
    z = unit(direction, where)
    axis = np.array([-z[1], z[0], 0.0])
    sine = float(np.linalg.norm(axis))
    if sine < 1e-15:
        return np.diag([1.0, 1.0, 1.0]) if z[2] > 0 else np.diag([1.0, -1.0, -1.0])
    return np.asarray(Rotation.from_rotvec(axis / sine * math.atan2(sine, z[2])).as_matrix())


def _solid(frame: Frame, values: Mapping[str, str], name: str) -> Body | None:
    """The body of a geom, in global axes; None if its mass cannot be found."""
    kind, where = values.get("type", "sphere"), f"size of a geom of body {name}"
    stated = numbers(values.get("mass"), f"mass of a geom of body {name}", 1)[0] if "mass" in values else None
    density = float(numbers(values.get("density"), f"density of a geom of body {name}", 1, (1000,))[0])
    if kind in ("plane", "hfield") or stated == 0 or (stated is None and density == 0):
        return Body(name)
    if (
        kind not in ("sphere", "capsule", "cylinder", "ellipsoid", "box")
        or "mesh" in values
        or values.get("shellinertia") == "true"
    ):
        return None
    size = numbers(values.get("size"), where, 0)
    if "fromto" in values:
        ends = numbers(values["fromto"], "fromto of geom", 6)
        half = float(np.linalg.norm(ends[3:] - ends[:3])) / 2
        size = np.array([size[0], half] if kind in ("capsule", "cylinder") else [size[0], size[0], half])
    count = {"sphere": 1, "capsule": 2, "cylinder": 2}.get(kind, 3)
    if len(size) < count or not (size[:count] > 0).all():
        raise refused(f"has not {count} lengths above 0", where)
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
    mass = density * volume if stated is None else float(stated)
    inertia = mass * np.diag(squares.sum() - squares)
    return Body(name, mass, frame.place, frame.inertia(inertia))


# Out


def write(positions: Positions, path: Path, options: ExportOptions) -> list[Finding]:
    """Write the mechanism as MJCF: bodies with the global axes, each with its origin at the joint that carries it.

    A loop is closed at a ball by one `connect`, at a pin by two on its axis; at any other joint the body after it is
    halved, and a `weld` holds its halves together, so mass and mobility stay.
    """
    draft = opening(positions, options.row)
    tree, cuts = spanning(draft)
    root = Element("mujoco", model=draft.name or "mechanism")
    compiler = SubElement(root, "compiler", angle="radian", autolimits="true")
    SubElement(root, "option", gravity=text_of(np.zeros(3) if draft.gravity is None else draft.gravity))
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
            matrix = _realisable(body.inertia)
            full = [matrix[at] for at in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
            centre = body.centre - origins[name]
            values = {"pos": text_of(centre), "mass": text_of(body.mass), "fullinertia": text_of(full)}
            element.insert(0, Element("inertial", values))
            if body.mass < 1e-15 or np.linalg.eigvalsh(matrix)[0] < 1e-15:  # mjMINVAL, below which MuJoCo refuses
                compiler.attrib.update(boundmass="1e-9", boundinertia="1e-12")
        for point, place in body.points.items():
            SubElement(element, "site", name=f"{name}.{point}", pos=text_of(place - origins[name]))
    size = max([1e-3, *(float(np.linalg.norm(pair.at - origins[pair.links[0]])) for pair in tree)])
    for pair in cuts:
        if pair.type in ("spherical", "revolute"):
            half = (pair.length or size / 10) / 2 * pair.axis / np.linalg.norm(pair.axis)
            anchors = {"": pair.at} if pair.type == "spherical" else {".1": pair.at - half, ".2": pair.at + half}
            ends = dict(zip(("body1", "body2"), pair.links, strict=True))
            for key, anchor in anchors.items():
                values = {**ends, "anchor": text_of(anchor - origins[pair.links[0]])}
                SubElement(equality, "connect", values, name=f"{pair.name}{key}")
    for name, body in draft.bodies.items():
        if "." in name:
            SubElement(equality, "weld", name=name, body1=name.partition(".")[0], body2=name)
    if len(equality):
        root.append(equality)
    if draft.drives:
        actuator = SubElement(root, "actuator")
        for name in draft.drives:
            turn = f"{name}.turn" if draft.pairs[name].type in ("cylindrical", "helical") else name
            SubElement(actuator, "velocity", name=name, joint=turn)
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
    kinds = {"revolute": "hinge", "prismatic": "slide", "spherical": "ball"}
    for step in [pair] if pair.type == "spherical" else steps(pair):
        if step.type == "fixed":
            continue
        joint = SubElement(body, "joint", name=step.name, type=kinds[step.type])
        if step.type != "spherical":
            joint.set("axis", text_of(step.axis))
            if step.limits is not None:
                joint.set("range", text_of(step.limits))
    if pair.type == "helical" and pair.pitch is not None:
        ends = {"joint1": f"{pair.name}.slide", "joint2": f"{pair.name}.turn"}
        SubElement(equality, "joint", ends, name=pair.name, polycoef=text_of([0, pair.pitch / (2 * math.pi), 0, 0, 0]))


def _realisable(inertia: Array) -> Array:
    """The tensor, by 1e-12 larger where it is that of a plate, which rounding would make impossible."""
    a, b, c = np.linalg.eigvalsh(inertia)
    return inertia + 1e-12 * c * np.eye(3) if a + b - c < 1e-12 * c else inertia
