"""MJCF, SDF and URDF: out and in again, against MuJoCo, and files as others write them."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import trunnion
from trunnion.exchange import export_model, import_file, model_text
from trunnion.exchange.draft import positions_of
from trunnion.joints.pairs import PAIRS
from trunnion.model.mechanism import Mechanism

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.yaml"))
# no position without play, no driver, two driven slides whose laws a draft does not know, axes that no file holds
APART = {"indexing-press", "fourbar-in-space", "misaligned-fourbar", "misaligned-hinges", "one-way-clutch"}
APART |= {"pezzuti-cardan-as-built"}
MOVING = [path.stem for path in EXAMPLES if path.stem not in APART and "\ngears:" not in path.read_text("utf-8")]
SUFFIXES = (".mjcf", ".sdf", ".urdf")


def bare(name):
    """An example without what no robot format holds: friction, loads, springs, play, and laws of the drive."""
    mechanism = trunnion.read(Path("examples") / f"{name}.yaml").with_friction("off").with_seats("free")
    mechanism = mechanism.model_copy(update={"loads": {}, "springs": {}, "measures": {}})
    start = trunnion.analyse(mechanism, 4)
    rates = {key: rate if abs(rate) > 1e-9 else 1.0 for key, rate in positions_of(mechanism, 4).draft().drives.items()}
    drivers = {
        name: {"speed": rates[name], "start": float(start["joint_rotation"].sel(joint=name).values[0])}
        for name, driver in mechanism.drivers.items()
        if mechanism.effective_joints[name].pair.turns
    }
    return mechanism.model_copy(update={"drivers": {**mechanism.drivers, **drivers}})


def imported(path, gravity=None, **options):
    """The mechanism of a file, with a gravity if the format states none."""
    draft = import_file(path, **options)
    if gravity is not None:
        draft.gravity = gravity
    model = path.with_suffix(".yaml")
    model.write_text(model_text(draft), "utf-8")
    return trunnion.read(model)


def written(mechanism, path):
    """A mechanism, written and read again."""
    export_model(mechanism, path)
    return imported(path, positions_of(mechanism, 4).draft().gravity if path.suffix == ".urdf" else None)


def same_power(one, other, shares=(0.0, 0.17, 0.41, 0.83)):
    """The drive power is the same at shares of the cycle where both can be assembled, which must be at two at least."""
    duration = min(float(trunnion.analyse(mechanism, 4)["time"].values[-1]) for mechanism in (one, other))
    powers = np.array([
        [trunnion.analyse(mechanism, 4, at=f"{share * duration!r} s")["drive_power"].values.sum() for share in shares]
        for mechanism in (one, other)
    ])  # fmt: skip
    solved = np.isfinite(powers).all(axis=0)
    assert solved.sum() > 1
    np.testing.assert_allclose(*powers[:, solved], rtol=0, atol=1e-9 * max(1e-4, abs(powers[0, solved]).max()))


@pytest.mark.spread(5, "rssr-.mjcf", "slider-crank-.urdf", "universal-joint-.sdf")
@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("name", MOVING)
def test_out_and_in_again_is_the_same_mechanism(name, suffix, tmp_path):
    stated = bare(name)
    again = written(stated, tmp_path / f"again{suffix}")
    assert again.fixed_link == stated.fixed_link
    assert set(again.drivers) == set(stated.drivers)
    assert {key: joint.type for key, joint in again.effective_joints.items()} == {
        key: joint.type for key, joint in stated.effective_joints.items()
    }
    before, after = (positions_of(mechanism, 4).draft() for mechanism in (stated, again))
    assert set(after.bodies) == set(before.bodies)
    for key, body in before.bodies.items():
        if key != before.ground:
            assert after.bodies[key].mass == pytest.approx(body.mass, rel=1e-9)
            assert set(after.bodies[key].points) == set(body.points)
            if body.mass > 0 and (stated.space == "spatial" or again.space == "planar"):
                np.testing.assert_allclose(after.bodies[key].centre, body.centre, atol=1e-9)
                part = (slice(None), slice(None)) if stated.space == "spatial" else (2, 2)
                np.testing.assert_allclose(after.bodies[key].inertia[part], body.inertia[part], atol=1e-9 * body.mass)
    for key, pair in before.pairs.items():
        np.testing.assert_allclose(after.pairs[key].at, pair.at, atol=1e-9)
        if PAIRS[pair.type].needs_axis:
            assert abs(after.pairs[key].axis @ pair.axis) == pytest.approx(1, abs=1e-9) or pair.type == "universal"
    original = trunnion.read(Path("examples") / f"{name}.yaml")
    turns = {joint: PAIRS[kind.type].turns for joint, kind in original.effective_joints.items()}
    plain = all(driver.model_fields_set <= {"speed", "start", "range"} and not (driver.range and turns[joint])
                for joint, driver in original.drivers.items())  # fmt: skip
    same_power(stated, again, (0.0, 0.17, 0.41, 0.83) if plain else (0.0, 0.003, 0.01))  # within the range of its law


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_screw_is_a_screw_again(suffix, tmp_path):
    up, aside = {"axis": [0, 0, 1]}, {"at": [0.1, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]}
    stated = Mechanism(
        name="jack", space="spatial", gravity=[0, 0, -9.81], ground="base", over_constraint="minimum-norm",
        links={
            "base": {"points": {"A": {"at": [0, 0, 0], **up}, "C": aside}},
            "screw": {"points": {"A": {"at": [0, 0, 0], **up}, "B": {"at": [0, 0, 0.2], **up}},
                      "mass": 2, "inertia": {"xx": 0.01, "yy": 0.01, "zz": 0.002}},
            "nut": {"points": {"B": {"at": [0, 0, 0], **up}, "C": aside},
                    "mass": 5, "inertia": {"xx": 0.01, "yy": 0.01, "zz": 0.01}},
        },
        joints={"A": {"type": "revolute", "links": ["base", "screw"]},
                "B": {"type": "helical", "links": ["screw", "nut"], "pitch": "-6 mm"},
                "C": {"type": "prismatic", "links": ["base", "nut"]}},
        drivers={"A": {"speed": "100 rpm"}},
    )  # fmt: skip
    again = written(stated, tmp_path / f"again{suffix}")
    assert again.effective_joints["B"].type == "helical"
    assert again.parameters()["joints.B.pitch"] == pytest.approx(-6e-3, rel=1e-12)
    same_power(stated, again)
    if suffix == ".sdf":  # as older files have it: rad/m, left-handed
        older = f"<thread_pitch>{2 * math.pi / 6e-3!r}</thread_pitch>"
        text = re.sub(r"<screw_thread_pitch>.*?</screw_thread_pitch>", older, (tmp_path / "again.sdf").read_text())
        (tmp_path / "old.sdf").write_text(text)
        assert import_file(tmp_path / "old.sdf").pairs["B"].pitch == pytest.approx(-6e-3, rel=1e-12)


JOINTS = {  # type and direction of joints of a body in a row, and the axis of the pair that they make
    "cylindrical": (["hinge 1 0 0", "slide -1 0 0"], [1, 0, 0]),
    "universal": (["hinge 1 0 0", "hinge 0 1 0"], [1, 0, 0]),
    "spherical": (["hinge 1 0 0", "hinge 0 1 0", "hinge 0 1 1"], [0, 0, 1]),
    "planar": (["slide 1 1 0", "hinge 0 0 1", "slide 1 0 0"], [0, 0, 1]),
}


@pytest.mark.parametrize("kind", JOINTS)
def test_joints_of_one_body_are_the_pair_that_they_make(kind, tmp_path):
    rows = [f'<joint name="j.{k}" type="{row[:5]}" axis="{row[6:]}"/>' for k, row in enumerate(JOINTS[kind][0])]
    body = f'<body name="a" pos="1 2 3">{"".join(rows)}<geom size="1"/></body>'
    (tmp_path / "joints.mjcf").write_text(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    draft = import_file(tmp_path / "joints.mjcf")
    assert set(draft.bodies) == {"world", "a"}
    (pair,) = draft.pairs.values()
    assert (pair.name, pair.type, pair.links) == ("j", kind, ("world", "a"))
    np.testing.assert_allclose(pair.axis, JOINTS[kind][1])
    np.testing.assert_allclose(pair.at, [1, 2, 3])


# MuJoCo as the reference


@pytest.mark.spread(3)
@pytest.mark.parametrize("name", ["durango-fourbar", "slider-crank", "rssr", "double-cardan", "rccc", "jansen"])
def test_inverse_dynamics_of_mujoco_agrees(name, tmp_path):
    """M(q) q̈ + c(q, q̇) of MuJoCo, projected on the velocity, is the drive torque; the loops are closed."""
    mujoco = pytest.importorskip("mujoco")
    stated = bare(name)
    motion = trunnion.analyse(stated, 5)
    (driver,) = stated.drivers
    rate = motion["joint_rotation_velocity"].sel(joint=driver).values
    effort = motion["drive_effort"].sel(driver=driver).values
    for row, instant in enumerate(motion["time"].values):
        path = tmp_path / f"{row}.xml"
        export_model(stated, path, at=f"{float(instant)!r} s")
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        velocity, acceleration = generalised(mujoco, model, motion.isel(position=row))
        data.qvel[:] = velocity
        mujoco.mj_forward(model, data)
        matrix = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, matrix)
        force = matrix @ acceleration + data.qfrc_bias
        assert force @ velocity / rate[row] == pytest.approx(effort[row], abs=1e-9 * abs(effort).max())
        closing = closures(mujoco, model, data)
        assert abs(closing @ velocity).max() < 1e-9 * abs(velocity).max()


def generalised(mujoco, model, motion):
    """Velocities and accelerations of MuJoCo's joints; a ball's are in the axes of the outer body."""
    rates = np.zeros((2, model.nv))
    for number in range(model.njnt):
        joint, address = model.joint(number), model.jnt_dofadr[number]
        name, _, step = joint.name.partition(".")
        for place, key in enumerate(("velocity", "acceleration")):
            if joint.type[0] == mujoco.mjtJoint.mjJNT_BALL:
                outer = model.body(model.jnt_bodyid[number])
                inner = model.body(outer.parentid[0])
                turns = [motion[f"link_angular_{key}"].sel(link=body.name).values for body in (inner, outer)]
                rates[place, address : address + 3] = turns[1] - turns[0]
                if key == "acceleration":
                    rates[1, address : address + 3] -= np.cross(
                        motion["link_angular_velocity"].sel(link=outer.name).values, rates[0, address : address + 3]
                    )
            elif step.startswith("turn") and step != "turn":
                rates[place, address] = crossed(motion, model, number, key)
            else:
                kind = "slide" if joint.type[0] == mujoco.mjtJoint.mjJNT_SLIDE else "rotation"
                rates[place, address] = motion[f"joint_{kind}_{key}"].sel(joint=name).values
    return rates[0], rates[1]


def crossed(motion, model, number, key):
    """Rate of a hinge of a Cardan joint: of ω = a ȧ + b ḃ, and ω' = a ä + b b̈ + ω₁ × a ȧ + (ω₁ + a ȧ) × b ḃ."""
    first = number - (model.joint(number).name[-1] == "2")
    axes = np.array([model.jnt_axis[first], model.jnt_axis[first + 1]]).T
    outer = model.body(model.jnt_bodyid[number])
    inner = model.body(outer.parentid[0]).name
    spin, turn = (motion["link_angular_velocity"].sel(link=body).values for body in (inner, outer.name))
    rates = np.linalg.lstsq(axes, turn - spin, rcond=None)[0]
    if key == "acceleration":
        change = [motion["link_angular_acceleration"].sel(link=body).values for body in (inner, outer.name)]
        moving = np.cross(spin, axes[:, 0] * rates[0]) + np.cross(spin + axes[:, 0] * rates[0], axes[:, 1] * rates[1])
        rates = np.linalg.lstsq(axes, change[1] - change[0] - moving, rcond=None)[0]
    return float(rates[number - first])


def closures(mujoco, model, data):
    """The Jacobian of all equalities: connect 3 rows, weld 6."""
    rows = []
    for number in range(model.neq):
        first, second = model.eq_obj1id[number], model.eq_obj2id[number]
        weld = model.eq_type[number] == mujoco.mjtEq.mjEQ_WELD
        anchor = data.xpos[first] + (0 if weld else data.xmat[first].reshape(3, 3) @ model.eq_data[number, :3])
        parts = []
        for body in (first, second):
            shift, turn = np.zeros((3, model.nv)), np.zeros((3, model.nv))
            mujoco.mj_jac(model, data, shift, turn, anchor, body)
            parts.append(np.vstack([shift, turn]) if weld else shift)
        rows.append(parts[0] - parts[1])
    return np.vstack(rows)


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", ["slider-crank", "rssr", "double-cardan"])
def test_the_tree_of_a_urdf_is_what_mujoco_reads(name, tmp_path):
    mujoco = pytest.importorskip("mujoco")
    stated = bare(name)
    export_model(stated, tmp_path / "tree.urdf")
    text = (tmp_path / "tree.urdf").read_text()  # bodies without mass are welcome to no engine
    bounds = 'boundmass="1e-12" boundinertia="1e-14" fusestatic="false" balanceinertia="true"'
    model = mujoco.MjModel.from_xml_string(text.replace("<link", f"<mujoco><compiler {bounds}/></mujoco><link", 1))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    draft = positions_of(stated, 4).draft()
    for body in draft.bodies.values():
        if body.name != draft.ground:
            number = model.body(body.name).id
            assert model.body_mass[number] == pytest.approx(body.mass, rel=1e-9)
            np.testing.assert_allclose(data.xipos[number], body.centre, atol=1e-9)
    compared = 0
    for number in range(model.njnt):
        pair = draft.pairs.get(model.joint(number).name)
        if pair is not None:
            compared += 1
            np.testing.assert_allclose(data.xanchor[number], pair.at, atol=1e-9)
            assert abs(data.xaxis[number] @ pair.axis) == pytest.approx(1, abs=1e-9)
    assert compared


ORIENTATIONS = (
    lambda r: f'quat="{row(r.normal(size=4))}"',
    lambda r: f'euler="{row(r.uniform(-180, 180, 3))}"',
    lambda r: f'axisangle="{row(r.normal(size=4))}"',
    lambda r: f'xyaxes="{row(r.normal(size=6))}"',
    lambda r: f'zaxis="{row(r.normal(size=3))}"',
)
SHAPES = ("sphere", "capsule", "cylinder", "ellipsoid", "box")


def row(values):
    return " ".join(repr(float(value)) for value in values)


def placed(draw):
    """Place and orientation of something, in one of the ways of MJCF."""
    turn = ORIENTATIONS[draw.integers(5)](draw)
    return f'pos="{row(draw.normal(size=3))}" {turn}'


def shape(draw):
    kind = SHAPES[draw.integers(5)]
    size = row(draw.uniform(0.01, 0.3, 3))
    place = placed(draw)
    if kind != "sphere" and draw.integers(2):
        place = f'fromto="{row(draw.normal(size=6))}"'
    weight = ("", 'mass="0.7"', 'class="light"')[draw.integers(3)]
    return f'<geom type="{kind}" size="{size}" {place} {weight}/>'


@settings(deadline=None, max_examples=25)
@given(
    seed=st.integers(0, 2**31 - 1),
    order=st.sampled_from(["xyz", "zyx", "XYZ", "zxz", "ZYx"]),
    masses=st.sampled_from(['inertiafromgeom="true"', 'settotalmass="7.5"', 'inertiagrouprange="1 3"', ""]),
)
def test_any_frame_and_shape_is_where_mujoco_has_it(seed, order, masses, tmp_path_factory):
    mujoco = pytest.importorskip("mujoco")
    draw = np.random.default_rng(seed)
    axes = [row(draw.normal(size=3)) for _ in range(4)]
    text = f"""<mujoco><compiler eulerseq="{order}" {masses}/>
<default><geom density="500" group="1"/><default class="light"><geom density="20"/></default></default>
<worldbody><body name="a" {placed(draw)}>
  <joint name="A" axis="{axes[0]}" pos="0.1 0.2 0.3" range="-10 30" ref="5"/>{shape(draw)}{shape(draw)}
  <geom size="0.2" group="4"/>
  <frame {placed(draw)}><frame {placed(draw)}>{shape(draw)}
    <body name="b" {placed(draw)}><joint name="B" type="slide" axis="{axes[1]}"/>{shape(draw)}
      <body name="c" {placed(draw)}><inertial {placed(draw)} mass="2" diaginertia="1 2 2.5"/>
        <joint name="C" axis="{axes[2]}"/>{shape(draw)}</body></body></frame></frame></body></worldbody></mujoco>"""
    path = tmp_path_factory.mktemp("frames") / "frames.xml"
    path.write_text(text)
    draft = import_file(path)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for name in "abc":
        number = model.body(name).id
        body, turn = draft.bodies[name], data.ximat[number].reshape(3, 3)
        assert body.mass == pytest.approx(model.body_mass[number], rel=1e-9)
        np.testing.assert_allclose(body.centre, data.xipos[number], atol=1e-9)
        inertia = turn @ np.diag(model.body_inertia[number]) @ turn.T
        np.testing.assert_allclose(body.inertia, inertia, atol=1e-8 * abs(inertia).max())
    for name in "ABC":
        number = model.joint(name).id
        np.testing.assert_allclose(draft.pairs[name].axis, data.xaxis[number], atol=1e-9)
        np.testing.assert_allclose(draft.pairs[name].at, data.xanchor[number], atol=1e-9)
    np.testing.assert_allclose(draft.pairs["A"].limits, model.jnt_range[0] - model.qpos0[0], atol=1e-12)


# A four-bar as others write it. A (0, 0), B (0, 60), C (170, 115), D (200, 0) mm, x of every link along it.

AB, BC, DC = 0.06, math.hypot(0.17, 0.055), math.hypot(0.03, 0.115)
CRANK, COUPLER, ROCKER = math.pi / 2, math.atan2(0.055, 0.17), math.atan2(0.115, -0.03)
REFERENCE = f"""
trunnion: 1
name: four-bar by hand
space: planar
gravity: [0, -9.81]
ground: bench
links:
  bench: {{points: {{A: [0, 0], D: [0.2, 0]}}}}
  crank: {{points: {{A: [0, 0], B: [{AB!r}, 0]}}, mass: 0.4 kg, centre: [0.03, 0], inertia: 3.0e-4}}
  coupler: {{points: {{B: [0, 0], C: [{BC!r}, 0]}}, mass: 0.9 kg, centre: [0.08, 0.01], inertia: 2.0e-3}}
  rocker: {{points: {{D: [0, 0], C: [{DC!r}, 0]}}, mass: 0.7 kg, centre: [0.05, 0], inertia: 1.0e-3}}
joints:
  A: {{type: revolute, links: [bench, crank]}}
  B: {{type: revolute, links: [crank, coupler]}}
  C: {{type: revolute, links: [coupler, rocker]}}
  D: {{type: revolute, links: [bench, rocker]}}
drivers: {{A: {{speed: 10 rad/s, start: 90 deg}}}}
assembly: {{D: {math.degrees(ROCKER)!r} deg}}
"""

MJCF = f"""<mujoco model="four-bar"><compiler angle="degree" autolimits="true"/>
<option gravity="0 0 -9.81"/>
<default><joint damping="0.1"/><default class="pin"><joint type="hinge" axis="0 0 1" range="-170 170"/>
  <default class="free pin"><joint range="0 0" limited="false"/></default></default></default>
<worldbody><light pos="0 0 3"/><geom type="plane" size="1 1 0.1"/>
<body name="bench" pos="0.5 -0.2 0.3" childclass="pin"><geom type="box" size="0.1 0.02 0.01" pos="0.1 0 -0.02"/>
  <frame euler="90 0 0">
    <body name="crank" euler="0 0 90"><joint name="A" class="free pin"/>
      <inertial pos="0.03 0 0" mass="0.4" diaginertia="1e-4 2.5e-4 3e-4"/>
      <body name="coupler" pos="{AB!r} 0 0" axisangle="0 0 1 {math.degrees(COUPLER - CRANK)!r}">
        <joint name="B"/><inertial pos="0.08 0.01 0" mass="0.9" fullinertia="1e-3 1.5e-3 2e-3 1e-4 0 0"/>
        <geom type="capsule" fromto="0 0 0 {BC!r} 0 0" size="0.01"/></body></body>
    <frame pos="0.2 0 0"><body name="rocker" xyaxes="-0.03 0.115 0 -0.115 -0.03 0"><joint name="D"/>
      <inertial pos="0.05 0 0" mass="0.7" diaginertia="1e-3 1e-3 1e-3" quat="1 2 3 4"/></body></frame>
  </frame></body></worldbody>
<equality><connect name="C" body1="coupler" body2="rocker" anchor="{BC!r} 0 0"/></equality>
<actuator><velocity joint="A" kv="5"/></actuator><keyframe><key ctrl="10"/></keyframe></mujoco>"""


def link_sdf(name, pose, mass, centre, inertia):
    """A link whose inertial frame is turned about z, which changes nothing in the plane."""
    return f"""<link name="{name}">{pose}<inertial><pose>{centre} 0 0 0 0.3</pose><mass>{mass}</mass><inertia>
  <ixx>{inertia}</ixx><ixy>0</ixy><ixz>0</ixz><iyy>{inertia}</iyy><iyz>0</iyz><izz>{inertia}</izz></inertia></inertial>
  <visual name="v"><geometry><box><size>1 1 1</size></box></geometry></visual></link>"""


DRIVE = """<plugin name="x::JointController" filename="y"><joint_name>A</joint_name>
<initial_velocity>10</initial_velocity></plugin>"""
QUATERNION = f'rotation_format="quat_xyzw">0 0 0 0 0 {math.sin(ROCKER / 2)!r} {math.cos(ROCKER / 2)!r}'
SDF = f"""<?xml version="1.0"?><sdf version="1.9"><world name="w"><gravity>0 0 -9.81</gravity>
<model name="four-bar"><pose degrees="true">0.5 -0.2 0.3 90 0 0</pose>
<frame name="right" attached_to="bench"><pose>0.2 0 0 0 0 0</pose></frame>
{link_sdf("bench", "", 3, "0 0", 1)}
{link_sdf("crank", f'<pose relative_to="bench">0 0 0 0 0 {CRANK!r}</pose>', 0.4, "0.03 0", 3e-4)}
{link_sdf("coupler", f'<pose relative_to="crank">{AB!r} 0 0 0 0 {COUPLER - CRANK!r}</pose>', 0.9, "0.08 0.01", 2e-3)}
{link_sdf("rocker", f'<pose relative_to="right" {QUATERNION}</pose>', 0.7, "0.05 0", 1e-3)}
<joint name="floor" type="fixed"><parent>world</parent><child>bench</child></joint>
<joint name="A" type="revolute"><parent>bench</parent><child>crank</child><axis><xyz>0 0 1</xyz></axis></joint>
<joint name="B" type="revolute"><parent>crank</parent><child>coupler</child>
  <axis><xyz expressed_in="right">0 0 1</xyz><limit><lower>-2</lower><upper>2</upper></limit></axis></joint>
<joint name="C" type="revolute"><pose relative_to="rocker">{DC!r} 0 0.04 1.2 0 0</pose><parent>coupler</parent>
  <child>rocker</child><axis><xyz expressed_in="__model__">0 0 1</xyz>
  <dynamics><damping>0.2</damping></dynamics></axis></joint>
<joint name="D" type="continuous"><parent>right</parent><child>rocker</child><axis><xyz>0 0 1</xyz></axis></joint>
{DRIVE}</model></world></sdf>"""
B, C = (0.0, 0.06), (0.17, 0.115)
OLD_SDF = f"""<sdf version="1.5"><world name="w"><gravity>0 0 -9.81</gravity>
<model name="four-bar"><pose>0 0 0 {math.pi / 2!r} 0 0</pose>
{link_sdf("bench", "", 3, "0 0", 1)}
{link_sdf("crank", f"<pose>0 0 0 0 0 {CRANK!r}</pose>", 0.4, "0.03 0", 3e-4)}
{link_sdf("coupler", f"<pose>{B[0]} {B[1]} 0 0 0 {COUPLER!r}</pose>", 0.9, "0.08 0.01", 2e-3)}
{link_sdf("rocker", f"<pose>0.2 0 0 0 0 {ROCKER!r}</pose>", 0.7, "0.05 0", 1e-3)}
<joint name="floor" type="fixed"><parent>world</parent><child>bench</child></joint>
<joint name="A" type="revolute"><parent>bench</parent><child>crank</child><axis><xyz>0 0 1</xyz></axis></joint>
<joint name="B" type="revolute"><parent>crank</parent><child>coupler</child><pose>0 0 0 0.7 0 0</pose>
  <axis><use_parent_model_frame>1</use_parent_model_frame><xyz>0 0 1</xyz></axis></joint>
<joint name="C" type="revolute"><parent>coupler</parent><child>rocker</child><pose>{DC!r} 0 0 0 0 0</pose>
  <axis><xyz>0 0 1</xyz></axis></joint>
<joint name="D" type="revolute"><parent>bench</parent><child>rocker</child><axis><xyz>0 0 1</xyz></axis></joint>
{DRIVE}</model></world></sdf>"""


def link_urdf(name, mass, centre, inertia):
    return f"""<link name="{name}"><inertial><origin xyz="{centre} 0" rpy="0 0 0.3"/><mass value="{mass}"/>
<inertia ixx="{inertia}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial></link>"""


URDF = f"""<robot name="four-bar"><material name="grey"/><link name="world"/>{link_urdf("bench", 3, "0 0", 1)}
{link_urdf("crank", 0.4, "0.03 0", 3e-4)}{link_urdf("coupler", 0.9, "0.08 0.01", 2e-3)}
{link_urdf("rocker", 0.7, "0.05 0", 1e-3)}<link name="C"/><link name="end"/>
<joint name="floor" type="fixed"><origin xyz="0.5 -0.2 0.3" rpy="{math.pi / 2!r} 0 0"/>
  <parent link="world"/><child link="bench"/></joint>
<joint name="A" type="continuous"><origin rpy="0 0 {CRANK!r}"/>
  <parent link="bench"/><child link="crank"/><axis xyz="0 0 1"/></joint>
<joint name="B" type="revolute"><origin xyz="{AB!r} 0 0" rpy="0 0 {COUPLER - CRANK!r}"/>
  <parent link="crank"/><child link="coupler"/>
  <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="10" velocity="9"/><dynamics damping="0.3"/></joint>
<joint name="D" type="continuous"><origin xyz="0.2 0 0" rpy="0 0 {ROCKER!r}"/>
  <parent link="bench"/><child link="rocker"/><axis xyz="0 0 1"/></joint>
<joint name="f1" type="fixed"><origin xyz="{BC!r} 0 0" rpy="0.2 0.1 0"/>
  <parent link="coupler"/><child link="end"/></joint>
<joint name="f2" type="fixed"><origin xyz="{DC!r} 0 0"/><parent link="rocker"/><child link="C"/></joint>
<transmission name="t"><type>simple</type><joint name="A"/><actuator name="m"/></transmission></robot>"""


@pytest.mark.parametrize(
    ("text", "name"),
    [(MJCF, "f.xml"), (SDF, "f.sdf"), (OLD_SDF, "f.sdf"), (URDF, "f.urdf")],
    ids=["mjcf", "sdf", "old-sdf", "urdf"],
)
def test_files_with_nested_frames_are_the_mechanism_written_by_hand(text, name, tmp_path):
    (tmp_path / name).write_text(text)
    reference = tmp_path / "reference.yaml"
    reference.write_text(REFERENCE)
    gravity = np.array([0.0, 0.0, -9.81]) if name.endswith("urdf") else None
    draft = import_file(tmp_path / name, speed="10 rad/s")
    assert list(draft.drives.values()) == [10.0]
    made = imported(tmp_path / name, gravity, speed="10 rad/s")
    assert made.space == "planar"
    assert made.fixed_link == "bench"
    assert set(made.links) == {"bench", "crank", "coupler", "rocker"}
    assert {joint.type for joint in made.joints.values()} == {"revolute"}
    assert set(made.joints) == set("ABCD")
    same_power(trunnion.read(reference), made)
    lost = [finding.what for finding in draft.findings if finding.code == "exchange.lost"]
    if text is not OLD_SDF:
        assert "damping" in " ".join(lost)


# What is doubtful, lost or broken


def finding_of(text, name, folder):
    """The one finding of a file that cannot be read."""
    path = folder / name
    path.write_text(text)
    with pytest.raises(trunnion.MechanismError) as error:
        import_file(path)
    (finding,) = error.value.findings
    return str(finding)


WHOLE = {"mjcf": MJCF, "sdf": SDF, "urdf": URDF}


@pytest.mark.parametrize(
    ("kind", "old", "new", "sentence"),
    [
        ("mjcf", 'mass="0.9"', 'mass="heavy"', "which is no row of numbers"),
        ("mjcf", 'mass="0.9"', "", "is not stated"),
        ("mjcf", 'pos="0.05 0 0"', 'pos="0.05 0"', "has 2 numbers instead of 3"),
        ("mjcf", 'pos="0.05 0 0"', f'pos="{"1 " * 10**6}"', "which is no row of numbers"),
        ("mjcf", 'name="rocker"', 'name="crank"', "'crank' stands in it twice"),
        ("mjcf", 'body2="rocker"', 'body2="roker"', "names the body 'roker'"),
        ("mjcf", 'axis="0 0 1"', 'axis="0 0 0"', "has no direction"),
        ("sdf", "<parent>crank</parent>", "<parent>krank</parent>", "joins 'krank', which is no link"),
        ("sdf", "<parent>crank</parent>", "", "has no parent"),
        ("sdf", 'relative_to="crank"', 'relative_to="krank"', "which the file does not have"),
        ("sdf", 'name="B" type="revolute"', 'name="B" type="magnet"', "'magnet', which is not read"),
        ("urdf", '<child link="coupler"/>', '<child link="rod"/>', "which is no link of the file"),
        ("urdf", '<parent link="crank"/>', "", "has no parent"),
        ("urdf", '<link name="end"/>', '<link name="end"/><link name="lone"/>', "2 links without a parent"),
        ("urdf", "<material", '<xacro:if xmlns:xacro="http://www.ros.org/wiki/xacro"/><material', "elements of xacro"),
    ],
)
def test_what_cannot_be_read_says_where(kind, old, new, sentence, tmp_path):
    assert old in WHOLE[kind]
    assert sentence in finding_of(WHOLE[kind].replace(old, new), f"bad.{kind}", tmp_path)


def test_a_loop_that_is_drawn_open_is_refused(tmp_path):
    sites = MJCF.replace('body1="coupler" body2="rocker" anchor', 'site1="a" site2="b" x')
    sites = sites.replace('<joint name="B"/>', f'<joint name="B"/><site name="a" pos="{BC!r} 0 0"/>')
    closed, opened = (sites.replace('<joint name="D"/>', f'<joint name="D"/><site name="b" pos="{x!r} 0 0"/>')
                      for x in (DC, DC + 0.002))  # fmt: skip
    (tmp_path / "closed.mjcf").write_text(closed)
    assert len(import_file(tmp_path / "closed.mjcf").pairs) == 4
    assert "2 mm apart as the file draws them" in finding_of(opened, "open.mjcf", tmp_path)


def test_names_of_any_kind_survive(tmp_path):
    text = MJCF.replace('"crank"', '"Kurbel Ø 8 &amp; Co."').replace('"coupler"', '"杆 &lt;1&gt;"')
    (tmp_path / "names.mjcf").write_text(text, "utf-8")
    made = imported(tmp_path / "names.mjcf")
    assert set(made.links) == {"bench", "rocker", "Kurbel Ø 8 & Co-", "杆 <1>"}
    for suffix in SUFFIXES:
        assert set(written(made, tmp_path / f"again{suffix}").links) == set(made.links)


@pytest.mark.parametrize("name", ["durango-fourbar", "rssr"])
def test_the_drive_of_an_mjcf_holds_its_speed(name, tmp_path):
    """In MuJoCo, from rest, after 50 ms; loads and friction are not in the file."""
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "model.mjcf"
    trunnion.exchange.export_model(trunnion.read(Path("examples") / f"{name}.yaml"), path, at="60 deg")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    for _ in range(50):
        mujoco.mj_step(model, data)
    assert data.qvel[model.jnt_dofadr[model.actuator_trnid[0, 0]]] == pytest.approx(data.ctrl[0], rel=0.01)
