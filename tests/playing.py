"""Mechanisms with joints in play, shared by tests and benchmarks."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import simpson, solve_ivp

from mechanisms_parts import joined
from trunnion.joints.contact import hertz_stiffness
from trunnion.model.mechanism import Mechanism

Array = NDArray[np.float64]

SPEED = 523.5987755983  # rad/s, 5000 rpm
STEEL = {"modulus": "207 GPa", "poisson_ratio": 0.3}
LANKARANI = {"law": "lankarani-nikravesh", "restitution": 0.9, **STEEL}


def rattling(contact: dict[str, Any] | None = None, pin: dict[str, Any] | None = None, **more: Any) -> Mechanism:
    """A slider-crank at constant speed whose gudgeon pin, 19 mm, lies in a hole of 20 mm; without gravity."""
    axis, gudgeon = {"at": [0, 0], "axis": [1, 0]}, {"pin": pin or {"radius": "9.5 mm", "hole_radius": "10 mm"}}
    gudgeon |= {} if contact == {} else {"contact": contact or LANKARANI}
    data: dict[str, Any] = {
        "links": {
            "frame": {"points": {"O": [0, 0], "S": axis}},
            "crank": {"points": {"O": [0, 0], "P": [0.05, 0]}},
            "rod": {"points": {"P": [0, 0], "Q": [0.12, 0]}, "mass": 0.21, "inertia": 2.5e-4, "centre": [0.06, 0]},
            "slider": {"points": {"Q": [0, 0], "S": axis}, "mass": 0.14},
        },
        "ground": "frame",
        "joints": joined("frame -O- crank -P- rod -Q- slider, frame =S= slider", Q=gudgeon),
        "drivers": {"O": {"speed": SPEED}},
        "assembly": {"Q": [0.17, 0]},
    }
    return Mechanism(**{**data, **more})


def rubbing(friction: float | dict[str, Any], **more: Any) -> Mechanism:
    """The same with friction in the other joints."""
    sizes = {"guide": {"length": 0.05}}, {"pin": {"radius": 0.01}}
    joints = {
        name: one if name == "Q" else {**one, "friction": friction, **sizes[one["type"] == "revolute"]}
        for name, one in rattling().data()["joints"].items()
    }
    return rattling(joints=joints, **more)


SMOOTH = {"law": "brown-mcphee", "coefficient": 0.1, "static": 0.12, "transition_speed": 0.01}


def both_pins(mass: float = 0.21) -> Mechanism:
    """The same with the crank pin in play as well: no joint holds the rod any more."""
    one = rattling().data()
    joints = {**one["joints"], "P": {**one["joints"]["Q"], "links": ["crank", "rod"]}}
    rod = {**one["links"]["rod"], "mass": mass, "inertia": 2.5e-4 * mass / 0.21}
    return rattling(joints=joints, links={**one["links"], "rod": rod})


def loose_slider(stiffness: str = "5 MN/m", **contact: Any) -> Mechanism:
    """The same with a slider in play in its guide, under gravity and at 30 rad/s."""
    one = rattling({}).data()
    guide = {"length": 0.1, "height": 0.05, "clearance": 1e-3}
    slider = {**one["joints"]["S"], "guide": guide,
              "contact": {"restitution": 0.4, "stiffness": stiffness, "exponent": 1, **contact}}  # fmt: skip
    links = {**one["links"], "slider": {**one["links"]["slider"], "inertia": 2e-4}}
    joints = {**one["joints"], "S": slider}
    return rattling({}, joints=joints, links=links, gravity=[0, -9.81], drivers={"O": {"speed": 30}})


def own_equations(duration: float) -> tuple[Any, float, float]:
    """Rod angle and slider of `rattling` with the contact of Lankarani and Nikravesh, written here by Lagrange's
    equations of the two free coordinates; the first contact alone."""
    r, length, mass, inertia, slider = 0.05, 0.12, 0.21, 2.5e-4, 0.14
    half, clearance = length / 2, 0.5e-3
    stiffness, factor = hertz_stiffness(9.5e-3, 10e-3, 207e9, 207e9, 0.3, 0.3), 0.75 * (1 - 0.81)

    def offset(t: float, y: Array) -> tuple[Array, Array]:
        a, phi, x, w, v = SPEED * t, *y
        c = np.array([r * np.cos(a) + length * np.cos(phi) - x, r * np.sin(a) + length * np.sin(phi)])
        u = np.array([-r * SPEED * np.sin(a) - length * w * np.sin(phi) - v,
                      r * SPEED * np.cos(a) + length * w * np.cos(phi)])  # fmt: skip
        return c, u

    def rate(t: float, y: Array, onset: float) -> list[float]:
        a, phi, _, w, v = SPEED * t, *y
        c, u = offset(t, y)
        size = float(np.hypot(*c))
        depth, force = size - clearance, np.zeros(2)
        if onset and depth > 0:
            n = c / size
            force = -n * stiffness * depth**1.5 * (1 + factor * float(n @ u) / onset)
        base = -r * SPEED**2 * np.array([np.cos(a), np.sin(a)])
        across = np.array([-np.sin(phi), np.cos(phi)])
        moment = length * float(across @ force) - mass * half * float(across @ base)
        return [w, v, moment / (inertia + mass * half**2), -force[0] / slider]

    start = [0.0, r + length, -SPEED * r / length, 0.0]

    def gap(t: float, y: Array, _: float) -> float:
        return clearance - float(np.hypot(*offset(t, y)[0]))

    gap.terminal, gap.direction = True, -1  # type: ignore[attr-defined]
    flight = solve_ivp(rate, (0, duration), start, events=gap, args=(0.0,), rtol=1e-13, atol=1e-15)
    t0, y0 = flight.t_events[0][0], flight.y_events[0][0]
    c, u = offset(t0, y0)
    onset = float(c @ u / np.hypot(*c))
    gap.direction = 1  # type: ignore[attr-defined]
    touch = solve_ivp(rate, (t0, duration), y0, events=gap, args=(onset,), rtol=1e-13, atol=1e-15, dense_output=True,
                      max_step=1e-6)  # fmt: skip
    times = np.linspace(t0, touch.t_events[0][-1], 20001)
    forces = []
    for time, y in zip(times, touch.sol(times).T, strict=True):
        c, u = offset(time, y)
        size = float(np.hypot(*c))
        forces.append(stiffness * max(size - clearance, 0) ** 1.5 * (1 + factor * float(c @ u) / size / onset))
    return (t0, times[-1] - t0, onset), max(forces), float(simpson(forces, x=times))
