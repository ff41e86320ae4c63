"""Mechanisms in space with pins in play, and own equations of one; shared by tests."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from mechanisms_parts import joined
from playing import LANKARANI, SPEED
from trunnion.model.mechanism import Mechanism

Array = NDArray[np.float64]

UPRIGHT = {"axis": [0, 0, 1], "x": [1, 0, 0]}
ALONG = {"axis": [1, 0, 0], "x": [0, 1, 0]}


def rattling_in_space(contact: dict[str, Any] | None = None, **more: Any) -> Mechanism:
    """`playing.rattling` stated in space, its gudgeon pin 1 m long and everything alike on both sides of its middle."""

    def on(x: float) -> dict[str, Any]:
        return {"at": [x, 0, 0], **UPRIGHT}

    slide = {"at": [0, 0, 0], **ALONG}
    rod, slider = {"xx": 1e-5, "yy": 2.5e-4, "zz": 2.5e-4}, {"xx": 1e-4, "yy": 1e-4, "zz": 1e-4}
    gudgeon: dict[str, Any] = {"pin": {"radius": "9.5 mm", "hole_radius": "10 mm", "length": 1, "end_float": "1 mm"}}
    gudgeon |= {} if contact == {} else {"contact": contact or LANKARANI}
    data: dict[str, Any] = {
        "space": "spatial",
        "links": {
            "frame": {"points": {"O": on(0), "S": slide}},
            "crank": {"points": {"O": on(0), "P": on(0.05)}},
            "rod": {"points": {"P": on(0), "Q": on(0.12)}, "mass": 0.21, "inertia": rod, "centre": [0.06, 0, 0]},
            "slider": {"points": {"Q": on(0), "S": slide}, "mass": 0.14, "inertia": slider},
        },
        "ground": "frame",
        "joints": joined("frame -O- crank -P- rod -Q- slider, frame =S= slider", Q=gudgeon),
        "drivers": {"O": {"speed": SPEED}},
        "assembly": {"Q": [0.17, 0, 0]},
    }
    return Mechanism(**{**data, **more})


def tilting(contact: dict[str, Any] | None = None, clearance: float = 1e-4, **more: Any) -> Mechanism:
    """The same with a ball on the crank and a piston that may turn: the gudgeon pin, 30 mm long, tilts in its hole
    under a load off its middle."""
    soft = {"restitution": 0.3, "stiffness": 1e7, "exponent": 1}
    data = rattling_in_space(soft if contact is None else contact).data()
    data["joints"]["P"]["type"], data["joints"]["S"]["type"] = "spherical", "cylindrical"
    data["joints"]["Q"]["pin"] = {"radius": 0.01, "clearance": clearance, "length": 0.03, "end_float": clearance}
    data["links"]["slider"]["points"]["L"] = [0, 0.01, 0.02]
    data["links"]["rod"]["centre"] = [0.06, 0, 0.003]
    data["loads"] = {"press": {"link": "slider", "at": "L", "force": [-500, 40, 60]}}
    data["drivers"], data["assembly"] = {"O": {"speed": 20, "start": 0.5}}, {"Q": [0.16, 0, 0]}
    return Mechanism(**{**data, **more})


SOFT = {"restitution": 0.5, "stiffness": 1e8}
LOOSE = {"radius": 0.01, "clearance": 1e-4, "length": 0.04, "end_float": 2e-4}


def cardan() -> Mechanism:
    """A shaft at 100 rad/s drives another, 30° askew to it, by a cross; the bearing of that has play."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    along, across = [c, s, 0], [-s, c, 0]
    heavy = {"mass": 0.5, "inertia": {"xx": 1e-4, "yy": 4e-4, "zz": 4e-4}, "centre": [0.1, 0, 0]}
    bearing = {"axis": [1, 0, 0], "x": [0, 1, 0]}
    cross = {"at": [0, 0, 0], "axis": [0, 1, 0], "x": [0, 0, 1]}
    other = {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]}
    pin = {key: one for key, one in LOOSE.items() if key != "end_float"}
    return Mechanism(
        space="spatial",
        gravity=[0, 0, -9.81],
        links={
            "ground": {"points": {"A": {"at": [0, 0, 0], **bearing},
                                  "C": {"at": [0.2 * part for part in along], "axis": along, "x": across}}},
            "first": {"points": {"A": {"at": [0, 0, 0], **bearing}, "B": cross}},
            "second": {"points": {"B": other, "C": {"at": [0.2, 0, 0], **bearing}},
                       **heavy},
        },
        joints=joined("ground -A- first -B:universal- second -C:cylindrical- ground", C={"pin": pin, "contact": SOFT}),
        drivers={"A": {"speed": 100}},
    )  # fmt: skip


def on_a_plate() -> Mechanism:
    """A four-bar whose coupler slides on a plate, with both its pins in play."""

    def on(x: float) -> dict[str, Any]:
        return {"at": [x, 0, 0], **UPRIGHT}

    heavy = {"mass": 0.3, "inertia": {"xx": 1e-4, "yy": 2e-4, "zz": 3e-4}}
    return Mechanism(
        space="spatial",
        links={
            "ground": {"points": {"A": on(0), "D": on(0.1), "E": on(0.02)}},
            "crank": {"points": {"A": on(0), "B": on(0.03)}},
            "coupler": {"points": {"B": on(0), "C": on(0.09), "E": on(0.04)}, "centre": [0.05, 0.01, 0.002], **heavy},
            "rocker": {"points": {"D": on(0), "C": on(0.07)}, "centre": [0.03, 0, 0], **heavy},
        },
        joints=joined(
            "ground -A- crank -B- coupler, rocker -C- coupler, ground -D- rocker, ground -E:planar- coupler",
            B={"pin": LOOSE, "contact": SOFT},
            C={"pin": LOOSE, "contact": SOFT},
        ),
        drivers={"A": {"speed": 20, "start": "60 deg"}},
        assembly={"D": "100 deg"},
    )


# ---- a shaft in its hole, and nothing else ------------------------------------------------------------------------

MASS, CENTRE, TENSOR = 0.8, np.array([1e-3, 0.012, 0.0]), np.array([[4e-4, 2e-5, 0], [2e-5, 1e-4, 0], [0, 0, 3.5e-4]])
WIDTH, HALF, FLOAT, WALL = 2e-4, 0.04, 1e-4, 0.01 + 2e-4  # clearance, half the length and the end float, hole
STIFFNESS, RESTITUTION = 4e8, 0.5
FRICTION = {"law": "brown-mcphee", "coefficient": 0.2, "static": 0.25, "transition_speed": 0.05}


def dropped() -> Mechanism:
    """A shaft that turns at 60 rad/s in its hole and is let go; the pin that drives it has a metre of play."""

    def on(*at: float) -> dict[str, Any]:
        return {"at": list(at), "axis": [0, 1, 0], "x": [1, 0, 0]}

    inertia = {"xx": TENSOR[0, 0], "yy": TENSOR[1, 1], "zz": TENSOR[2, 2], "xy": TENSOR[0, 1]}
    return Mechanism(
        space="spatial",
        gravity=[0, 3.0, -9.81],
        links={
            "ground": {"points": {"M": on(0, 0.3, 0), "A": on(0, 0, 0)}},
            "wheel": {"points": {"M": on(0, 0, 0), "B": on(0.05, 0, 0)}, "inertia": {"xx": 1, "yy": 1, "zz": 1}},
            "shaft": {"points": {"A": on(0, 0, 0), "B": on(0.05, 0.3, 0)}, "mass": MASS, "centre": CENTRE.tolist(),
                      "inertia": inertia},
        },
        joints=joined(
            "ground -M- wheel -B:cylindrical- shaft -A- ground",
            B={"pin": {"clearance": 1, "length": 0.01},
               "contact": {"restitution": 0.5, "stiffness": 1e5, "exponent": 1}},
            A={"pin": {"radius": 0.01, "clearance": WIDTH, "length": 2 * HALF, "end_float": 2 * FLOAT},
               "contact": {"restitution": RESTITUTION, "law": "lankarani-nikravesh", "stiffness": STIFFNESS},
               "friction": FRICTION},
        ),
        drivers={"M": {"speed": 60}},
    )  # fmt: skip


class Dropped(NamedTuple):
    """Of own equations: onsets and lift-offs (time, contact, whether it begins), and states (time,) -> places of the
    mass centre and rows of the rotation, by time."""

    changes: list[tuple[float, int, bool]]
    place: Array
    rotation: Array


def own_shaft(times: Array) -> Dropped:
    """Newton's and Euler's equations of the shaft of `dropped`: y = place and velocity of its mass centre, rotation
    matrix, angular velocity in the shaft's axes. Contacts 0, 1: ends at −y and +y; 2, 3: shoulders likewise."""
    axis, gravity = np.array([0.0, 1.0, 0.0]), np.array([0.0, 3.0, -9.81])
    damping = 0.75 * (1 - RESTITUTION**2)

    def contact(y: Array, k: int) -> tuple[float, float, Array, Array, Array]:
        """Gap and its rate, outward normal, place, and slip of the shaft."""
        turn, spin = y[6:15].reshape(3, 3), y[6:15].reshape(3, 3) @ y[15:18]
        origin, line = y[:3] - turn @ CENTRE, turn @ axis
        if k > 1:
            out, place = axis * (1 if k == 3 else -1), origin
            gap = FLOAT - float(origin @ out)
        else:
            end = axis * (HALF if k else -HALF)
            c = origin - end - float((origin - end) @ line) * line
            size = float(np.linalg.norm(c))
            out = c / max(size, 1e-300)  # it begins in the middle
            place, gap = end + WALL * out, WIDTH - size
        speed = y[3:6] + np.cross(spin, place - y[:3])
        away = float(speed @ out)
        return gap, -away, out, place, speed - away * out

    def rate(_: float, y: Array, onsets: dict[int, float]) -> Array:
        turn, w = y[6:15].reshape(3, 3), y[15:18]
        force, moment = MASS * gravity, np.zeros(3)
        for k, onset in onsets.items():
            gap, opening, out, place, slip = contact(y, k)
            stiffness = STIFFNESS if k > 1 else STIFFNESS / 2
            normal = stiffness * max(-gap, 0.0) ** 1.5 * max(1 - damping * opening / onset, 0.0)
            push, size = -normal * out, float(np.linalg.norm(slip))
            if k < 2 and size > 0:
                x = size / FRICTION["transition_speed"]  # P. Brown, J. McPhee, J. Comput. Nonlinear Dynam. 11 (2016)
                share = 0.2 * np.tanh(4 * x) + 0.05 * x / (0.25 * x * x + 0.75) ** 2
                push = push - normal * share * slip / size
            force, moment = force + push, moment + np.cross(place - y[:3], push)
        cross = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        second = np.linalg.solve(TENSOR, turn.T @ moment - np.cross(w, TENSOR @ w))
        return np.concatenate([y[3:6], force / MASS, (turn @ cross).ravel(), second])

    def of(k: int, closes: bool) -> Any:
        def gap(_: float, y: Array, onsets: dict[int, float]) -> float:
            return contact(y, k)[0]

        gap.terminal, gap.direction = True, -1 if closes else 1  # type: ignore[attr-defined]
        return gap

    spin = np.array([0.0, 60.0, 0.0])
    y = np.concatenate([CENTRE, np.cross(spin, CENTRE), np.eye(3).ravel(), spin])
    onsets, time, changes, states = dict[int, float](), 0.0, list[tuple[float, int, bool]](), list[Array]()
    while time < times[-1]:
        events = [of(k, k not in onsets) for k in range(4)]
        found = solve_ivp(rate, (time, times[-1]), y, "DOP853", events=events, args=(onsets,), rtol=1e-12, atol=1e-15,
                          dense_output=True, max_step=2e-5 if onsets else 1e-4)  # fmt: skip
        inside = times[(times >= time) & (times < found.t[-1] if found.status else times <= found.t[-1])]
        states += [found.sol(inside)] if len(inside) else []
        time, y = float(found.t[-1]), found.y[:, -1]
        if found.status:
            k = next(k for k in range(4) if len(found.t_events[k]))
            changes.append((time, k, k not in onsets))
            if onsets.pop(k, None) is None:
                onsets[k] = -contact(y, k)[1]
    whole = np.concatenate(states, axis=1)
    return Dropped(changes, whole[:3], whole[6:15])
