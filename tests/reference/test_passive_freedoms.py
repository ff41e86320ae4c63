"""Struts between balls, pads under balls: their spins move nothing else, and statics says what they carry."""

import numpy as np
import pytest
from scipy.optimize import brentq

from brief import brief, judged
from mechanisms_parts import joined
from trunnion import Mechanism, MechanismError, analyse

UPPER, LOWER = [0.1, 0.3, 0.8], [0.5, 0.05, 0.1]


def arm():
    """An arm on a hinge, held by a spring between the same points as a strut would be."""
    hinge = {"at": [0, 0, 0], "axis": [0, 1, 0]}
    return Mechanism(
        space="spatial",
        links={
            "ground": {"points": {"H": hinge, "U": UPPER}},
            "arm": {"points": {"H": hinge, "L": LOWER, "W": [0.6, 0, 0.05]}},
        },
        joints=joined("ground -H- arm"),
        drivers={"H": {"speed": 1.0, "range": [-0.3, 0.4]}},
        gravity=[0, 0, -9.81],
        loads={"w": {"link": "arm", "at": "W", "force": [10, 20, -300]}},
        springs={"s": {"between": ["ground.U", "arm.L"], "stiffness": 2e3, "free_length": 0.9}},
    )


def codes(result):
    return [one.code for one in result.trunnion.findings]


def leg(kind, seed, driver=None):
    """The arm with a leg whose inner joint stands anywhere between its balls; driven, it is a jack."""
    rng = np.random.default_rng(seed)
    data = arm().data()
    lower, upper = {"revolute": (0.5, 0.6), "prismatic": (0.2, 0.15)}[kind]
    off = rng.uniform(-0.04, 0.04, (4, 3))
    axes = np.array([0.0, 0.0, 1.0]) + rng.uniform(-0.4, 0.4, (2, 3)) if kind == "revolute" else [[1.0, 0, 0]] * 2
    points = [off[0], off[1] + [lower, 0, 0], off[2], off[3] + [upper, 0, 0]]
    for link, first, second, axis in (("tube", "U", "T", axes[0]), ("rod", "T", "L", axes[1])):
        places = {first: points[0 if link == "tube" else 2], second: points[1 if link == "tube" else 3]}
        data["links"][link] = {"points": {name: place.tolist() for name, place in places.items()}}
        data["links"][link]["points"]["T"] = {"at": places["T"].tolist(), "axis": list(map(float, axis))}
    data["joints"] |= joined(f"ground -U:spherical- tube -T:{kind}- rod, arm -L:spherical- rod")
    if driver:
        data["drivers"], data["springs"] = {"T": driver}, {}
    return Mechanism(**data)


JACKS = {
    "revolute": {"speed": 0.3, "range": [1.8, 2.0]}, "prismatic": {"speed": 0.1, "range": [0.3, 0.4]},
}  # fmt: skip


@pytest.mark.parametrize("kind", JACKS)
def test_an_idle_leg_changes_nothing(kind):
    bare = brief(arm(), 9)
    result = analyse(leg(kind, 1), 9)
    assert codes(result).count("mobility.spin") == 1
    np.testing.assert_allclose(result["drive_effort"], bare["drive_effort"], rtol=1e-12)
    np.testing.assert_allclose(result["reaction_force"].sel(joint=["U", "T", "L"]), 0.0, atol=1e-9)


@pytest.mark.parametrize("kind", JACKS)
def test_a_driven_leg_is_a_force_between_its_balls(kind):
    """Whatever its shape: F along the line holds the arm, by virtual work effort · q̇ = F · l̇."""
    for seed in range(2):
        result = brief(leg(kind, seed, JACKS[kind]), 9)
        lower, wheel = (result["point_position"].sel(point=point).values for point in ("arm.L", "arm.W"))
        along = (lower - np.array(UPPER)[:, None]) / np.linalg.norm(lower - np.array(UPPER)[:, None], axis=0)
        axis = np.array([0.0, 1.0, 0.0])
        force = -(axis @ np.cross(wheel, [10.0, 20.0, -300.0], axis=0)) / (axis @ np.cross(lower, along, axis=0))
        carried = result["reaction_force"].sel(joint="L").values  # on the rod
        np.testing.assert_allclose(carried, -force * along, rtol=1e-9, atol=1e-9 * np.max(np.abs(force)))
        rate = np.sum(along * result["point_velocity"].sel(point="arm.L").values, axis=0)
        power = result["drive_effort"].values[0] * JACKS[kind]["speed"]
        np.testing.assert_allclose(power, force * rate, rtol=1e-9)


@pytest.mark.parametrize("kind", JACKS)
def test_a_leg_of_any_shape_does_not_spin(kind):
    """Its first link has no part of ω along the line; velocities and accelerations are those of its poses."""
    result = brief(leg(kind, 1, JACKS[kind]), 401)
    step = float(np.diff(result["time"].values[:2])[0])
    line = result["point_position"].sel(point="arm.L").values - np.array(UPPER)[:, None]
    spun = np.sum(result["link_angular_velocity"].sel(link="tube").values * line, axis=0)
    np.testing.assert_allclose(spun, 0.0, atol=1e-12)
    for link in ("tube", "rod"):
        omega = result["link_angular_velocity"].sel(link=link).values
        change = (omega[:, 2:] - omega[:, :-2]) / (2 * step)
        stated = result["link_angular_acceleration"].sel(link=link).values[:, 1:-1]
        np.testing.assert_allclose(stated, change, atol=1e-5)
    place, speed = (result[f"point_{what}"].sel(point="tube.T").values for what in ("position", "velocity"))
    np.testing.assert_allclose((place[:, 2:] - place[:, :-2]) / (2 * step), speed[:, 1:-1], atol=1e-5)


def test_a_mass_beside_the_line_of_a_leg_is_refused():
    data = leg("revolute", 0).data()
    data["links"]["rod"] |= {"mass": 1.0, "centre": [0.3, 0, 0]}
    with pytest.raises(MechanismError, match=r"the links tube, rod together may spin about U-L.*U a universal joint"):
        analyse(Mechanism(**data), 5)


PLACES = {  # m, as drawn
    "A": [0.0, 0.35, 0.20], "B": [0.0, 0.42, 0.45], "E": [0.0, 0.78, 0.18], "F": [-0.02, 0.72, 0.47],
    "M": [0.12, 0.38, 0.24], "N": [0.13, 0.75, 0.23], "U": [0.02, 0.48, 0.62], "L": [0.01, 0.62, 0.20],
    "W": [0.0, 0.85, 0.0],
}  # fmt: skip
AXES = {"A": [1.0, 0.02, 0.01], "B": [1.0, -0.03, 0.04]}
FORCE = [400.0, 900.0, 4200.0]


def wishbone():
    """Two arms, an upright with a tie rod, and a strut from the chassis to the lower arm, driven along its slide."""
    up, low = np.array(PLACES["U"]), np.array(PLACES["L"])
    length = float(np.linalg.norm(low - up))
    links = {
        "ground": ["A", "B", "M", "U"], "lower": ["A", "E", "L"], "upper": ["B", "F"], "upright": ["E", "F", "N", "W"],
        "tie": ["M", "N"],
    }  # fmt: skip
    drawn = {
        link: {"points": {p: {"at": PLACES[p], **({"axis": AXES[p]} if p in AXES else {})} for p in points}}
        for link, points in links.items()
    }
    drawn["tube"] = {"points": {"U": [0, 0, 0], "T": {"at": [0, 0, 0], "axis": [1, 0, 0]}}}
    drawn["rod"] = {"points": {"T": {"at": [0, 0, 0], "axis": [1, 0, 0]}, "L": [0, 0, 0]}}
    joints = joined(
        "lower -E:spherical- upright, upper -F:spherical- upright, ground -M:spherical- tie -N:spherical- upright, "
        "ground -U:spherical- tube =T= rod -L:spherical- lower, ground -A- lower, ground -B- upper"
    )
    return Mechanism(
        space="spatial", links=drawn, joints=joints,
        drivers={"T": {"speed": 0.01, "range": [length - 0.02, length + 0.02]}},
        loads={"road": {"link": "upright", "at": "W", "force": FORCE}},
        assembly={"E": PLACES["E"], "F": PLACES["F"], "N": PLACES["N"], "L": PLACES["L"]},
    )  # fmt: skip


@pytest.mark.slow
def test_a_double_wishbone_with_a_strut():
    """Every link is in equilibrium; two spins, of the strut and the tie rod, need nothing."""
    result = analyse(wishbone(), 9)
    assert codes(result).count("mobility.spin") == 2
    judged(wishbone().data(), result)
    assert np.ptp(result["drive_effort"].values) > 10.0


def test_a_pad_on_a_plane_under_a_ball():
    """The ball of a lever in a pad that slides on the face of a crank: where it is follows from the plane alone."""
    length, face, hinge = 0.5, 0.1, {"at": [0, 0, 0], "axis": [1, 0, 0]}
    lever = {"V": {"at": [0, 0, 0], "axis": [0, 1, 0]}, "Q": [length, 0, 0]}
    mechanism = Mechanism(
        space="spatial",
        links={
            "ground": {"points": {"C": hinge, "V": {"at": [-0.4, 0.15, 0.3], "axis": [0, 1, 0]}}},
            "crank": {"points": {"C": hinge, "P": {"at": [0, 0, face], "axis": [0, 0, 1]}}},
            "pad": {"points": {"P": {"at": [0.03, 0, 0], "axis": [0, 0, 1]}, "Q": [0, 0.01, 0.02]}},
            "lever": {"points": lever},
        },
        joints=joined("ground -C- crank -P:planar- pad -Q:spherical- lever, ground -V- lever"),
        drivers={"C": {"speed": 1.0, "range": [-0.4, 0.5]}},
        loads={"turn": {"link": "lever", "moment": [0, -5.0, 0]}},
        assembly={"Q": [0.05, 0.15, 0.12]},
    )  # fmt: skip
    result = analyse(mechanism, 10)
    assert codes(result).count("mobility.spin") == 1

    def ball(angle):
        return np.array([-0.4 + length * np.cos(angle), 0.15, 0.3 - length * np.sin(angle)])

    def lifted(theta):
        normal = np.array([0.0, -np.sin(theta), np.cos(theta)])
        return float(brentq(lambda angle: normal @ ball(angle) - face - 0.02, -0.6, 1.2, xtol=1e-15))

    theta = -0.4 + result["time"].values
    angles = [lifted(angle) for angle in theta]
    places = result["point_position"].sel(point="lever.Q").values
    np.testing.assert_allclose(places, np.array([ball(angle) for angle in angles]).T, atol=1e-9)
    step = 1e-4
    ratio = np.array([(lifted(at + step) - lifted(at - step)) / (2 * step) for at in theta])
    np.testing.assert_allclose(result["drive_effort"].values[0], 5.0 * ratio, atol=1e-5)
