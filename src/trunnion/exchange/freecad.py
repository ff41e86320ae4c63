"""FreeCAD: the parts and joints of an Assembly (FreeCAD 1.0 and later) in a .FCStd file, read without FreeCAD.

The file is a zip archive whose Document.xml has all objects with their properties. A joint names two connectors, each a
path through the tree of parts to a face, edge or vertex, and the placement of a frame in the last part of the path; the
first part of the path is what moves. Frames coincide but for what the joint leaves free, which is about and along z.
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from defusedxml.ElementTree import iterparse
from scipy.spatial.transform import Rotation

from trunnion.exchange.draft import PARALLEL, Body, Draft, ImportOptions, Pair, Place, few, free_name, refused

MEMBER = "Document.xml"
LARGEST, MOST, MEMBERS = 100_000_000, 1_000_000, 100_000  # bytes and elements of it; members of an archive
MILLI = 1e-3  # m
APART = 1e-6  # of the size of the assembly: frames of a joint that do not coincide
TYPES = ("Fixed", "Revolute", "Cylindrical", "Slider", "Ball", "Distance", "Parallel", "Perpendicular", "Angle",
         "RackPinion", "Screw", "Gears", "Belt")  # fmt: skip
PAIRS = dict(zip(TYPES, ("fixed", "revolute", "cylindrical", "prismatic", "spherical"), strict=False))
ASSEMBLY, BODY, LINKS = "Assembly::AssemblyObject", "PartDesign::Body", "App::LinkGroup"
CONTAINERS = ("App::Part", LINKS, "Assembly::AssemblyLink", ASSEMBLY)
GROUPS = ("App::DocumentObjectGroup", "Assembly::JointGroup", "Assembly::ViewGroup")
INERT = (*GROUPS, "App::Origin", "App::FeaturePython")  # what is no part
IN_BODIES = ("Sketcher::SketchObject", "PartDesign::Point", "PartDesign::Line", "PartDesign::Plane",
             "PartDesign::CoordinateSystem", "Part::LocalCoordinateSystem")  # fmt: skip
PROPERTIES = {
    "Label", "Placement", "LinkPlacement", "LinkTransform", "LinkedObject", "Group", "Rigid", "ObjectToGround",
    "JointType", "Reference1", "Reference2", "Placement1", "Placement2", "Activated", "Suppressed",
    *(f"{enable}{key}{end}" for enable in ("", "Enable") for key in ("Length", "Angle") for end in ("Min", "Max")),
}  # fmt: skip


@dataclass
class DocumentObject:
    """An object of the document: its name, type, and what is wanted of its properties."""

    name: str
    type: str
    properties: dict[str, Element]

    def first(self, key: str) -> Element:
        """What stands first in a property."""
        return next(iter(self.properties.get(key, ())), Element(""))

    def value(self, key: str, default: str = "") -> str:
        """The text of a property."""
        return self.first(key).get("value") or default

    def on(self, key: str, default: str = "false") -> bool:
        """A property that is true or false."""
        return self.value(key, default).lower() in ("true", "1")

    @property
    def label(self) -> str:
        """The name that the user sees."""
        return self.value("Label", self.name)

    def frame(self, *keys: str) -> Place:
        """The first placement that there is; ValueError for one that is none."""
        place = self.first(next((key for key in keys if key in self.properties), ""))
        shift = MILLI * np.array([float(place.get(key, "0")) for key in ("Px", "Py", "Pz")])
        turn = Rotation.from_quat([float(place.get(f"Q{k}", "01"[k == 3])) for k in range(4)])  # ValueError for 0
        if not np.isfinite([*turn.as_quat(), *shift]).all():
            raise ValueError
        return Place(turn.as_matrix(), shift)

    def links(self, key: str) -> list[str]:
        """The names of objects that a property refers to, or the path of a connector."""
        link = self.first(key)
        if link.tag == "XLink":
            path = next((sub.get("value", "") for sub in link.iter("Sub")), link.get("sub", ""))
            return [name for name in (link.get("name", ""), *path.split(".")) if name] if link.get("name") else []
        names = (each.get("value", "") for child in self.properties.get(key, ()) for each in child.iter("Link"))
        return [name for name in names if name]


def read(path: Path, options: ImportOptions) -> Draft:
    """Read the assembly of a file."""
    types, objects = dict[str, str](), dict[str, DocumentObject]()
    with zipfile.ZipFile(path) as archive:
        few(len(archive.namelist()), MEMBERS, "members")
        few(archive.getinfo(MEMBER).file_size, LARGEST, f"bytes of {MEMBER}")
        with archive.open(MEMBER) as stream:  # as it comes, so that what is not needed takes no memory
            for number, (_, element) in enumerate(iterparse(stream)):
                few(number, MOST, "elements")
                name = element.get("name", "")
                if element.tag == "Property" and name not in PROPERTIES:
                    element.clear()
                elif element.tag == "Object" and element.get("type"):
                    types[name] = element.get("type", "")
                elif element.tag == "Object":
                    properties = {each.get("name", ""): each for each in element.iter("Property")}
                    objects[name] = DocumentObject(name, types.get(name, ""), properties)
    assemblies = [each for each in objects.values() if each.type == ASSEMBLY]
    inner = {name for assembly in assemblies for name in assembly.links("Group")}
    outer = [assembly for assembly in assemblies if assembly.name not in inner]
    if not outer:
        what = "has no assembly of FreeCAD 1.0 or later, such as Assembly4 and A2plus do not make"
        raise refused(what, remedy="join the parts in FreeCAD's Assembly workbench")
    draft = Draft(outer[0].label)
    if len(outer) > 1:
        draft.lose("other assemblies", *(each.label for each in outer[1:]))
    _Assembly(objects, outer[0], draft).read()
    if not draft.pairs:
        raise refused("has no joint between two parts that is read")
    draft.lose("masses, which follow from shapes that only FreeCAD knows")
    return draft


class _Assembly:
    """An assembly, in whose frame everything is."""

    def __init__(self, objects: dict[str, DocumentObject], assembly: DocumentObject, draft: Draft) -> None:
        self.objects, self.assembly, self.draft = objects, assembly, draft
        self.bodies: dict[str, str] = {}  # name of the body by that of the object
        self.frames: dict[str, tuple[Place, Place]] = {}  # of the connectors, by pair

    def read(self) -> None:
        """Add what is grounded, and the pairs of the joints."""
        draft, members = self.draft, list(self._members(self.assembly, set()))
        for each in members:
            for name in each.links("ObjectToGround"):
                body = self._body(name)
                draft.ground = draft.ground or body
                if body != draft.ground:
                    weld = free_name(each.label, draft.pairs)
                    draft.pairs[weld] = Pair(weld, "fixed", (draft.ground, body), np.zeros(3))
        for each in members:
            if "JointType" in each.properties:
                self._joint(each)
        loose = [each.label for each in members if each.name not in self.bodies and each.type not in INERT]
        if loose:
            draft.lose("parts without a joint", *loose)
        places = [frame.shift for both in self.frames.values() for frame in both]
        size = float(np.ptp(places, axis=0).max()) if len(places) else 0.0
        for name, (first, second) in self.frames.items():  # they coincide but for what the kind of joint leaves free
            kind, gap, axis = draft.pairs[name].type, second.shift - first.shift, first.matrix[:, 2]
            if kind in ("cylindrical", "prismatic"):
                gap = gap - (gap @ axis) * axis
            tilt = 0.0 if kind == "spherical" else float(np.linalg.norm(np.cross(axis, second.matrix[:, 2])))
            if np.linalg.norm(gap) > APART * size or tilt > PARALLEL:
                what = f"its connectors are {1e3 * np.linalg.norm(gap):.3g} mm and {math.degrees(tilt):.3g}° apart"
                draft.warn("exchange.apart", f"joints.{name}", what, "solve the assembly in FreeCAD and save it")

    def _members(self, group: DocumentObject, visited: set[str]) -> Iterator[DocumentObject]:
        """What an assembly or group holds, groups resolved."""
        for name in group.links("Group"):
            if name in self.objects and name not in visited:
                visited.add(name)
                yield self.objects[name]
                if self.objects[name].type in GROUPS:
                    yield from self._members(self.objects[name], visited)

    def _body(self, name: str) -> str:
        """The body of a part that moves."""
        if name not in self.bodies:
            label = free_name(self.objects[name].label, self.draft.bodies)
            self.bodies[name], self.draft.bodies[label] = label, Body(label)
        return self.bodies[name]

    def _connector(self, joint: DocumentObject, which: str) -> tuple[str, Place]:
        """The part that moves with a connector, and the frame of the connector in that of the assembly."""
        path = joint.links(f"Reference{which}")
        if self.assembly.name in path:
            path = path[path.index(self.assembly.name) + 1 :]
        frame, moving = Place(), ""
        for k, part in ((k, self.objects[name]) for k, name in enumerate(path) if name in self.objects):
            if part.type in GROUPS:
                continue
            loose = part.type == LINKS or (part.type == "Assembly::AssemblyLink" and not part.on("Rigid", "true"))
            moving = moving or ("" if loose else part.name)
            frame, target = frame @ part.frame("LinkPlacement", "Placement"), self._target(part)
            if part.on("LinkTransform") and target is not part:
                frame = frame @ target.frame("LinkPlacement", "Placement")
            if part.first("LinkedObject").get("file") and len(path) > k + 2:
                what = f"joins a part in another file, {'.'.join(path)}: where it lies in that is not known"
                remedy = "look at its place, or join the part itself"
                self.draft.warn("exchange.outside", f"joints.{joint.label}", what, remedy)
            inside = self.objects.get(path[k + 1]) if len(path) > k + 1 else None
            if target.type == BODY and inside is not None and inside.type in IN_BODIES:
                frame = frame @ inside.frame("Placement")
            if target.type not in CONTAINERS:
                break
        return moving, frame @ joint.frame(f"Placement{which}")

    def _target(self, part: DocumentObject) -> DocumentObject:
        """What a link stands for, in the same file."""
        visited = {part.name}
        while (link := part.links("LinkedObject")) and link[0] in self.objects and link[0] not in visited:
            visited.add(link[0])
            part = self.objects[link[0]]
        return part

    def _joint(self, joint: DocumentObject) -> None:
        """Add the pair of a joint, or tell why there is none."""
        draft = self.draft
        kinds = [text.get("value", "") for text in joint.properties["JointType"].iter("Enum")] or TYPES
        kind = kinds[int(joint.value("JointType", "0"))]
        (part, first), (mate, second) = self._connector(joint, "1"), self._connector(joint, "2")
        if not joint.on("Activated", "true") or joint.on("Suppressed"):
            draft.lose("joints that are not active", joint.label)
        elif kind not in PAIRS:
            draft.lose(f"joints of the kind {kind}, which is no pair", joint.label)
        elif not part or not mate or part == mate:
            draft.lose("joints that do not join two parts", joint.label)
        else:
            name = free_name(joint.label, draft.pairs)
            pair = Pair(name, PAIRS[kind], (self._body(part), self._body(mate)), second.shift, first.matrix[:, 2])
            paths = (".".join(joint.links(f"Reference{which}")[1:]) for which in "12")
            pair.comments.append(f"{kind} joint of {' and '.join(paths)}")
            pair.limits = _limits(joint, kind, first.inverse @ second)
            draft.pairs[name], self.frames[name] = pair, (first, second)


def _limits(joint: DocumentObject, kind: str, between: Place) -> tuple[float, float] | None:
    """The range of a joint's coordinate from where it is drawn, rad or m; None if it is not limited on both sides."""
    turn = math.atan2(between.matrix[1, 0], between.matrix[0, 0])
    coordinates = {"Revolute": ("Angle", turn, math.pi / 180), "Slider": ("Length", float(between.shift[2]), MILLI)}
    key, here, unit = coordinates.get(kind, ("", 0.0, 0.0))
    if not key or not (joint.on(f"Enable{key}Min") and joint.on(f"Enable{key}Max")):
        return None
    low, high = (float(joint.value(f"{key}{end}", "0")) * unit - here for end in ("Min", "Max"))
    return (low, high) if low < high else None
