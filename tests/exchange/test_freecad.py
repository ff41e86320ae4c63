"""Assemblies of FreeCAD, written here as its Document.xml has them, at any placement and through any tree of parts."""

import math
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from trunnion import analyse
from trunnion.exchange import import_file, model_text
from trunnion.model.mechanism import read_mechanism

KINDS = ["Fixed", "Revolute", "Cylindrical", "Slider", "Ball", "Distance", "Parallel", "Perpendicular", "Angle",
         "RackPinion", "Screw", "Gears", "Belt"]  # fmt: skip
UP = Rotation.identity()


def turned(axis, angle):
    """The rotation about an axis."""
    return Rotation.from_rotvec(angle * np.asarray(axis, float) / np.linalg.norm(axis))


def matrix(place, rotation):
    """The frame of a placement."""
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = rotation.as_matrix(), place
    return frame


class Drawing:
    """A document: objects with properties, as FreeCAD writes them."""

    def __init__(self):
        self.objects: list[tuple[str, str, str]] = []

    def add(self, kind, name, **properties):
        rows = "".join(f'<Property name="{key}" type="x">{text}</Property>' for key, text in properties.items())
        self.objects.append((kind, name, f'<Properties Count="{len(properties)}">{rows}</Properties>'))
        return name

    def text(self):
        types = "".join(f'<Object type="{kind}" name="{name}" id="1"/>' for kind, name, _ in self.objects)
        data = "".join(f'<Object name="{name}">{rows}</Object>' for _, name, rows in self.objects)
        head = '<?xml version="1.0" encoding="utf-8"?><Document SchemaVersion="4" ProgramVersion="1.0.0">'
        return f"{head}<Objects>{types}</Objects><ObjectData>{data}</ObjectData></Document>"

    def save(self, path):
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("Document.xml", self.text())
            archive.writestr("GuiDocument.xml", "<Document/>")
            archive.writestr("PartShape.brp", "DBRep_DrawableShape")
        return path


def string(value):
    return f'<String value="{value}"/>'


def boolean(value):
    return f'<Bool value="{str(value).lower()}"/>'


def number(value):
    return f'<Float value="{value!r}"/>'


def placed(frame):
    """A placement, with the quaternion as FreeCAD has it, the scalar last."""
    keys = ("Px", "Py", "Pz", "Q0", "Q1", "Q2", "Q3")
    numbers = [*frame[:3, 3], *Rotation.from_matrix(frame[:3, :3]).as_quat()]
    attributes = (f'{key}="{float(number)!r}"' for key, number in zip(keys, numbers, strict=True))
    return f"<PropertyPlacement {' '.join(attributes)}/>"


def grouped(*names):
    return f'<LinkList count="{len(names)}">{"".join(f"""<Link value="{name}"/>""" for name in names)}</LinkList>'


def linked(name, *subs, file=""):
    inner = "".join(f'<Sub value="{sub}"/>' for sub in subs)
    return f'<XLink file="{file}" stamp="" name="{name}" count="{len(subs)}">{inner}</XLink>'


def kinds(kind):
    listed = "".join(f'<Enum value="{one}"/>' for one in KINDS)
    return f'<Integer value="{KINDS.index(kind)}"/><CustomEnumList count="13">{listed}</CustomEnumList>'


def joint(drawing, name, kind, ends, **more):
    """A joint of two connectors: root, path and the frame in the last part."""
    properties = {"Label": string(name), "JointType": kinds(kind)}
    for which, (root, path, frame) in zip("12", ends, strict=True):
        properties |= {f"Reference{which}": linked(root, path, path), f"Placement{which}": placed(frame)}
    return drawing.add("App::FeaturePython", name, **properties, **more)


# a four-bar in mm: ground pins at (0, 0) and (200, 0), crank pin at (60, 0), B where the bars of 180 and 150 meet
PINS = {"O": (0.0, 0.0, 0.0), "A": (60.0, 0.0, 3.0), "C": (200.0, 0.0, 0.0)}
_x = (180.0**2 - 150.0**2 + 140.0**2) / (2 * 140.0)
PINS["B"] = (60.0 + _x, math.sqrt(180.0**2 - _x**2), 6.0)
BARS = {"O": ("Base", "Crank"), "A": ("Crank", "Rod"), "B": ("Rod", "Rocker"), "C": ("Base", "Rocker")}


def four_bar(frame, frames):
    """The four-bar turned as a whole by a frame, each part with a frame and a tree of its own, shapes in `frame`."""
    drawing, top = Drawing(), matrix((5.0, -3.0, 2.0), turned((1, 2, 3), 0.7))
    inner = matrix((1.0, 2.0, 3.0), turned((3, -1, 2), 1.1))
    path, local = {}, {}
    # a body alone; a feature in a part; a link to a body elsewhere; a link to a part with a body and a datum in it
    drawing.add(
        "PartDesign::Body", "Base", Label=string("Base"), Placement=placed(frame @ frames["Base"]),
        Group=grouped("Pad"),
    )  # fmt: skip
    drawing.add("PartDesign::Pad", "Pad", Placement=placed(top))
    path["Base"], local["Base"] = "Base.Pad.Face3", frame @ frames["Base"]
    drawing.add(
        "App::Part", "Crank", Label=string("Crank"), Placement=placed(frame @ frames["Crank"]), Group=grouped("Box")
    )
    drawing.add("Part::Feature", "Box", Placement=placed(inner))
    path["Crank"], local["Crank"] = "Crank.Box.Edge1", frame @ frames["Crank"] @ inner
    drawing.add("PartDesign::Body", "Body", Placement=placed(top), Group=grouped("Pad001"))
    drawing.add(
        "App::Link", "Rod", Label=string("Rod"), LinkedObject=linked("Body"), LinkTransform=boolean(False),
        LinkPlacement=placed(frame @ frames["Rod"]), Placement=placed(frame @ frames["Rod"]),
    )  # fmt: skip
    path["Rod"], local["Rod"] = "Rod.Pad001.Edge2", frame @ frames["Rod"]
    drawing.add("App::Part", "Sub", Placement=placed(top), Group=grouped("Inner"))
    drawing.add("PartDesign::Body", "Inner", Placement=placed(inner), Group=grouped("Datum"))
    drawing.add("PartDesign::CoordinateSystem", "Datum", Placement=placed(top))
    drawing.add(
        "App::Link", "Link", Label=string("Rocker"), LinkedObject=linked("Sub"), LinkTransform=boolean(False),
        LinkPlacement=placed(frame @ frames["Rocker"]),
    )  # fmt: skip
    path["Rocker"], local["Rocker"] = "Link.Inner.Datum.", frame @ frames["Rocker"] @ inner @ top
    names = []
    for k, (name, bars) in enumerate(BARS.items()):
        ends = []
        flipped = turned((1, 1, 0), math.pi) if k % 2 else turned((0, 0, 1), 0.3 * k)
        for bar, flip in zip(bars, (UP, flipped), strict=True):
            at = frame @ matrix(PINS[name], flip)
            ends.append(("Assembly", path[bar], np.linalg.inv(local[bar]) @ at))
        names.append(joint(drawing, name, "Revolute", ends))
    drawing.add("App::FeaturePython", "Grounded", ObjectToGround='<Link value="Base"/>', Placement=placed(top))
    drawing.add("Assembly::JointGroup", "Joints", Group=grouped("Grounded", *names))
    drawing.add("App::DocumentObjectGroup", "Folder", Group=grouped("Crank", "Rod"))
    drawing.add(
        "Assembly::AssemblyObject", "Assembly", Label=string("Four-bar"), Placement=placed(top),
        Group=grouped("Base", "Folder", "Link", "Joints"),
    )  # fmt: skip
    return drawing


ALIKE = dict.fromkeys(("Base", "Crank", "Rod", "Rocker"), np.eye(4))


def codes(draft):
    return [finding.code.removeprefix("exchange.") for finding in draft.findings]


frames = st.builds(
    lambda place, axis, angle: matrix(place, turned(axis, angle)),
    st.tuples(*[st.floats(-500, 500)] * 3),
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda axis: np.linalg.norm(axis) > 0.1),
    st.floats(-3, 3),
)


@settings(max_examples=25, deadline=None)
@given(whole=frames, own=st.tuples(frames, frames, frames, frames))
def test_joints_lie_where_the_tree_of_parts_has_them(tmp_path_factory, whole, own):
    drawing = four_bar(whole, dict(zip(ALIKE, own, strict=True)))
    draft = import_file(drawing.save(tmp_path_factory.mktemp("fc") / "one.FCStd"))
    assert draft.ground == "Base"
    assert set(draft.bodies) == {"Base", "Crank", "Rod", "Rocker"}
    assert codes(draft) == ["lost", "drive"]
    for name, bars in BARS.items():
        pair = draft.pairs[name]
        assert pair.links == bars
        assert pair.type == "revolute"
        np.testing.assert_allclose(pair.at * 1e3, (whole @ [*PINS[name], 1.0])[:3], atol=1e-9)
        np.testing.assert_allclose(pair.axis, whole[:3, 2], atol=1e-12)


def test_the_model_moves_like_one_written_by_hand(tmp_path):
    whole = matrix((100.0, 20.0, -40.0), turned((1, 1, 1), 2 * math.pi / 3))
    draft = import_file(four_bar(whole, dict.fromkeys(ALIKE, whole)).save(tmp_path / "a.fcstd"))
    (tmp_path / "model.yaml").write_text(model_text(draft), encoding="utf-8")
    mechanism = read_mechanism(tmp_path / "model.yaml")
    assert mechanism.space == "planar"
    turns = analyse(mechanism, 90, variables=["joint_rotation"])["joint_rotation"].sel(joint="C").values
    crank = np.arange(90) * math.radians(4.0)
    pin = np.array([60 * np.cos(crank) - 200.0, 60 * np.sin(crank)])  # from C
    away = np.hypot(*pin)
    rocker = np.arctan2(pin[1], pin[0]) - np.arccos((away**2 + 150.0**2 - 180.0**2) / (300.0 * away))
    np.testing.assert_allclose(np.diff(np.unwrap(turns)), np.diff(np.unwrap(rocker)), atol=1e-9)


def pair_of(kind, second, tmp_path, **more):
    """Two bodies with one joint, the second connector at a frame in that of the first; a pin joins them to a third."""
    drawing = Drawing()
    for name in ("Base", "Slide", "Arm"):
        drawing.add("Part::Box", name, Placement=placed(np.eye(4)))
    names = [
        joint(drawing, "J", kind, [("Base", "Face1", np.eye(4)), ("Slide", "Face1", second)], **more),
        joint(drawing, "P", "Revolute", [("Slide", "Face1", second), ("Arm", "Face1", second)]),
    ]
    drawing.add("App::FeaturePython", "Grounded", ObjectToGround='<Link value="Base"/>')
    drawing.add("Assembly::JointGroup", "Joints", Group=grouped("Grounded", *names))
    drawing.add("Assembly::AssemblyObject", "Assembly", Group=grouped("Base", "Slide", "Arm", "Joints"))
    return import_file(drawing.save(tmp_path / "two.FCStd"))


def test_kinds_of_joints_and_their_limits(tmp_path):
    ends = {"LengthMin": number(-5.0), "LengthMax": number(20.0), "AngleMin": number(-30.0), "AngleMax": number(90.0)}
    ends |= {f"Enable{key}": boolean(True) for key in ends}
    along, round_ = matrix((0, 0, 8.0), UP), matrix((0, 0, 0), turned((0, 0, 1), math.radians(10)))
    turns = (math.radians(-40), math.radians(80))
    for kind, frame, type_, limits in (
        ("Slider", along, "prismatic", (-0.013, 0.012)), ("Revolute", round_, "revolute", turns),
        ("Cylindrical", round_, "cylindrical", None), ("Ball", round_, "spherical", None),
    ):  # fmt: skip
        draft = pair_of(kind, frame, tmp_path, **ends)
        assert codes(draft) == ["lost", "drive"][: 1 + (kind != "Ball")]
        assert draft.pairs["J"].type == type_
        assert draft.pairs["J"].limits == (limits and pytest.approx(limits))
    assert set(pair_of("Fixed", np.eye(4), tmp_path).bodies) == {"Base", "Arm"}


@pytest.mark.parametrize("kind", KINDS[5:])
def test_what_is_no_pair_is_said(kind, tmp_path):
    draft = pair_of(kind, np.eye(4), tmp_path)
    assert set(draft.pairs) == {"P"}
    (lost,) = [finding for finding in draft.findings if finding.code == "exchange.lost"]
    assert f"{kind}, which is no pair (J)" in lost.what
