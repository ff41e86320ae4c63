"""What must hold for any mechanism: balance of power, change of frame, mirror, units, order of links, batches."""

import functools

import numpy as np
import pytest

from brief import brief
from mechanisms import MODELS, build, in_units, law_named, model, transformed
from trunnion import FrictionMethod, Mechanism, Status
from trunnion.joints.friction import FRICTION_LAWS

STEPS = 24
VECTORS = ["point_position", "point_velocity", "point_acceleration", "reaction_force"]
EVEN = ["drive_power", "friction_power", "useful_power", "joint_slide_velocity", "joint_slide", "condition"]
SHIFTS = {"turned": (0.0, 0.0), "turned and far": (1e4, -2e4)}
UNITS = {"micrometres": (1e-6, 1e-12, 1e-3), "megametres": (1e6, 1e9, 1e2), "other units": (3.0, 1.0, 1.0)}
ODD = ["link_angle_velocity", "link_angle_acceleration", "joint_rotation_velocity", "friction_torque"]


def same(a, b, name, tolerance=1e-10):
    """Equal within a share of the largest value, NaN in the same places."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    scale = float(np.nanmax(np.abs(b), initial=0.0)) or 1.0
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance * scale, err_msg=name)


@functools.cache
def unchanged(name):
    """The result that those of the changed models are compared with, made once."""
    return brief(Mechanism(**model(MODELS[name]())), STEPS)


def as_seen(data, kind):
    """The same machine told otherwise, and by what its numbers are multiplied: vectors by a matrix."""
    units = dict.fromkeys((*EVEN, *ODD, "reaction_moment"), 1.0)
    if kind in SHIFTS:
        c, s = np.cos(0.83), np.sin(0.83)
        vectors = dict.fromkeys(VECTORS, np.array([[c, -s], [s, c]]))
        return transformed(data, 0.83, SHIFTS[kind]), units | vectors
    if kind == "mirrored":
        odd = dict.fromkeys((*ODD, "reaction_moment"), -1.0)
        return transformed(data, mirror=True), units | odd | dict.fromkeys(VECTORS, np.diag([1.0, -1.0]))
    length, mass, time = UNITS[kind]
    force, power, rate = mass * length / time**2, mass * length**2 / time**3, 1 / time
    sizes = (length, length * rate, length * rate**2, force)
    units |= {name: size * np.eye(2) for name, size in zip(VECTORS, sizes, strict=True)}
    units |= dict.fromkeys(("drive_power", "friction_power", "useful_power"), power) | {"joint_slide": length}
    units |= {"joint_slide_velocity": length * rate, "friction_torque": force * length, "friction_force": force}
    units |= {"link_angle_velocity": rate, "link_angle_acceleration": rate**2, "joint_rotation_velocity": rate}
    return in_units(data, length, mass, time), units | {"reaction_moment": force * length, "link_angle": 1.0}


@pytest.mark.spread(6)
@pytest.mark.sample(12)
@pytest.mark.parametrize("kind", [*SHIFTS, "mirrored", *UNITS])
@pytest.mark.parametrize("name", MODELS)
def test_a_machine_told_otherwise_is_the_same(name, kind):
    """1e4 m away four digits fewer are left of the position; micrometres change numbers by their units alone."""
    data = model(MODELS[name]())
    told, units = as_seen(data, kind)
    far = SHIFTS.get(kind, (0.0, 0.0))
    plain, other = unchanged(name), brief(Mechanism(**told), STEPS)
    np.testing.assert_array_equal(other["status"], plain["status"])
    for variable, unit in units.items():
        if variable == "condition" and kind in UNITS:
            continue  # of equations in other units
        expected, found = plain[variable].values, other[variable].values
        if variable in VECTORS:
            expected = np.einsum("ij,kj...->ki...", unit, expected)
            found = found - np.reshape(far if variable == "point_position" else (0.0, 0.0), (2, 1))
        else:
            expected = unit * expected
        same(found, expected, variable, 1e-10 * max(1.0, np.hypot(*far)))
    for driver in plain["driver"].values if kind == "mirrored" else ():
        sign = 1.0 if data["joints"][str(driver)]["type"] == "prismatic" else -1.0
        same(other["drive_effort"].sel(driver=driver), sign * plain["drive_effort"].sel(driver=driver), "drive_effort")


@pytest.mark.spread(2)
@pytest.mark.parametrize("law", [law for law in FRICTION_LAWS if law != "rolling"])  # which is of pins alone
@pytest.mark.parametrize("name", ["four-bar", "slider-crank", "class III"])
def test_every_law_in_a_mechanism(name, law):
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
