"""The oracle of forces in space by itself: closed forms of gyroscopes, a screw, and what is not determined."""

from __future__ import annotations

import numpy as np
import pytest

from reference.maximal_space import rotation
from reference.newton_euler_space import Body, Joint, Load, solve


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
