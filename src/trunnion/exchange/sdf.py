"""SDF, the files of Gazebo, and URDF, the trees of ROS, which is read as the SDF that Gazebo makes of it.

Both are written with every loop: joints of SDF may close them, in URDF those under `<gazebo>`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from scipy.spatial.transform import Rotation

from trunnion.errors import Finding
from trunnion.exchange.draft import PARALLEL, Array, Body, Draft, ImportOptions, Pair, Place, Positions, refused
from trunnion.exchange.robots import (
    APART,
    WORLD,
    Scene,
    laid_out,
    number,
    numbers,
    opening,
    parsed,
    tensor,
    text_of,
    unit,
    written,
)  # fmt: skip

TYPES = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "ball": "spherical",
         "universal": "universal", "revolute2": "universal", "screw": "helical", "fixed": "fixed",
         "planar": "planar"}  # fmt: skip  # the last of URDF
NAMES = {"spherical": "ball", "helical": "screw"}  # of those that SDF calls otherwise
UNLIMITED = 1e3  # rad or m, from which a limit is none
SPECK = Body("", 1e-9, inertia=1e-15 * np.eye(3))  # holds two joints: Gazebo refuses bodies without mass
CONTROLLER = {"filename": "gz-sim-joint-controller-system", "name": "gz::sim::systems::JointController"}
YES = ("1", "true")
MOST = {"effort": "1e6", "velocity": "1e3"}  # N m or N, rad/s or m/s: limits that a joint must state and never meets
FAR = 1e3  # m, limit of a slide without one


def read(path: Path, options: ImportOptions) -> Draft:
    """Read the mechanism of an SDF file where it is drawn."""
    root = parsed(path, "sdf")
    world = root.find("world")
    models = (root if world is None else world).findall("model")
    if not models:
        raise refused("has no model", remedy="export a model")
    reader = _Reader(models[0].get("name", ""), root.get("version", "1.6"))
    draft = reader.draft
    if world is not None:
        gravity = numbers(world.findtext("gravity"), "gravity", 3, (0, 0, -9.8))
        draft.gravity = gravity if gravity.any() else None
    for count, model in enumerate(models):
        reader.add_model(model, f"{model.get('name', count)}::" if count else "", WORLD)
    if root.find(".//include") is not None:
        draft.lose("models that it includes, which `gz sdf -p` writes in full")
    reader.add_joints()
    return reader.settled(WORLD, options.ground)


class _Reader(Scene):
    """The links, joints and frames of the models of a file, by names with the scope of nested models."""

    def __init__(self, name: str, version: str) -> None:
        super().__init__(name)
        self.version = tuple(int(part) if part.isdigit() else 0 for part in version.split("."))
        self.poses: dict[str, tuple[Place, str]] = {}  # of every frame, and what it is relative to
        self.frames: dict[str, Place] = {WORLD: Place()}  # those that are found in the global one
        self.attached: dict[str, str] = {}  # what a frame moves with
        self.joints: list[tuple[Element, str]] = []

    def add_model(self, model: Element, prefix: str, parent: str) -> None:
        """Collect the links, joints and frames of a model and of those nested in it."""
        base = f"{prefix}__model__"
        self._place(model, base, parent, prefix)
        for part in model:
            name = prefix + part.get("name", part.tag)
            if part.tag == "link":
                self.add_body(name)
                self._place(part, name, base, prefix)
                self.attached.setdefault(base, name)
            elif part.tag == "frame":
                self.attached[name] = prefix + part.get("attached_to", "__model__")
                self._place(part, name, self.attached[name], prefix)
            elif part.tag == "joint":
                self.joints.append((part, prefix))
                child = _end_of(part, "child")
                self._place(part, f"joint {name}", child if child == WORLD else prefix + child, prefix)
            elif part.tag == "model":
                self.add_model(part, f"{name}::", base)
                self.poses[name], self.attached[name] = (Place(), f"{name}::__model__"), f"{name}::__model__"
            elif part.tag == "plugin" and part.findtext("joint_name"):
                rate = number(part.findtext("initial_velocity"), f"initial_velocity of {name}", 0)
                self.draft.drives[prefix + part.findtext("joint_name", "").strip()] = rate
            elif part.tag == "plugin":
                self.draft.lose("plugin", part.get("name", ""))
        for part in model.findall("joint"):  # its name may also be that of a link, in URDF and old files
            name = prefix + part.get("name", "joint")
            self.poses.setdefault(name, (Place(), f"joint {name}"))
        for link in model.findall("link"):
            name = prefix + link.get("name", "link")
            self._weigh(link, name)
            if (model.findtext("static") or "").strip() in YES:
                self.add_pair(Pair(f"{name}.static", "fixed", (WORLD, name), np.zeros(3)))

    def _place(self, part: Element, name: str, default: str, prefix: str) -> None:
        """Note the pose of a part, and what it is relative to."""
        if part.get("placement_frame"):
            raise refused("states placement_frame, which is not read", f"{part.tag} {name}", "place it by its pose")
        pose = part.find("pose")
        relative = "" if pose is None else pose.get("relative_to") or pose.get("frame") or ""
        self.poses[name] = _pose(pose, name), prefix + relative if relative else default

    def frame(self, name: str) -> Place:
        """The global frame of a name; MechanismError if poses go round in a circle or name what is not there."""
        row = [name]
        while row[-1] not in self.frames:
            if row[-1] not in self.poses:
                raise refused(f"its pose is relative to {row[-1]!r}, which the file does not have", name)
            row.append(self.poses[row[-1]][1])
            if row[-1] in row[:-1]:
                raise refused("its pose is relative to itself, through others", name)
        for inner in reversed(row[:-1]):
            local, outer = self.poses[inner]
            self.frames[inner] = self.frames[outer] @ local
        return self.frames[name]

    def _weigh(self, link: Element, name: str) -> None:
        """Read mass, centre and inertia of a link."""
        draft, inertial = self.draft, link.find("inertial")
        body = draft.bodies[name]
        if inertial is None or inertial.find("mass") is None:
            what = "states no mass, which by the rules of SDF is 1 kg with 1 kg m² about each axis"
            draft.warn("exchange.mass", f"links.{name}", what, "state its mass in the model")
            inertial = Element("inertial") if inertial is None else inertial
        frame = self.frame(name) @ _pose(inertial.find("pose"), f"inertial of {name}")
        entries = [
            number(inertial.findtext(f"inertia/i{key}"), f"i{key} of {name}", key[0] == key[1])
            for key in ("xx", "yy", "zz", "xy", "xz", "yz")
        ]
        body.mass = number(inertial.findtext("mass"), f"mass of {name}", 1)
        body.centre, body.inertia = frame.shift, frame.inertia(tensor(*entries))
        if link.find("visual") is not None or link.find("collision") is not None:
            draft.lose("shape", name)

    def add_joints(self) -> None:
        """Make pairs of the joints that were collected, and points of the frames."""
        bodies = self.draft.bodies
        ends = {_end_of(part, tag) for part, _ in self.joints for tag in ("parent", "child")}
        if WORLD in ends or self.draft.pairs:
            bodies.setdefault(WORLD, Body(WORLD))
        for part, prefix in self.joints:
            if part.get("type") == "gearbox":
                self.draft.lose("gearbox", part.get("name", ""))
            elif part.get("type") != "floating":
                self.add_pair(self._pair(part, prefix))
            mimic = part.find("axis/mimic")
            if mimic is not None:
                name = prefix + part.get("name", "")
                ratio = number(mimic.findtext("multiplier"), f"mimic of {name}", 1)
                self.couplings.append((name, prefix + mimic.get("joint", ""), ratio))
        for name in self.attached:
            link = self._link(name)
            if link and not name.endswith("__model__") and name not in bodies:
                bodies[link].points[name] = self.frame(name).shift
        for name in bodies:  # between joints of a row, as this program writes them
            row, _, count = name.rpartition(".")
            pairs = self.draft.pairs_of(name) if row and count.isdigit() else []
            if len(pairs) == 2 and all(pair.name.startswith(f"{row}.") for pair in pairs):
                self.between.add(name)
        self.draft.drives = {name: rate for name, rate in self.draft.drives.items() if name in self.draft.pairs}

    def _pair(self, part: Element, prefix: str) -> Pair:
        """The pair of a joint."""
        name, kind = prefix + part.get("name", "joint"), part.get("type", "")
        where, ends = f"joint {name}", []
        if kind not in TYPES:
            raise refused(f"has the type {kind!r}, which is not read", where, f"use {', '.join([*TYPES][:-1])}")
        for tag in ("parent", "child"):
            end = _end_of(part, tag)
            ends.append(WORLD if end == WORLD else self._link(prefix + end))
            if not ends[-1]:
                raise refused(f"joins {end!r}, which is no link of the file", where)
        for key in ("damping", "friction", "spring_stiffness"):
            if any(number(value.text, f"{key} of {where}", 0) for value in part.iter(key)):
                self.draft.lose(key, name)
        pair = Pair(name, TYPES[kind], (ends[0], ends[1]), self.frame(where).shift)
        if pair.type not in ("spherical", "fixed"):
            pair.axis = self._axis(part, "axis", where, prefix)
            texts = [part.findtext(f"axis/limit/{end}", "inf").replace("inf", "1e16") for end in ("lower", "upper")]
            low, high = (number(text, f"limit of {where}") for text in texts)
            pair.limits = (low, high) if max(abs(low), abs(high)) < UNLIMITED else None
        if pair.type == "universal":
            pair.second_axis = self._axis(part, "axis2", where, prefix)
            if abs(pair.axis @ pair.second_axis) > PARALLEL:
                raise refused("turns about two axes that are not square to each other", where, "write two joints")
        if pair.type == "helical":
            pitch, old = part.findtext("screw_thread_pitch"), part.findtext("thread_pitch")
            if pitch is None and old is not None:  # rad/m, left-handed
                pair.pitch = -2 * np.pi / (number(old, f"thread_pitch of {where}") or np.inf)
            else:
                pair.pitch = number(pitch, f"screw_thread_pitch of {where}")
        return pair

    def _axis(self, part: Element, tag: str, where: str, prefix: str) -> Array:
        """The direction of an axis, in global axes."""
        axis, xyz, frame = part.find(tag), part.find(f"{tag}/xyz"), where
        text = None if xyz is None else xyz.text
        in_model = axis is not None and (axis.findtext("use_parent_model_frame") or "").strip() in YES
        if xyz is not None and xyz.get("expressed_in"):
            frame = prefix + xyz.get("expressed_in", "")
        elif in_model or self.version < (1, 5):
            frame = f"{prefix}__model__"
        name = f"{tag} of {where}"
        return np.asarray(self.frame(frame).matrix @ unit(numbers(text, name, 3, (0, 0, 1)), name))

    def _link(self, name: str) -> str:
        """The link that a name is, or that the frame moves with which it names; empty if there is none."""
        for _ in self.attached:
            name = name if name in self.draft.bodies else self.attached.get(name, "")
        return name if name in self.draft.bodies else ""


def _end_of(part: Element, tag: str) -> str:
    """The name of the parent or child of a joint."""
    end = part.find(tag)
    name = "" if end is None else (end.text or end.get("link") or "").strip()
    if not name:
        raise refused(f"has no {tag}", f"joint {part.get('name')}")
    return name


def _pose(pose: Element | None, name: str) -> Place:
    """The frame of a pose: x y z roll pitch yaw."""
    if pose is None or not (pose.text or "").strip():
        return Place()
    where = f"pose of {name}"
    if pose.get("rotation_format") == "quat_xyzw":
        values = numbers(pose.text, where, 7)
        return Place(Rotation.from_quat(unit(values[3:], where)).as_matrix(), values[:3])
    values = numbers(pose.text, where, 6)
    turns = Rotation.from_euler("xyz", values[3:], degrees=pose.get("degrees") in YES)
    return Place(turns.as_matrix(), values[:3])


# Out


def write(positions: Positions, path: Path) -> list[Finding]:
    """Write the mechanism as SDF: links with the global axes, each with its origin at the joint that carries it.

    Cylindrical and planar pairs, which SDF lacks, are rows of joints with bodies of 1e-9 kg between.
    """
    draft = opening(positions)
    root = Element("sdf", version="1.10")
    world = SubElement(root, "world", name="default")
    _leaf(world, "gravity", np.zeros(3) if draft.gravity is None else draft.gravity)
    model = SubElement(world, "model", name=draft.name or "mechanism")
    origins, inner, closing, rates = laid_out(draft, ("cylindrical", "planar"))
    _add_joint(model, Pair(WORLD, "fixed", (WORLD, draft.ground), np.zeros(3)), origins)
    for name, origin in origins.items():
        link = SubElement(model, "link", name=name)
        _leaf_pose(link, origin)
        body = draft.bodies.get(name, SPECK)
        inertial = SubElement(link, "inertial")
        _leaf_pose(inertial, body.centre - origin if name in draft.bodies else np.zeros(3))
        _leaf(inertial, "mass", body.mass)
        inertia = SubElement(inertial, "inertia")
        for row, column in zip(*np.triu_indices(3), strict=True):
            _leaf(inertia, f"i{'xyz'[row]}{'xyz'[column]}", body.inertia[row, column])
        for point, place in body.points.items():
            _leaf_pose(SubElement(model, "frame", name=f"{name}.{point}", attached_to=name), place - origin)
    for pair in [*inner, *closing]:
        _add_joint(model, pair, origins)
    _add_drivers(model, rates)
    written(root, path)
    return draft.findings


def _add_joint(model: Element, pair: Pair, origins: dict[str, Array]) -> None:
    """Write a pair as a joint between two links, whose origins are given."""
    joint = SubElement(model, "joint", name=pair.name, type=NAMES.get(pair.type, pair.type))
    offset = pair.at - origins[pair.links[1]]
    if offset.any():
        _leaf_pose(joint, offset)
    _leaf(joint, "parent", pair.links[0])
    _leaf(joint, "child", pair.links[1])
    if pair.type == "helical" and pair.pitch is not None:
        _leaf(joint, "screw_thread_pitch", pair.pitch)
    if pair.type not in ("spherical", "fixed"):
        axis = SubElement(joint, "axis")
        _leaf(axis, "xyz", pair.axis)
        if pair.limits is not None:
            limit = SubElement(axis, "limit")
            for end, value in zip(("lower", "upper"), pair.limits, strict=True):
                _leaf(limit, end, value)
    if pair.type == "universal" and pair.second_axis is not None:
        _leaf(SubElement(joint, "axis2"), "xyz", pair.second_axis)


def _add_drivers(model: Element, rates: Mapping[str, float]) -> None:
    """Write driven joints, with Gazebo's controllers of their speeds."""
    for joint, rate in rates.items():
        plugin = SubElement(model, "plugin", CONTROLLER)
        _leaf(plugin, "joint_name", joint)
        _leaf(plugin, "initial_velocity", rate)


def _leaf(parent: Element, tag: str, content: str | float | Array) -> None:
    """Add an element that holds a text or numbers."""
    SubElement(parent, tag).text = content if isinstance(content, str) else text_of(content)


def _leaf_pose(parent: Element, place: Array) -> None:
    _leaf(parent, "pose", np.append(place, np.zeros(3)))


# ---- URDF ---------------------------------------------------------------------------------------------------------


def read_urdf(path: Path, options: ImportOptions) -> Draft:
    """Read the mechanism of a URDF file at the zero of its joints.

    Loops are closed by joints under `<gazebo>`, or by links without mass, fixed to two bodies, whose frames coincide.
    """
    root = parsed(path, "robot")
    if any("xacro" in element.tag for element in root.iter()):
        raise refused("has elements of xacro", remedy="expand it: xacro FILE > FILE.urdf")
    model, world = _model_of(root)
    reader = _Reader(root.get("name", ""), "1.9")
    draft = reader.draft
    reader.add_model(model, "", WORLD)
    for part in root.iterfind("transmission/joint"):
        draft.drives.setdefault(part.get("name", ""), 0.0)
    draft.lose("gravity, which URDF does not state")
    reader.add_joints()
    _frames(draft, closes=root.find("gazebo/joint") is None)
    return reader.settled(world, options.ground)


def _model_of(root: Element) -> tuple[Element, str]:
    """The SDF model of a robot, and the name of the link that carries all others."""
    model = Element("model")
    links: dict[str, Element] = {}
    for link in root.findall("link"):
        links[link.get("name", "")] = made = SubElement(model, "link", name=link.get("name", ""))
        inertial, inertia_entry = SubElement(made, "inertial"), link.find("inertial")
        mass, inertia = link.find("inertial/mass"), link.find("inertial/inertia")
        SubElement(inertial, "mass").text = "0" if mass is None else mass.get("value", "")
        entries = SubElement(inertial, "inertia")
        for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
            SubElement(entries, key).text = "0" if inertia is None else inertia.get(key)
        if inertia_entry is not None:
            _add_pose(inertial, inertia_entry)
        made.extend([*link.findall("visual"), *link.findall("collision")])
    inner: set[str] = set()
    for part in root.findall("joint"):
        child = _end_of(part, "child")
        if child not in links or child in inner:
            what = f"has the child {child!r}, which is no link of the file or already has a parent"
            raise refused(what, f"joint {part.get('name')}", "state what closes a loop as an SDF joint under <gazebo>")
        inner.add(child)
        _add_pose(links[child], part, _end_of(part, "parent"))
        joint = SubElement(model, "joint", name=part.get("name", ""), type=part.get("type", ""))
        joint.extend([*part.findall("parent"), *part.findall("child")])
        axis, limit, mimic, dynamics = (part.find(tag) for tag in ("axis", "limit", "mimic", "dynamics"))
        entries = SubElement(joint, "axis")
        SubElement(entries, "xyz").text = "1 0 0" if axis is None else axis.get("xyz", "")
        if limit is not None and part.get("type") != "continuous" and {"lower", "upper"} <= limit.attrib.keys():
            ends = SubElement(entries, "limit")
            for end in ("lower", "upper"):
                SubElement(ends, end).text = limit.get(end)
        if mimic is not None:
            coupling = SubElement(entries, "mimic", joint=mimic.get("joint", ""))
            SubElement(coupling, "multiplier").text = mimic.get("multiplier", "1")
        for key, value in [] if dynamics is None else dynamics.items():
            SubElement(entries, key).text = value
    model.extend(child for part in root.findall("gazebo") if part.get("reference") is None for child in part)
    outer = [name for name in links if name not in inner]
    if len(outer) != 1:
        raise refused(f"has {len(outer)} links without a parent: {', '.join(outer[:5])}", remedy="it must be a tree")
    return model, outer[0]


def _add_pose(made: Element, source: Element, relative: str = "") -> None:
    """Write an origin as a pose."""
    origin = source.find("origin")
    xyz, rpy = ("0 0 0", "0 0 0") if origin is None else (origin.get("xyz", "0 0 0"), origin.get("rpy", "0 0 0"))
    pose = SubElement(made, "pose", {"relative_to": relative} if relative else {})
    pose.text = f"{xyz} {rpy}"


def _frames(draft: Draft, closes: bool) -> None:
    """Make points of links without mass that are fixed to a body and carry nothing.

    closes: whether two of them at one place, on bodies that no joint joins, close a loop, by a ball.
    """
    counts = Counter(link for pair in draft.pairs.values() for link in pair.links)
    ends: list[tuple[str, str, Array]] = []
    for name, pair in list(draft.pairs.items()):
        holder, frame = pair.links
        if pair.type == "fixed" and counts[frame] == 1 and not draft.bodies[frame].mass > 0:
            draft.bodies[holder].points[frame] = pair.at
            ends.append((frame, holder, pair.at))
            del draft.pairs[name], draft.bodies[frame]
    joined = {frozenset(pair.links) for pair in draft.pairs.values()}
    for (other_name, other, other_place), (name, body, place) in combinations(ends, 2) if closes else ():
        if other != body and frozenset((body, other)) not in joined and np.linalg.norm(place - other_place) < APART:
            draft.pairs[name] = Pair(name, "spherical", (other, body), place)
            what = f"is taken as a ball that closes a loop: the frames {other_name} and {name} coincide"
            draft.warn("exchange.loop", f"joints.{name}", what, "if it is a pin, make it revolute about an axis")


def write_urdf(positions: Positions, path: Path) -> list[Finding]:
    """Write the mechanism as URDF: a tree of links with the global axes; Gazebo's joints close its loops.

    Pairs that URDF lacks are rows of joints with links without mass between.
    """
    draft = opening(positions, "gravity")
    root, gazebo = Element("robot", name=draft.name or "mechanism"), Element("gazebo")
    origins, inner, closing, rates = laid_out(draft, ("cylindrical", "helical", "universal", "spherical"))
    for name, origin in origins.items():
        link, body = SubElement(root, "link", name=name), draft.bodies.get(name, Body(name))
        if body.mass > 0:
            inertial = SubElement(link, "inertial")
            SubElement(inertial, "origin", xyz=text_of(body.centre - origin))
            SubElement(inertial, "mass", value=text_of(body.mass))
            entries = {f"i{'xyz'[i]}{'xyz'[j]}": text_of(body.inertia[i, j]) for i in range(3) for j in range(i, 3)}
            SubElement(inertial, "inertia", entries)
        for point, place in body.points.items():
            frame = f"{name}.{point}"
            SubElement(root, "link", name=frame)
            _tree_joint(root, Pair(frame, "fixed", (name, frame), place), {name: origin, frame: place})
    for pair in inner:
        _tree_joint(root, pair, origins)
    for pair in closing:
        _add_joint(gazebo, pair, origins)
    _add_drivers(gazebo, rates)
    root.append(gazebo)
    written(root, path)
    return draft.findings


def _tree_joint(root: Element, pair: Pair, origins: dict[str, Array]) -> None:
    """Write a joint of the tree, at the origin of its child."""
    turns = pair.type == "revolute"
    joint = SubElement(root, "joint", name=pair.name, type="continuous" if turns and pair.limits is None else pair.type)
    SubElement(joint, "origin", xyz=text_of(origins[pair.links[1]] - origins[pair.links[0]]))
    SubElement(joint, "parent", link=pair.links[0])
    SubElement(joint, "child", link=pair.links[1])
    if pair.type != "fixed":
        SubElement(joint, "axis", xyz=text_of(pair.axis))
    if pair.type == "prismatic" or (turns and pair.limits is not None):
        low, high = pair.limits or (-FAR, FAR)
        SubElement(joint, "limit", {"lower": text_of(low), "upper": text_of(high), **MOST})
    if pair.type == "prismatic" and pair.pitch is not None:
        turn = f"{pair.name.rpartition('.')[0]}.turn"
        SubElement(joint, "mimic", joint=turn, multiplier=text_of(pair.pitch / (2 * np.pi)))
