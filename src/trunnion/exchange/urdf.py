"""URDF, the trees of ROS: read as the SDF that Gazebo makes of them; what closes a loop stands under `<gazebo>`."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from trunnion.errors import Finding
from trunnion.exchange.draft import Array, Body, Draft, ImportOptions, Pair, refused
from trunnion.exchange.robots import APART, WORLD, laid_out, opening, parsed, text_of, written
from trunnion.exchange.sdf import Reader, add_driver, add_joint, end_of
from trunnion.exchange.skeleton import Positions

__all__ = ["read", "write"]

MOST = {"effort": "1e6", "velocity": "1e3"}  # N m or N, rad/s or m/s: limits that a joint must state and never meets
FAR = 1e3  # m, limit of a slide without one


def read(path: Path, options: ImportOptions) -> Draft:
    """Read the mechanism of a URDF file at the zero of its joints.

    Loops are closed by joints under `<gazebo>`, or by links without mass, fixed to two bodies, whose frames coincide.
    """
    root = parsed(path, "robot")
    if any("xacro" in element.tag for element in root.iter()):
        raise refused("has elements of xacro", remedy="expand it: xacro FILE > FILE.urdf")
    model, world = _model_of(root)
    reader = Reader(root.get("name", ""), "1.9")
    draft = reader.draft
    reader.add_model(model, "", WORLD)
    for part in root.iterfind("transmission/joint"):
        draft.drives.setdefault(part.get("name", ""), 0.0)
    draft.note("exchange.gravity", "", "is read without gravity, which URDF does not state", "add gravity to the model")
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
        child = end_of(part, "child")
        if child not in links or child in inner:
            what = f"has the child {child!r}, which is no link of the file or already has a parent"
            raise refused(what, f"joint {part.get('name')}", "state what closes a loop as an SDF joint under <gazebo>")
        inner.add(child)
        _add_pose(links[child], part, end_of(part, "parent"))
        model.append(_joint_of(part))
    model.extend(child for part in root.findall("gazebo") if part.get("reference") is None for child in part)
    outer = [name for name in links if name not in inner]
    if len(outer) != 1:
        raise refused(f"has {len(outer)} links without a parent: {', '.join(outer[:5])}", remedy="it must be a tree")
    return model, outer[0]


def _joint_of(part: Element) -> Element:
    """The SDF joint of a joint of URDF: its frame is that of its child."""
    joint = Element("joint", name=part.get("name", ""), type=part.get("type", ""))
    joint.extend([*part.findall("parent"), *part.findall("child")])
    axis, limit, mimic, dynamics = (part.find(tag) for tag in ("axis", "limit", "mimic", "dynamics"))
    made = SubElement(joint, "axis")
    SubElement(made, "xyz").text = "1 0 0" if axis is None else axis.get("xyz", "")
    if limit is not None and part.get("type") != "continuous" and {"lower", "upper"} <= limit.attrib.keys():
        limit_element = SubElement(made, "limit")
        for end in ("lower", "upper"):
            SubElement(limit_element, end).text = limit.get(end)
    if mimic is not None:
        coupling = SubElement(made, "mimic", joint=mimic.get("joint", ""))
        SubElement(coupling, "multiplier").text = mimic.get("multiplier", "1")
    for key, value in [] if dynamics is None else dynamics.items():
        SubElement(made, key).text = value
    return joint


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
    for number, (name, body, place) in enumerate(ends if closes else []):
        for other_name, other, other_place in ends[:number]:
            if other != body and frozenset((body, other)) not in joined and np.linalg.norm(place - other_place) < APART:
                draft.pairs[name] = Pair(name, "spherical", (other, body), place)
                what = f"is taken as a ball that closes a loop: the frames {other_name} and {name} coincide"
                draft.warn("exchange.loop", f"joints.{name}", what, "if it is a pin, make it revolute about an axis")


def write(positions: Positions, path: Path) -> list[Finding]:
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
            _write_joint(root, Pair(frame, "fixed", (name, frame), place), {name: origin, frame: place})
    for pair in inner:
        _write_joint(root, pair, origins)
    for pair in closing:
        add_joint(gazebo, pair, origins)
    for name, rate in rates.items():
        add_driver(gazebo, name, rate)
    root.append(gazebo)
    written(root, path)
    return draft.findings


def _write_joint(root: Element, pair: Pair, origins: dict[str, Array]) -> None:
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
