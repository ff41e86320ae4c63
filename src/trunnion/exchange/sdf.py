"""SDF, the files of Gazebo: read with its frames, and written with every loop as it is, since joints may close them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from scipy.spatial.transform import Rotation

from trunnion.errors import Finding
from trunnion.exchange.draft import Array, Body, Draft, Pair
from trunnion.exchange.formats import ExportOptions, ImportOptions
from trunnion.exchange.robots import (
    WORLD,
    Frame,
    coupled,
    numbers,
    opening,
    parsed,
    refused,
    roll_pitch_yaw,
    settled,
    spanning,
    steps,
    text_of,
    unit,
    written,
)
from trunnion.exchange.skeleton import Positions

__all__ = ["Reader", "add_driver", "add_inertial", "add_joint", "read", "write"]

TYPES = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "ball": "spherical",
    "universal": "universal",
    "revolute2": "universal",
    "screw": "helical",
    "fixed": "fixed",
    "planar": "planar",  # of URDF
}
NAMES = {"spherical": "ball", "helical": "screw"}  # of those that SDF calls otherwise
UNLIMITED = 1e3  # rad or m, from which a limit is none
SPECK = 1e-9, 1e-15  # kg and kg m² of a body that only holds two joints, since engines refuse none
CONTROLLER = {"filename": "gz-sim-joint-controller-system", "name": "gz::sim::systems::JointController"}


def read(path: Path, options: ImportOptions) -> Draft:
    """Read the mechanism of an SDF file where it is drawn."""
    root = parsed(path, "sdf")
    world = root.find("world")
    models = [*(root if world is None else world).findall("model")]
    if not models:
        raise refused("has no model", remedy="export a model")
    reader = Reader(root.get("version", "1.6"), models[0].get("name", ""))
    if world is not None:
        gravity = numbers(world.findtext("gravity"), "gravity", 3, (0, 0, -9.8))
        reader.draft.gravity = gravity if gravity.any() else None
    for number, model in enumerate(models):
        reader.model(model, f"{model.get('name', number)}::" if number else "", WORLD)
    if root.find(".//include") is not None:
        reader.draft.warn("brings", "", "models that it includes are not read", "write it in full by `gz sdf -p`")
    reader.pairs()
    return reader.draft_of(options, WORLD)


class Reader:
    """The links, joints and frames of the models of a file, by names with the scope of nested models."""

    def __init__(self, version: str, name: str) -> None:
        self.draft = Draft(name)
        self.version = tuple(int(part) if part.isdigit() else 0 for part in version.split("."))
        self.poses: dict[str, tuple[Frame, str]] = {}
        self.frames: dict[str, Frame] = {WORLD: Frame()}
        self.attached: dict[str, str] = {}
        self.joints: list[tuple[Element, str]] = []
        self.couplings: list[tuple[tuple[str, str], float]] = []
        self.lost: dict[str, list[str]] = {}

    def model(self, model: Element, prefix: str, parent: str) -> None:
        """Collect the links, joints and frames of a model and of those nested in it."""
        base = f"{prefix}__model__"
        self._place(model, base, parent, parent, prefix)
        for part in model:
            name = prefix + part.get("name", part.tag)
            if part.tag == "link":
                if name in self.draft.bodies:
                    raise refused(f"the link {name!r} stands in it twice")
                self.draft.bodies[name] = Body(name)
                self._place(part, name, base, base, prefix)
                self.attached.setdefault(base, name)
            elif part.tag == "frame":
                self.attached[name] = prefix + part.get("attached_to", "__model__")
                self._place(part, name, self.attached[name], base, prefix)
            elif part.tag == "joint":
                self.joints.append((part, prefix))
                self._place(part, f"joint {name}", prefix + _end(part, "child"), base, prefix)
            elif part.tag == "model":
                self.model(part, f"{name}::", base)
                self.poses[name] = Frame(), f"{name}::__model__"
                self.attached[name] = f"{name}::__model__"
            elif part.tag == "plugin" and part.findtext("joint_name"):
                rate = numbers(part.findtext("initial_velocity"), f"initial_velocity of {name}", 1, (0,))
                self.draft.drives[prefix + part.findtext("joint_name", "").strip()] = float(rate[0])
        for part in model.findall("joint"):  # whose name may also be that of a link, in URDF and old files
            name = prefix + part.get("name", "joint")
            self.poses.setdefault(name, (Frame(), f"joint {name}"))
        for link in model.findall("link"):
            self._weigh(link, prefix + link.get("name", "link"))
        if (model.findtext("static") or "").strip() in ("true", "1"):
            for link in model.findall("link"):
                name = prefix + link.get("name", "link")
                self.draft.pairs[f"{name}.static"] = Pair(f"{name}.static", "fixed", (WORLD, name), np.zeros(3))

    def _place(self, part: Element, name: str, default: str, scope: str, prefix: str) -> None:
        """Note the pose of a part, and what it is relative to."""
        pose = part.find("pose")
        relative = "" if pose is None else pose.get("relative_to") or pose.get("frame") or ""
        self.poses[name] = _pose(pose, name), prefix + relative if relative else default

    def frame(self, name: str) -> Frame:
        """The global frame of a name; MechanismError if poses go round in a circle or name what is not there."""
        row = [name]
        while row[-1] not in self.frames:
            if row[-1] not in self.poses:
                raise refused(f"a pose is relative to {row[-1]!r}, which the file does not have", name)
            row.append(self.poses[row[-1]][1])
            if row[-1] in row[:-1]:
                raise refused("its pose is relative to itself, through others", name)
        for inner in reversed(row[:-1]):
            local, outer = self.poses[inner]
            self.frames[inner] = self.frames[outer].then(local)
        return self.frames[name]

    def _weigh(self, link: Element, name: str) -> None:
        inertial, body = link.find("inertial"), self.draft.bodies[name]
        if inertial is None or inertial.find("mass") is None:
            what = "states no mass, which by the rules of SDF is 1 kg with 1 kg m² about each axis"
            self.draft.warn("mass", f"links.{name}", what, "state its mass in the model")
            body.mass, body.inertia, body.centre = 1.0, np.eye(3), self.frame(name).place
            return
        frame = self.frame(name).then(_pose(inertial.find("pose"), f"inertial of {name}"))
        body.mass = float(numbers(inertial.findtext("mass"), f"mass of {name}", 1)[0])
        keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        xx, xy, xz, yy, yz, zz = (
            float(numbers(inertial.findtext(f"inertia/{key}"), f"{key} of {name}", 1, (float(key[1] == key[2]),))[0])
            for key in keys
        )
        body.centre = frame.place
        body.inertia = frame.inertia(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))

    def _joint(self, part: Element, prefix: str) -> Iterable[Pair]:
        """The pair of a joint, or two in a row for a revolute2 whose axes are not square to each other."""
        name, kind = prefix + part.get("name", "joint"), part.get("type", "")
        links = self._body(part, "parent", prefix), self._body(part, "child", prefix)
        if kind == "floating":
            return
        if kind not in TYPES:
            what = f"has the type {kind!r}, which is not read; of SDF are read: {', '.join(list(TYPES)[:-1])}"
            raise refused(what, f"joint {name}", "write it as one of these")
        for key in ("damping", "friction", "spring_stiffness"):
            if any(float(numbers(found.text, key, 1)[0]) for found in part.iter(key)):
                self.lost.setdefault(key, []).append(name)
        pair = Pair(name, TYPES[kind], links, self.frame(f"joint {name}").place)
        if pair.type not in ("spherical", "fixed"):
            pair.axis = self._axis(part, "axis", name, prefix)
            texts = [part.findtext(f"axis/limit/{end}", "inf").replace("inf", "1e16") for end in ("lower", "upper")]
            low, high = (float(numbers(text, f"limit of joint {name}", 1)[0]) for text in texts)
            if max(abs(low), abs(high)) < UNLIMITED:
                pair.limits = low, high
        if pair.type == "universal":
            pair.second_axis = self._axis(part, "axis2", name, prefix)
            if abs(pair.axis @ pair.second_axis) > 1e-6:
                raise refused(
                    "turns about two axes that are not square to each other", f"joint {name}", "write two joints"
                )
        if pair.type == "helical":
            pitch, old = part.findtext("screw_thread_pitch"), part.findtext("thread_pitch")
            if pitch is None and old is not None:  # rad/m, left-handed
                pair.pitch = -2 * np.pi / float(numbers(old, f"thread_pitch of {name}", 1)[0] or np.inf)
            else:
                pair.pitch = float(numbers(pitch, f"screw_thread_pitch of {name}", 1)[0])
        yield pair

    def _axis(self, part: Element, tag: str, name: str, prefix: str) -> Array:
        """The direction of an axis, in global axes."""
        axis = part.find(tag)
        xyz = None if axis is None else axis.find("xyz")
        where = f"{tag} of joint {name}"
        vector = unit(numbers(None if xyz is None else xyz.text, where, 3, (0, 0, 1)), where)
        frame = f"joint {name}"
        if xyz is not None and xyz.get("expressed_in"):
            frame = prefix + xyz.get("expressed_in", "")
        elif self.version < (1, 5) or (
            axis is not None and (axis.findtext("use_parent_model_frame") or "").strip() in ("1", "true")
        ):
            frame = f"{prefix}__model__"
        return np.asarray(self.frame(frame).rotation @ vector)

    def _body(self, part: Element, tag: str, prefix: str) -> str:
        """The link that a joint's parent or child is, or that the frame is attached to which it names."""
        name, first = _end(part, tag), prefix + _end(part, tag)
        if name == WORLD:
            return WORLD
        for _ in range(len(self.attached) + 1):
            if first in self.draft.bodies:
                return first
            first = self.attached.get(first, "")
        raise refused(f"joins {name!r}, which is no link of the file", f"joint {part.get('name')}")

    def pairs(self) -> None:
        """Make pairs of the joints that were collected, and points of the frames."""
        draft = self.draft
        if any(_end(part, tag) == WORLD for part, _ in self.joints for tag in ("parent", "child")) or draft.pairs:
            draft.bodies.setdefault(WORLD, Body(WORLD))
        for part, prefix in self.joints:
            for pair in self._joint(part, prefix):
                if pair.name in draft.pairs:
                    raise refused(f"the joint {pair.name!r} stands in it twice")
                draft.pairs[pair.name] = pair
            mimic = part.find("axis/mimic")
            if mimic is not None:
                ratio = float(numbers(mimic.findtext("multiplier"), f"mimic of {part.get('name')}", 1, (1,))[0])
                self.couplings.append(((prefix + part.get("name", ""), prefix + mimic.get("joint", "")), ratio))
        for name, link in self.attached.items():
            while link in self.attached:
                link = self.attached[link]
            if not name.endswith("__model__") and link in draft.bodies and name not in self.draft.bodies:
                draft.bodies[link].points[name] = self.frame(name).place

    def draft_of(self, options: ImportOptions, world: str) -> Draft:
        """The draft, once it has its pairs."""
        draft, between = self.draft, set()
        for name in draft.bodies:
            row, _, number = name.rpartition(".")
            joints = draft.pairs_of(name) if row and number.isdigit() else []
            if len(joints) == 2 and all(pair.name.startswith(f"{row}.") for pair in joints):
                between.add(name)
        for names, ratio in self.couplings:
            coupled(draft, names, ratio, between)
        for name in [name for name in draft.drives if name not in draft.pairs]:
            del draft.drives[name]
        if self.lost:
            what = "; ".join(
                f"{key} of {', '.join(names[:8])}{' …' * (len(names) > 8)}" for key, names in self.lost.items()
            )
            draft.note("lost", "", f"is read without {what}")
        return settled(draft, between, world, options.ground)


def _end(part: Element, tag: str) -> str:
    """The name of the parent or child of a joint."""
    end = part.find(tag)
    name = "" if end is None else (end.text or end.get("link") or "").strip()
    if not name:
        raise refused(f"has no {tag}", f"joint {part.get('name')}")
    return name


def _pose(pose: Element | None, name: str) -> Frame:
    """The frame of a pose: x y z roll pitch yaw."""
    if pose is None or not (pose.text or "").strip():
        return Frame()
    where = f"pose of {name}"
    if pose.get("rotation_format") == "quat_xyzw":
        values = numbers(pose.text, where, 7)
        return Frame(Rotation.from_quat(unit(values[3:], where)).as_matrix(), values[:3])
    values = numbers(pose.text, where, 6)
    return Frame(roll_pitch_yaw(np.radians(values[3:]) if pose.get("degrees") == "true" else values[3:]), values[:3])


# Out


def write(positions: Positions, path: Path, options: ExportOptions) -> list[Finding]:
    """Write the mechanism as SDF: links with the global axes, each with its origin at the joint that carries it.

    Cylindrical and planar pairs, which SDF lacks, are rows of joints with bodies of 1e-9 kg between.
    """
    draft = opening(positions, options.row)
    root = Element("sdf", version="1.10")
    world = SubElement(root, "world", name="default")
    _leaf(world, "gravity", text_of(np.zeros(3) if draft.gravity is None else draft.gravity))
    model = SubElement(world, "model", name=draft.name or "mechanism")
    tree, cuts = spanning(draft)
    origins = {draft.ground: np.zeros(3)} | {pair.links[1]: pair.at for pair in tree}
    add_joint(model, Pair("world", "fixed", (WORLD, draft.ground), np.zeros(3)), origins)
    for name, body in draft.bodies.items():
        link = SubElement(model, "link", name=name)
        _leaf(link, "pose", f"{text_of(origins[name])} 0 0 0")
        add_inertial(link, body, origins[name])
        for point, place in body.points.items():
            frame = SubElement(model, "frame", name=f"{name}.{point}", attached_to=name)
            _leaf(frame, "pose", f"{text_of(place - origins[name])} 0 0 0")
    for pair in [*tree, *cuts]:
        chain = [pair] if pair.type not in ("cylindrical", "planar") else steps(pair)
        for step in chain:
            if step.links[1] not in origins:
                origins[step.links[1]] = pair.at
                link = SubElement(model, "link", name=step.links[1])
                _leaf(link, "pose", f"{text_of(pair.at)} 0 0 0")
                add_inertial(link, Body("", SPECK[0], pair.at, SPECK[1] * np.eye(3)), pair.at)
            add_joint(model, step, origins)
    for name, rate in draft.drives.items():
        add_driver(model, f"{name}.turn" if draft.pairs[name].type == "cylindrical" else name, rate)
    written(root, path)
    return draft.findings


def add_joint(model: Element, pair: Pair, origins: dict[str, Array]) -> None:
    """Write a pair as a joint between two links, whose origins are given."""
    joint = SubElement(model, "joint", name=pair.name, type=NAMES.get(pair.type, pair.type))
    offset = pair.at - origins[pair.links[1]]
    if offset.any():
        _leaf(joint, "pose", f"{text_of(offset)} 0 0 0")
    _leaf(joint, "parent", pair.links[0])
    _leaf(joint, "child", pair.links[1])
    if pair.type == "helical" and pair.pitch is not None:
        _leaf(joint, "screw_thread_pitch", text_of(pair.pitch))
    if pair.type not in ("spherical", "fixed"):
        axis = SubElement(joint, "axis")
        _leaf(axis, "xyz", text_of(pair.axis))
        if pair.limits is not None:
            limit = SubElement(axis, "limit")
            for end, value in zip(("lower", "upper"), pair.limits, strict=True):
                _leaf(limit, end, text_of(value))
    if pair.type == "universal" and pair.second_axis is not None:
        _leaf(SubElement(joint, "axis2"), "xyz", text_of(pair.second_axis))


def add_inertial(link: Element, body: Body, origin: Array) -> None:
    """Write mass, centre and inertia of a link."""
    inertial = SubElement(link, "inertial")
    _leaf(inertial, "pose", f"{text_of(body.centre - origin)} 0 0 0")
    _leaf(inertial, "mass", text_of(body.mass))
    inertia = SubElement(inertial, "inertia")
    for row, column in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        _leaf(inertia, f"i{'xyz'[row]}{'xyz'[column]}", text_of(body.inertia[row, column]))


def add_driver(model: Element, joint: str, rate: float) -> None:
    """Write the drive of a joint as Gazebo's controller of its speed."""
    plugin = SubElement(model, "plugin", CONTROLLER)
    _leaf(plugin, "joint_name", joint)
    _leaf(plugin, "initial_velocity", text_of(rate))


def _leaf(parent: Element, tag: str, text: str) -> None:
    """Add an element that holds a text."""
    SubElement(parent, tag).text = text
