"""The oracles of spatial mechanisms by themselves: closed forms of gyroscopes, power, differences, MuJoCo."""

from __future__ import annotations

import numpy as np
import pytest

from mechanisms_space import MODELS, Drawn, cardan, closed, rssr
from reference.maximal_space import Drive, Motion, rotation
from reference.newton_euler_space import Body, Joint, Load, solve
from reference.space_oracle import Oracle

FIRST = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])
ALL = {
    **MODELS,
    "RSSR of the theory": lambda: rssr(start=np.radians(60)),
    "Cardan joint": lambda: closed(cardan(), np.radians(40)),
    "Cardan joint at 45 degrees": lambda: closed(cardan(misalignment=45.0, error=0.5, offset=30.0), np.radians(40)),
}
START = {name: np.radians(40) for name in ALL if name.startswith("Cardan")}
RUBBED = {"RSSR of the theory": 0.15, "Cardan joint": 0.42}  # the others 0.05


def drives(drawn: Drawn, time: float, start: float = 0.0) -> dict[str, Drive]:
    """Coordinates of drives at constant speed."""
    found = {}
    for name, driver in drawn.data["drivers"].items():
        first = driver["range"][0] if "range" in driver else driver.get("start", start)
        found[name] = Drive(first + driver["speed"] * time, driver["speed"])
    return found


def made(name: str, friction: bool) -> tuple[Drawn, Oracle]:
    drawn = ALL[name]()
    defaults = drawn.data.get("joint_defaults", {})
    drawn.data["joint_defaults"] = {**defaults, "friction": {"coefficient": RUBBED.get(name, 0.05) * friction}}
    for joint in drawn.data["joints"].values():
        if joint["type"] in ("planar", "fixed"):
            joint["friction"] = 0.0
    return drawn, Oracle(drawn.data)


def moved(drawn: Drawn, oracle: Oracle, time: float, start: float) -> dict[str, Motion]:
    """The motion some time after the start."""
    frames = drawn.home
    for share in np.linspace(0, 1, 4):
        motions = oracle.move(frames, drives(drawn, share * time, start))
        frames = {link: motion.frame for link, motion in motions.items()}
    return motions


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", ALL)
def test_rates_are_differences_of_places(name: str) -> None:
    """Eighth-order differences of the mass centres: 1e-8 of the largest velocity and acceleration.

    The angle of a free spin is left as it comes, so directions are compared by the mass centre alone.
    """
    drawn, oracle = made(name, False)
    start, speed = START.get(name, 0.0), next(iter(drawn.data["drivers"].values()))["speed"]
    time, h = 0.05 / speed, 4e-3 / speed
    motions = moved(drawn, oracle, time, start)
    frames = {link: motion.frame for link, motion in motions.items()}
    around = [oracle.move(frames, drives(drawn, time + n * h, start)) for n in range(-4, 5)]
    for link, motion in motions.items():
        places = np.array([oracle.centre(link, one[link])[0] for one in around])
        c, acceleration = oracle.centre(link, motion)
        velocity = motion.velocity + np.cross(motion.spin, c - motion.frame.place)
        size = max(1e-9, float(np.max(np.abs(places))) * speed)
        np.testing.assert_allclose(FIRST @ places / h, velocity, rtol=0, atol=1e-8 * size)
        np.testing.assert_allclose(SECOND @ places / h**2, acceleration, rtol=0, atol=1e-6 * size * speed)


@pytest.mark.sample(8)
@pytest.mark.spread(7)
@pytest.mark.parametrize("friction", [False, True])
@pytest.mark.parametrize("name", ALL)
def test_power_balances(name: str, friction: bool) -> None:
    """Drives, loads, friction and the rate of the kinetic energy make nothing."""
    drawn, oracle = made(name, friction)
    speed = next(iter(drawn.data["drivers"].values()))["speed"]
    motions = moved(drawn, oracle, 0.05 / speed, START.get(name, 0.0))
    found, rubbed = oracle.rub(motions) if friction else (oracle.balance(motions), {})
    total, largest = oracle.power(motions, found, rubbed)
    assert abs(total) < 1e-12 * largest
    assert found.residual < 1e-13
    scale = max(float(np.linalg.norm(force)) for force in found.force.values())
    if not friction:
        assert all(abs(moment) < 1e-12 * scale for moment in found.spin.values()), "nothing has to hold a free spin"


@pytest.mark.spread(5)
@pytest.mark.parametrize("name", [n for n in ALL if n not in ("RSSH", "HUSR", "RECR", "RSFRC", "platform on six legs")])
def test_mujoco_has_the_same_forces(name: str) -> None:
    """Two programs and two sets of coordinates: motion and forces to 1e-11."""
    from reference.mujoco_space import Engine

    drawn, oracle = made(name, False)
    speed, start = next(iter(drawn.data["drivers"].values()))["speed"], START.get(name, 0.0)
    motions = moved(drawn, oracle, 0.05 / speed, start)
    engine = Engine(drawn.data)
    drive = drives(drawn, 0.05 / speed, start)
    other = engine.move({link: motion.frame for link, motion in motions.items()}, drive)
    found, theirs = oracle.balance(motions), engine.forces()
    for link in motions:
        for (ours, second), (place, acceleration) in [(oracle.centre(link, m[link]) for m in (motions, other))]:
            np.testing.assert_allclose(ours, place, rtol=0, atol=1e-12)
            np.testing.assert_allclose(second, acceleration, rtol=0, atol=1e-11 * speed**2)
    scale = max(float(np.linalg.norm(force)) for force in found.force.values())
    for joint, (force, moment) in theirs.reactions.items():
        np.testing.assert_allclose(found.force[joint], force, rtol=0, atol=1e-11 * scale, err_msg=joint)
        np.testing.assert_allclose(found.moment[joint], moment, rtol=0, atol=1e-11 * scale, err_msg=joint)
    for driver, effort in theirs.efforts.items():
        assert abs(found.effort[driver] - effort) < 1e-11 * scale


def test_skew_rotor() -> None:
    """A disc fixed askew on a shaft that turns at Ω: the couple ½ (C − A) Ω² sin 2φ across the shaft."""
    phi, spin, a, c = 0.3, 20.0, 0.02, 0.035
    tilt = rotation([0, 1, 0], phi)
    inertia = tilt @ np.diag([a, a, c]) @ tilt.T
    disc = Body(2.0, inertia, np.zeros(3), np.zeros(3), [0, 0, spin], np.zeros(3))
    found = solve({"disc": disc}, {"shaft": Joint("revolute", None, "disc", np.zeros(3), driven=True)})
    expected = [0, 0.5 * (c - a) * spin**2 * np.sin(2 * phi) * -1, 0]
    np.testing.assert_allclose(np.abs(found.moment["shaft"]), np.abs(expected), rtol=1e-13, atol=1e-13)
    axis = tilt[:, 2]
    exact = np.cross([0, 0, spin], a * np.array([0, 0, spin]) + (c - a) * (axis @ [0, 0, spin]) * axis)
    np.testing.assert_allclose(found.moment["shaft"], exact, rtol=1e-13, atol=1e-13)
    assert abs(found.effort["shaft"]) < 1e-13


def test_wheel_in_a_turning_frame() -> None:
    """A wheel of spin n in a frame that turns at Ω about a square axis: the couple C n Ω, about Ω × n."""
    c, n, big = 0.05, 100.0, 3.0
    spin, about = np.array([n, 0, 0]), np.array([0, 0, big])
    wheel = Body(1.5, np.diag([c, c / 2, c / 2]), np.zeros(3), np.zeros(3), spin + about, np.cross(about, spin))
    frame = Body(0.0, np.zeros((3, 3)), np.zeros(3), np.zeros(3), about, np.zeros(3))
    along = rotation([0, 1, 0], np.pi / 2)  # z of the element along x
    joints = {
        "post": Joint("revolute", None, "frame", np.zeros(3), driven=True),
        "axle": Joint("revolute", "frame", "wheel", np.zeros(3), along, driven=True),
    }
    found = solve({"frame": frame, "wheel": wheel}, joints, [0, 0, -9.81])
    for joint in joints:
        np.testing.assert_allclose(found.moment[joint], [0, c * n * big, 0], rtol=0, atol=1e-12)
        np.testing.assert_allclose(found.force[joint], [0, 0, 1.5 * 9.81], rtol=1e-14)
    assert abs(found.effort["post"]) < 1e-12
    assert abs(found.effort["axle"]) < 1e-12


def test_top_in_steady_precession() -> None:
    """A heavy top on its tip, at 90°: m g l = C n Ω (slow precession), so the tip needs no moment."""
    c, a, n, m, length, g = 0.02, 0.05, 80.0, 1.2, 0.3, 9.81
    big = m * g * length / (c * n)
    about, spin, arm = np.array([0, 0, big]), np.array([n, 0, 0]), np.array([length, 0, 0])
    centre = np.cross(about, np.cross(about, arm))
    top = Body(m, np.diag([c, a, a]), arm, centre, about + spin, np.cross(about, spin))
    found = solve({"top": top}, {"tip": Joint("fixed", None, "top", np.zeros(3))}, [0, 0, -g])
    np.testing.assert_allclose(found.moment["tip"], 0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.force["tip"], [-m * big**2 * length, 0, m * g], rtol=1e-13)


def test_screw_press() -> None:
    """A screw pushed by W along its axis: the torque W p/2π of the driven thread, and no reaction turns it."""
    push, pitch = 500.0, 0.01
    screw = Body(0.0, np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), [Load(force=[0, 0, -push])])
    joint = Joint("helical", None, "screw", np.zeros(3), pitch=pitch, driven=True)
    found = solve({"screw": screw}, {"thread": joint})
    assert found.effort["thread"] == pytest.approx(push * pitch / (2 * np.pi), rel=1e-14)
    np.testing.assert_allclose(found.force["thread"], [0, 0, push], rtol=1e-14)


def test_too_few_unknowns_are_refused() -> None:
    rest = Body(1.0, np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3))
    with pytest.raises(ValueError, match="not determinate"):
        solve({"body": rest}, {"ball": Joint("spherical", None, "body", np.zeros(3))})
