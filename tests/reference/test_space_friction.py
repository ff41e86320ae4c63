"""Friction in space against closed forms and the plane: Cardan joint, screw, hinges of a door, coupled wheels."""

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms import MODELS, build, model
from mechanisms_parts import example, joined
from mechanisms_space import cardan, rssr
from reference.maximal_space import raised
from reference.test_space_values import loop
from trunnion.solve.run import prepare
from trunnion.solve.space.determinacy import LOOKED

LOCKED = int(trunnion.Status.LOCKED)
PIN, ARM = 0.010, 0.040  # radius of the cross pins, and where on the cross the forks hold it


def analysed(data, steps, **options):
    return trunnion.analyse(trunnion.Mechanism(trunnion=1, **data), steps=steps, **options)


def hooke(delta, friction, shafts=0.0):
    """Massless ideal Cardan joint; the ends of a bearing as long as the cross is wide are where the forks hold it."""
    brake = {"brake": {"joint": "D", "resisting_torque": 10.0, "useful": True}}
    data = loop("RCCC", (90, 90, 90, 180 - delta), start=0.003, assembly={"D": -np.pi / 2}, loads=brake)
    for row in data["loop"][1:3]:
        row |= {"pin": {"radius": PIN, "bearing": 2 * ARM}, "friction": friction}
    if shafts:
        for row, span in ((data["loop"][0], 0.1), (data["loop"][3], 0.15)):
            row |= {"pin": {"radius": shafts, "bearing": span}, "friction": friction}
    return data


@pytest.mark.parametrize(("delta", "shafts"), [(15.0, 0.02), (45.0, 0.0)])
def test_massless_cardan(delta, shafts):
    """1 − η to the first order in f; what is left shrinks as f².

    Pins (2/π) f (r_p/R_c) [tan δ + ln tan(π/4 + δ/2)]; shafts (4/π) f r_b [tan δ/l₂ + ln tan(π/4 + δ/2)/l₁], l₁ of the
    input, l₂ of the output, whose torque is constant here. With a constant torque of the input they change places.
    """
    d = np.radians(delta)
    tangent, logarithm = np.tan(d), np.log(np.tan(np.pi / 4 + d / 2))
    slope = 2 / np.pi * PIN / ARM * (tangent + logarithm) + 4 / np.pi * shafts * (logarithm / 0.1 + tangent / 0.15)
    left = []
    for f in np.array([0.02, 0.01, 0.005]) / (5 if shafts else 1):  # the shafts' own friction leans on their load
        loss = 1 - float(analysed(hooke(delta, f, shafts), 1440).efficiency)
        assert loss == pytest.approx(slope * f, rel=0.05)
        left.append(loss - slope * f)
    assert left[0] / left[1] == pytest.approx(4, rel=0.1)
    assert left[1] / left[2] == pytest.approx(4, rel=0.1)


@pytest.mark.parametrize(
    "data",
    [
        {**cardan(misalignment=45.0, error=0.5, offset=30.0), "joint_defaults": {}},
        {**rssr().data, "joint_defaults": {}, "gravity": [0, 0, 0]},
    ],
    ids=["at 45 degrees", "RSSR with inertia"],
)
def test_nothing_is_lost_without_friction(data):
    """η = 1 within 1e-12, and the power balances to 1e-10 of its peak at every position."""
    data = {**data, "drivers": {name: {**one, "start": 0.003} for name, one in data["drivers"].items()}}
    result = analysed(data, 720)
    peak = float(np.max(np.abs(result.drive_power.values)))
    assert np.max(np.abs(result.power_residual.values)) < 1e-10 * peak
    taken, given = float(result.useful_power.mean()), float(result.drive_power.sum("driver").mean())
    assert float(result.efficiency) == pytest.approx(taken / given, abs=1e-13)
    assert float(result.efficiency) == pytest.approx(1.0, abs=1e-12)


PITCH, MEAN, LOAD = 0.010, 0.012, 5000.0
LEAD = np.arctan(PITCH / (2 * np.pi * MEAN))


@pytest.mark.parametrize("friction", [0.08, 0.2])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_screw_jack(friction, way):
    """Torque F r tan(λ ± φ) to raise and to lower; a thread with φ > λ has to be driven down."""
    axis = {"at": [0, 0, 0], "axis": [0, 0, 1]}
    thread = {"pitch": PITCH, "friction": friction, "pin": {"radius": MEAN, "bearing": 0.1}}
    data = {
        "space": "spatial",
        "links": {"ground": {"points": {"A": axis}}, "screw": {"points": {"A": axis, "top": [0, 0, 0.2]}}},
        "joints": joined("ground -A:helical- screw", A=thread),
        "drivers": {"A": {"speed": way, "range": [0.0, 9.0][:: int(way)]}},
        "loads": {"weight": {"link": "screw", "at": "top", "force": [0, 0, -LOAD], "useful": True}},
    }
    result = analysed(data, 5)
    phi = np.arctan(friction)
    np.testing.assert_allclose(result.drive_effort.values, LOAD * MEAN * np.tan(LEAD + way * phi), rtol=1e-12)
    np.testing.assert_allclose(
        result.joint_slide.values, result.joint_rotation.values * PITCH / (2 * np.pi), rtol=0, atol=1e-15
    )
    np.testing.assert_allclose(
        result.link_position.sel(link="screw", axis="z").values, result.joint_slide.values[0], rtol=0, atol=1e-14
    )
    if way > 0:
        assert float(result.efficiency) == pytest.approx(np.tan(LEAD) / np.tan(LEAD + phi), rel=1e-12)
    else:
        assert np.all(result.drive_effort.values > 0) == (phi < LEAD)
    held = np.tan(LEAD) / friction if phi > LEAD else np.nan  # by the load it raises or is lowered by
    found = trunnion.locking(trunnion.Mechanism(trunnion=1, **data), 5)
    np.testing.assert_allclose(found["holding_multiple"].values, held, rtol=1e-9)


@pytest.mark.parametrize("turned", [(), ("B",)])
def test_friction_that_drags_a_rod_round(turned):
    """Each ball drags the rod by f r |F| along the other link's turn against it; what is along the rod adds up.

    Whichever link of a ball is named first: here by the turns of the links themselves, over the same positions.
    """
    data = example("rssr").data()
    for joint in turned:
        data["joints"][joint]["links"] = data["joints"][joint]["links"][::-1]
    run = prepare(trunnion.Mechanism(**data))
    assert run.determinacy is not None
    back = run.solve(run.cycle.times(LOOKED))
    motions, radius, friction = back.walk.motions, 0.007, 0.1

    def vector(numbers):
        return np.array([np.broadcast_to(one, LOOKED) for one in numbers], float)

    ends = {joint: vector(back.walk.element("rod", joint).place) for joint in ("B", "C")}
    line = ends["C"] - ends["B"]
    line = line / np.linalg.norm(line, axis=0)
    dragged = np.zeros(LOOKED)
    for joint, other in (("B", "crank"), ("C", "rocker")):
        turn = vector(motions[other].twist.u) - vector(motions["rod"].twist.u)
        force = np.linalg.norm(vector(back.reactions[joint].u), axis=0)
        dragged += friction * radius * force * np.sum(turn * line, axis=0) / np.linalg.norm(turn, axis=0)
    assert run.determinacy.dragged["rod"] == pytest.approx(np.max(np.abs(dragged)), rel=1e-6)


DOOR, ARM_OF_WEIGHT = 20.0, 0.4
STILL = {"drivers": {"lower": {"speed": 1e-6, "range": [0.0, 1.5]}}}


def door(hinges, bearing, friction=0.1, **more):
    """A door of 20 kg on hinges at these heights, whose pins of 6 mm turn in bearings of the given length."""
    points = {name: {"at": [0, 0, height], "axis": [0, 0, 1]} for name, height in hinges.items()}
    leaf = {"mass": DOOR, "centre": [ARM_OF_WEIGHT, 0, 0.5], "inertia": {"xx": 2.4, "yy": 3.5, "zz": 1.1}}
    pin = {"pin": {"radius": 0.006, "bearing": bearing}, "friction": friction}
    data = {
        "space": "spatial",
        "over_constraint": "minimum-norm",
        "gravity": [0, 0, -9.81],
        "links": {"ground": {"points": points}, "leaf": {"points": points, **leaf}},
        "joints": {name: {"type": "revolute", "links": ["ground", "leaf"], **pin} for name in hinges},
        "drivers": {"lower": {"speed": 0.6, "range": [0.0, 1.5]}},
        "tolerances": {"joints.lower.pin.radius": "0.1 mm"},
        "measures": {"torque": {"effort": "lower", "as": "maximum"}},
    }
    return trunnion.Mechanism(trunnion=1, **{**data, **more})


@pytest.mark.parametrize(("apart", "bearing"), [(0.5, 0.2), (0.5, 0.02)])
def test_hinges_share_the_load_as_two_ends_of_a_bearing_each_do(apart, bearing):
    """A hinge gives way across by F/k and tilts by M/(k h²), h half its bearing: F a = C/(1 + 4 h²/a²)."""
    model = door({"lower": 0.0, "upper": apart}, bearing, **STILL)
    force = DOOR * 9.81 * ARM_OF_WEIGHT / apart / (1 + (bearing / apart) ** 2)
    assert trunnion.analyse(model, 4).drive_effort.values[0, 0] == pytest.approx(0.1 * 0.006 * 2 * force, rel=1e-9)
    (finding,) = (one for one in trunnion.check(model, 4).findings if one.code == "mobility.friction_open")
    assert finding.severity == "warning"
    share = (bearing / apart) ** 2
    assert finding.figures["change"] == pytest.approx(1 - (1 + share) / (1 + 1.125 * share), rel=1e-3)


@pytest.mark.slow
def test_hinges_of_stated_stiffness_are_a_rigid_beam_on_springs():
    """Three hinges: deflections δ and rotation φ from the balance of forces and moments, F = k (δ + z φ), M = κ φ."""
    heights, radial = np.array([0.1, 0.7, 1.6]), np.array([3e6, 1e6, 8e6])
    tilting = np.array([2e3, 9e5, 4e4])
    names = ("lower", "middle", "upper")
    model = door(dict(zip(names, heights.tolist(), strict=True)), 0.05, **STILL).data()
    for name, k, t in zip(names, radial, tilting, strict=True):
        model["joints"][name]["stiffness"] = {"radial": float(k), "tilting": float(t), "axial": 2e6}
    result = trunnion.analyse(trunnion.Mechanism(**model), 4)
    stiff = np.array([[radial.sum(), radial @ heights], [radial @ heights, radial @ heights**2 + tilting.sum()]])
    shift, turn = np.linalg.solve(stiff, [0.0, DOOR * 9.81 * ARM_OF_WEIGHT])
    forces, moments = radial * (shift + heights * turn), tilting * turn
    for name, force, moment in zip(names, forces, moments, strict=True):
        across = result.reaction_force.sel(joint=name).values[:2, 0]
        assert np.linalg.norm(across) == pytest.approx(abs(force), rel=1e-9)
        assert np.linalg.norm(result.reaction_moment.sel(joint=name).values[:2, 0]) == pytest.approx(moment, rel=1e-9)
    ends = [abs(f / 2 + m / 0.05) + abs(f / 2 - m / 0.05) for f, m in zip(forces, moments, strict=True)]
    assert result.drive_effort.values[0, 0] == pytest.approx(0.1 * 0.006 * sum(ends), rel=1e-9)
    del model["joints"]["middle"]["stiffness"]
    with pytest.raises(trunnion.MechanismError, match="the stiffness of middle is not stated"):
        trunnion.analyse(trunnion.Mechanism(**model), 4)


def test_one_bearing_with_two_ends_has_the_friction_of_a_door():
    """The weight turns the leaf over: each end carries W a/L whatever the bearing is made of."""
    result = brief(door({"lower": 0.5}, bearing=1.0), 4)
    torque = 0.1 * 0.006 * 2 * DOOR * 9.81 * ARM_OF_WEIGHT / 1.0
    np.testing.assert_allclose(result.drive_effort.values, torque, rtol=1e-12)
    free = brief(door({"lower": 0.0, "upper": 1.0}, bearing=0.02, friction=0.0), 4)
    np.testing.assert_allclose(free.drive_effort.values, 0.0, rtol=0, atol=1e-12)


NAMES = [
    name
    for name, data in MODELS.items()
    if "gears" not in data() and "springs" not in data() and len(data()["links"]) <= 6
]
STEPS = 16


@pytest.mark.slow
@pytest.mark.parametrize("friction", [None, 0.12])
@pytest.mark.parametrize("name", NAMES)
def test_planar_mechanism_in_space(name, friction):
    """Motion to 1e-10, forces to 1e-8 of the largest; nothing across the plane, where friction is refused for that."""
    data = raised(model(MODELS[name](), friction=friction)) | {"over_constraint": "minimum-norm"}
    data["joint_defaults"] |= {"pin": {**data["joint_defaults"]["pin"], "bearing": 0.05}}
    flat = brief(build(MODELS[name](), friction=friction), STEPS)
    space = brief(trunnion.Mechanism(trunnion=1, **data), STEPS, refuse=False)
    np.testing.assert_array_equal(flat.status.values, space.status.values)
    points = [p for p in flat.point.values if p in space.point.values]
    for what, limit in (("position", 1e-10), ("velocity", 1e-9), ("acceleration", 1e-8)):
        one, two = (result[f"point_{what}"].sel(point=points).values for result in (flat, space))
        scale = max(1.0, float(np.nanmax(np.abs(one))))
        np.testing.assert_allclose(two[:, :2], one, rtol=0, atol=limit * scale, err_msg=what)
        np.testing.assert_allclose(two[:, 2], 0, rtol=0, atol=limit * scale, err_msg=what)
    scale = float(np.nanmax(np.abs(flat.reaction_force.values)))
    force = space.reaction_force.sel(joint=flat.joint.values).values
    np.testing.assert_allclose(force[:, :2], flat.reaction_force.values, rtol=0, atol=1e-8 * scale)
    np.testing.assert_allclose(force[:, 2], 0, rtol=0, atol=1e-8 * scale)
    moment = space.reaction_moment.sel(joint=flat.joint.values).values
    np.testing.assert_allclose(moment[:, 2], flat.reaction_moment.values, rtol=0, atol=1e-8 * scale)
    np.testing.assert_allclose(moment[:, :2], 0, rtol=0, atol=1e-8 * scale)
    for what in ("friction_torque", "friction_force", "drive_effort", "friction_power"):
        one, two = flat[what].values, space[what].values
        np.testing.assert_allclose(two, one, rtol=0, atol=1e-8 * scale, err_msg=what)
    if friction:
        assert np.nanmax(np.abs(flat.friction_power.values)) > 1e-3


def coupled_wheels(stiffness):
    """Three equal cranks on one coupling rod: mobility 0 by the count, 1 by rank."""
    feet = {"A": (0.0, 0.0), "B": (1.2, 0.0), "C": (1.7, 0.9)}
    pins = dict(zip(feet, "DEF", strict=True))
    links = {"ground": {"points": {name: list(place) for name, place in feet.items()}}}
    for name, pin in pins.items():
        links[f"wheel-{name}"] = {"points": {name: [0, 0], pin: [0.3, 0]}, "mass": 20.0, "inertia": 0.5}
    rod = {pin: list(feet[name]) for name, pin in pins.items()}
    links["rod"] = {"points": rod, "mass": 30.0, "inertia": 8.0, "centre": [1.0, 0.1]}
    return {
        "over_constraint": "minimum-norm",
        "gravity": [0, -9.81],
        "links": links,
        "joints": joined("ground -A- wheel-A -D- rod, ground -B- wheel-B -E- rod, ground -C- wheel-C -F- rod",
                         **{name: {"stiffness": {"radial": radial}} for name, radial in stiffness.items()}),
        "drivers": {"A": {"speed": 10.0, "range": [0.4, 2.6]}},
        "loads": {"pull": {"joint": "C", "resisting_torque": 100.0, "useful": True}},
    }  # fmt: skip


def test_three_wheels_share_their_load_by_stiffness():
    """Without friction: forces of the one self-stress shift the energy nowhere, Σ F · S / k = 0."""
    stiffness = dict(zip("ABCDEF", (2e7, 5e6, 8e6, 3e7, 1e6, 4e6), strict=True))
    result = trunnion.analyse(trunnion.Mechanism(trunnion=1, **coupled_wheels(stiffness)), STEPS)
    place = {name: result.point_position.sel(point=name).values for name in result.point.values}
    for step in range(STEPS):
        pins = np.array([place[f"rod.{name}"][:, step] for name in "DEF"])
        crank = place["wheel-A.D"][:, step] - place["wheel-A.A"][:, step]
        unit = crank / np.linalg.norm(crank)  # a massless crank passes on what is along it; the driven one anything
        # forces of the cranks on the rod that balance: a along unit at E and F, any at D
        moments = [-pins[0][1], pins[0][0], *(x * unit[1] - y * unit[0] for x, y in pins[1:])]
        matrix = np.array([[1.0, 0.0, unit[0], unit[0]], [0.0, 1.0, unit[1], unit[1]], moments])
        null = np.linalg.svd(matrix)[2][-1]
        own = np.array([null[:2], null[2] * unit, null[3] * unit])
        forces = np.array([result.reaction_force.sel(joint=name).values[:, step] for name in "ABCDEF"])
        stresses = np.vstack([own, own])
        energy = [forces[i] @ stresses[i] / stiffness[name] for i, name in enumerate("ABCDEF")]
        assert abs(sum(energy)) < 1e-9 * max(abs(part) for part in energy)
