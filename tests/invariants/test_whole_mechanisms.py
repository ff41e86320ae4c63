"""What must hold for any mechanism: balance of power, change of frame, mirror, units, order of links, batches."""

from __future__ import annotations

import copy
import functools
from typing import Any

import numpy as np
import pytest

from brief import brief
from mechanisms import MODELS, Data, build, law_named, model, reverse_links, transformed
from trunnion import FrictionMethod, Mechanism, Status
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.solve.run import prepare

STEPS = 24
VECTORS = ["point_position", "point_velocity", "point_acceleration", "reaction_force"]
EVEN = ["drive_power", "friction_power", "useful_power", "joint_slide_velocity", "joint_slide", "condition"]
ODD = ["link_angle_velocity", "link_angle_acceleration", "joint_rotation_velocity", "friction_torque"]


def same(a: Any, b: Any, name: str, tolerance: float = 1e-10) -> None:
    """Equal within a share of the largest value, NaN in the same places."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    scale = float(np.nanmax(np.abs(b), initial=0.0)) or 1.0
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance * scale, err_msg=name)


@functools.cache
def unchanged(name: str) -> Any:
    """The result that those of the changed models are compared with, made once."""
    return brief(Mechanism(**model(MODELS[name]())), STEPS)


@pytest.mark.spread(10)
@pytest.mark.parametrize("friction", [None, 0.2])
@pytest.mark.parametrize("name", MODELS)
def test_power_balance(name: str, friction: float | None) -> None:
    """drive + loads + inertia − friction = 0 to 1e-12 of the peak drive power, and friction never gives power."""
    result = brief(build(MODELS[name](), friction=friction), 90)
    peak = float(np.abs(result["drive_power"]).max())
    assert np.all(result["status"] <= Status.ZERO_SLIP)
    assert np.abs(result["power_residual"]).max() < 1e-12 * peak
    assert np.all(result["friction_power"] >= -1e-15 * peak)
    assert np.abs(result["closure_residual"]).max() < 1e-13
    if friction:
        assert float(result["friction_power"].sum("joint").mean()) > 1e-5 * peak


@pytest.mark.parametrize("name", MODELS)
def test_velocities_and_accelerations_are_derivatives(name: str) -> None:
    """Eighth-order differences of positions and of velocities along the cycle."""
    run = prepare(build(MODELS[name]()))
    time = (np.arange(11) + 0.41) / 11 * run.cycle.duration
    h = 2e-3 * run.cycle.duration
    weights = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280]) / h
    walks = [run.solve(time + k * h).walk for k in range(-4, 5)]
    for link, point in run.system.points:
        motions = [walk.point(link, point) for walk in walks]
        for axis in (0, 1):
            for of, rate in (("place", "velocity"), ("velocity", "acceleration")):
                samples = [np.broadcast_to(getattr(m, of)[axis], time.shape) for m in motions]
                expected = np.tensordot(weights, np.array(samples), axes=1)
                found = np.broadcast_to(getattr(motions[4], rate)[axis], time.shape)
                np.testing.assert_allclose(found, expected, rtol=0, atol=2e-8 * max(1.0, np.abs(expected).max()))
    for link in run.system.mechanism.links:
        speeds = np.array([np.broadcast_to(walk.motions[link].twist.w, time.shape) for walk in walks])
        found = np.broadcast_to(walks[4].motions[link].acceleration.w, time.shape)
        expected = np.tensordot(weights, speeds, axes=1)
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-8 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("name", MODELS)
def test_joints_stay_closed(name: str) -> None:
    """The two points of a pin coincide; those of a slide lie on its axis, which both links hold in line."""
    run = prepare(build(MODELS[name]()))
    walk = run.solve(run.cycle.times(STEPS)).walk
    for joint, (kind, (first, second)) in run.system.joints.items():
        one, two = walk.element(first, joint), walk.element(second, joint)
        dx, dy = two.x - one.x, two.y - one.y
        if kind == "revolute":
            np.testing.assert_allclose(np.hypot(dx, dy), 0, atol=1e-13)
        else:
            np.testing.assert_allclose(one.c * dy - one.s * dx, 0, atol=1e-13)
            np.testing.assert_allclose(one.c * two.c + one.s * two.s, 1, atol=1e-13)


@pytest.mark.sample(9)
@pytest.mark.spread(4)
@pytest.mark.parametrize("shift", [(0.0, 0.0), (30.0, -20.0), (1e4, -2e4)])
@pytest.mark.parametrize("name", MODELS)
def test_change_of_frame(name: str, shift: tuple[float, float]) -> None:
    """A turned and shifted drawing is the same machine; 1e4 m away four digits fewer are left of the position."""
    turn = 0.83
    data = model(MODELS[name]())
    plain, other = unchanged(name), brief(Mechanism(**transformed(data, turn, shift)), STEPS)
    tolerance = 1e-10 * max(1.0, np.hypot(*shift))
    c, s = np.cos(turn), np.sin(turn)
    np.testing.assert_array_equal(other["status"], plain["status"])
    for variable in VECTORS:
        x, y = plain[variable].sel(axis="x").values, plain[variable].sel(axis="y").values
        at = np.array(shift) if variable == "point_position" else np.zeros(2)
        turned = np.stack([c * x - s * y + at[0], s * x + c * y + at[1]], axis=1)
        same(other[variable].values - at[:, None], turned - at[:, None], variable, tolerance)
    for variable in ("drive_effort", "reaction_moment", *EVEN, *ODD):
        same(other[variable], plain[variable], variable, tolerance)


@pytest.mark.spread(5)
@pytest.mark.parametrize("name", MODELS)
def test_mirror(name: str) -> None:
    """Mirrored in x: y components, angles and moments change sign, powers do not."""
    data = model(MODELS[name]())
    plain, other = unchanged(name), brief(Mechanism(**transformed(data, mirror=True)), STEPS)
    np.testing.assert_array_equal(other["status"], plain["status"])
    flip = np.array([1.0, -1.0])[:, None]
    for variable in VECTORS:
        same(other[variable].values, plain[variable].values * flip, variable)
    for variable in EVEN:
        same(other[variable], plain[variable], variable)
    for variable in (*ODD, "reaction_moment"):
        same(other[variable], -plain[variable], variable)
    for driver in plain["driver"].values:
        sign = 1.0 if data["joints"][str(driver)]["type"] == "prismatic" else -1.0
        effort = "drive_effort"
        same(other[effort].sel(driver=driver), sign * plain[effort].sel(driver=driver), effort)


def _times(v: Any, unit: float) -> list[float]:
    return [unit * float(n) for n in v]


def scaled(data: Data, length: float, mass: float, time: float) -> Data:
    """The same mechanism told in other units: a metre is `length`, a kilogram `mass`, a second `time` of them."""
    data = copy.deepcopy(data)
    force, moment = mass * length / time**2, mass * length**2 / time**2

    for link in data["links"].values():
        for key, at in link["points"].items():
            link["points"][key] = {**at, "at": _times(at["at"], length)} if isinstance(at, dict) else _times(at, length)
        if "mass" in link:
            link["mass"] *= mass
            link["inertia"] *= mass * length**2
            link["centre"] = _times(link["centre"], length)
    data["gravity"] = _times(data["gravity"], length / time**2)
    for load in data["loads"].values():
        if "force" in load:
            load["force"] = _times(load["force"], force)
        if "moment" in load:
            load["moment"] *= moment
    for name, driver in data["drivers"].items():
        unit = length if data["joints"][name]["type"] == "prismatic" else 1.0
        driver["speed"] *= unit / time
        if "range" in driver:
            driver["range"] = _times(driver["range"], unit)
    data["assembly"] = {key: _times(value, length) for key, value in data.get("assembly", {}).items()}
    for gear in data.get("gears", {}).values():
        for key in {"radius", "lead", "phase"} & gear.keys() if "ratio" not in gear else ():
            gear[key] *= length
    data["joint_defaults"]["pin"]["radius"] *= length
    if "guide" in data["joint_defaults"]:
        data["joint_defaults"]["guide"]["length"] *= length
    return data


@pytest.mark.sample(9)
@pytest.mark.spread(6)
@pytest.mark.parametrize(("length", "mass", "time"), [(1e-6, 1e-12, 1e-3), (1e6, 1e9, 1e2), (3.0, 1.0, 1.0)])
@pytest.mark.parametrize("name", MODELS)
def test_scale(name: str, length: float, mass: float, time: float) -> None:
    """Micrometres and megametres: numbers change by their units and by nothing else."""
    data = model(MODELS[name]())
    plain = unchanged(name)
    other = brief(Mechanism(**scaled(data, length, mass, time)), STEPS)
    np.testing.assert_array_equal(other["status"], plain["status"])
    force, power = mass * length / time**2, mass * length**2 / time**3
    for variable, unit in (
        ("point_position", length),
        ("point_velocity", length / time),
        ("point_acceleration", length / time**2),
        ("link_angle", 1.0),
        ("link_angle_velocity", 1 / time),
        ("reaction_force", force),
        ("reaction_moment", force * length),
        ("friction_torque", force * length),
        ("friction_force", force),
        ("drive_power", power),
        ("friction_power", power),
        ("useful_power", power),
        ("joint_slide", length),
    ):
        same(other[variable], plain[variable] * unit, variable)


@pytest.mark.spread(6)
@pytest.mark.parametrize("name", MODELS)
def test_order_of_links_in_pins(name: str) -> None:
    """A pin listed the other way round: the same machine, what is stated of the pin with the other sign.

    Guides keep their order here: the middle of their contact is at the second link's point.
    """
    data = model(MODELS[name]())
    other = copy.deepcopy(data)
    flipped = [
        name for name, joint in data["joints"].items() if joint["type"] == "revolute" and name not in data["drivers"]
    ]
    reverse_links(other, flipped)
    plain, turned = unchanged(name), brief(Mechanism(**other), STEPS)
    np.testing.assert_array_equal(turned["status"], plain["status"])
    for variable in ("point_position", "point_acceleration", "drive_effort", "drive_power", "friction_power"):
        same(turned[variable], plain[variable], variable)
    sign = np.array([-1.0 if joint in flipped else 1.0 for joint in plain["joint"].values])
    for variable in ("friction_torque", "joint_rotation_velocity", "reaction_force"):
        same(turned[variable], plain[variable].values * sign.reshape(-1, *[1] * (plain[variable].ndim - 1)), variable)


@pytest.mark.spread(15)
@pytest.mark.parametrize("name", MODELS)
def test_order_of_links_in_ideal_joints(name: str) -> None:
    """Without friction every joint may be turned round, guides too; their moments refer to the other point."""
    data = model(MODELS[name](), friction=None)
    other = copy.deepcopy(data)
    flipped = [joint for joint in data["joints"] if joint not in data["drivers"]]
    reverse_links(other, flipped)
    plain, turned = (brief(Mechanism(**d), STEPS) for d in (data, other))
    sign = np.array([-1.0 if joint in flipped else 1.0 for joint in plain["joint"].values])
    same(turned["reaction_force"], plain["reaction_force"].values * sign[:, None, None], "reaction_force")
    same(turned["drive_effort"], plain["drive_effort"], "drive_effort")
    same(turned["joint_slide_velocity"], plain["joint_slide_velocity"] * sign[:, None], "slide")
    for joint in flipped:
        if data["joints"][joint]["type"] != "prismatic":
            continue
        first, second = data["joints"][joint]["links"]
        place = {link: plain["point_position"].sel(point=f"{link}.{joint}").values for link in (first, second)}
        arm = place[second] - place[first]
        force = plain["reaction_force"].sel(joint=joint).values
        moment = plain["reaction_moment"].sel(joint=joint).values + arm[0] * force[1] - arm[1] * force[0]
        same(turned["reaction_moment"].sel(joint=joint), -moment, "reaction_moment")


@pytest.mark.spread(6)
@pytest.mark.parametrize("name", MODELS)
def test_order_of_the_file_does_not_matter(name: str) -> None:
    data = model(MODELS[name]())
    other = copy.deepcopy(data)
    for section in ("links", "joints", "loads"):
        other[section] = dict(reversed(other[section].items()))
    plain, turned = unchanged(name), brief(Mechanism(**other), STEPS)
    turned = turned.sel(joint=plain["joint"], link=plain["link"], point=plain["point"])
    for variable in ("point_position", "reaction_force", "drive_effort", "friction_power"):
        same(turned[variable], plain[variable], variable, 1e-9)


@pytest.mark.parametrize("name", MODELS)
def test_reversed_drive_without_friction(name: str) -> None:
    """Driven backwards over the same path: the same positions and forces, the other way in time."""
    data = MODELS[name]()
    other = copy.deepcopy(data)
    for driver in other["drivers"].values():
        driver["speed"] *= -1
        if "range" in driver:
            driver["range"].reverse()
    plain, back = (brief(Mechanism(**model(d, friction=None)), 24) for d in (data, other))
    order = np.arange(24)[::-1] if any("range" in d for d in data["drivers"].values()) else -np.arange(24) % 24
    for variable in ("point_position", "point_acceleration", "reaction_force", "drive_effort"):
        same(back[variable].values[..., order], plain[variable].values, variable)


def test_driving_forward_and_backward_brackets_the_ideal_effort() -> None:
    """With friction the effort is above the ideal one in the sense of motion, below it in the other."""
    data = MODELS["four-bar"]()
    other = copy.deepcopy(data)
    other["drivers"]["A"]["speed"] *= -1
    efforts = [
        brief(build(d, friction=f), 24)["drive_effort"].values[0] for d, f in ((data, None), (data, 0.2), (other, 0.2))
    ]
    ideal, forward, backward = efforts[0], efforts[1], efforts[2][-np.arange(24) % 24]
    assert np.all(forward > ideal)
    assert np.all(backward < ideal)


@pytest.mark.parametrize("name", ["four-bar", "slider-crank", "class III", "excavator"])
def test_samples_are_independent(name: str) -> None:
    """A batch (sample, position) equals its samples one by one."""
    run = prepare(build(MODELS[name]()))
    time = run.cycle.times(9) + 0.01
    rng = np.random.default_rng(3)
    paths = [path for path in run.values if ".points." in path and not path.endswith((".axis.x", ".axis.y"))]
    batch = {path: run.values[path] + rng.normal(0, 1e-3, (5, 1)) for path in paths}
    both = run.solve(time, run.system.mechanism.parameters(batch))
    for i in range(5):
        one = run.solve(time, run.system.mechanism.parameters({path: float(v[i, 0]) for path, v in batch.items()}))
        for joint, reaction in one.reactions.items():
            for part in ("x", "y", "m"):
                expected = np.broadcast_to(getattr(reaction, part), time.shape)
                found = np.broadcast_to(getattr(both.reactions[joint], part), (5, 9))[i]
                np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * max(1, np.abs(expected).max()))


@pytest.mark.spread(2)
@pytest.mark.parametrize("law", [law for law in FRICTION_LAWS if law != "rolling"])  # which is of pins alone
@pytest.mark.parametrize("name", ["four-bar", "slider-crank", "class III"])
def test_every_law_in_a_mechanism(name: str, law: str) -> None:
    """Friction is what the law says of load and slip, it only takes power, and both methods find it."""
    friction, radius = law_named(law), 0.02
    parameters = {key: value for key, value in friction.items() if key != "law"}
    result = brief(build(MODELS[name](), friction=friction, radius=radius), 40)
    peak = float(np.abs(result["drive_power"]).max())
    assert np.all(result["status"] <= Status.ZERO_SLIP)
    assert np.abs(result["power_residual"]).max() < 1e-12 * peak
    bristles = FRICTION_LAWS[law].relaxation is not None  # they give back a little of what they took
    lost = result["friction_power"].mean("position") if bristles else result["friction_power"]
    assert np.all(lost >= -1e-15 * peak)
    slipping = (result["status"] == Status.SOLVED).values
    for joint in () if bristles else ("A", "B"):
        load = np.hypot(*result["reaction_force"].sel(joint=joint).values)
        slip = radius * result["joint_rotation_velocity"].sel(joint=joint).values
        expected = radius * FRICTION_LAWS[law].function(load, slip, **parameters)
        found = result["friction_torque"].sel(joint=joint).values
        np.testing.assert_allclose(found[slipping], expected[slipping], rtol=0, atol=1e-8 * np.abs(expected).max())
    method = FrictionMethod("successive-approximation", 1e-11)
    named = brief(build(MODELS[name](), friction=friction, radius=radius), 40, method)
    same(named["drive_effort"], result["drive_effort"], "drive_effort", 1e-9)
