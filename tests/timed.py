"""Mechanisms whose motion in time is known: shared by tests and benchmarks."""

from typing import Any

import numpy as np

from mechanisms_parts import joined
from trunnion.model.mechanism import Mechanism


def wheel(motor: dict[str, Any] | None = None, drag: float = 0.6, grease: float = 0.0, **driver: Any) -> Mechanism:
    """A flywheel of 0.05 kg m² on a shaft, with a constant and a viscous loss."""
    return Mechanism(
        links={"ground": {"points": {"A": [0, 0]}}, "wheel": {"points": {"A": [0, 0]}, "inertia": 0.05}},
        joints=joined("ground -A- wheel"),
        drivers={"A": {"speed": 100, **({"motor": motor} if motor else {"free": True}), **driver}},
        loads={"drag": {"joint": "A", "resisting_torque": drag}} if drag else {},
        springs={"grease": {"joint": "A", "damping": grease}} if grease else {},
    )


LINEAR = {"kind": "linear", "stall_effort": 4, "no_load_speed": 150}


def two_wheels(motor: dict[str, Any]) -> Mechanism:
    """That flywheel, whose joint has a constant loss, and another one beside it that runs down."""
    data = beside(wheel(motor, drag=0.0), 5).data()
    for joint, loss in (("A", 0.6), ("W", 0.3)):
        data["joints"][joint]["losses"] = {"constant": loss}
    return Mechanism(**data)


def three_posts() -> Mechanism:
    """Library of benchmark problems of IFToMM, A02: three posts and two couplers, slender rods of 1 m and 1 kg."""
    rod = {"mass": 1, "inertia": 1 / 12, "centre": [0.5, 0]}

    def link(first: str, *last: str) -> dict[str, Any]:
        return {"points": {first: [0, 0], **{key: [1, 0] for key in last}}, **rod}

    return Mechanism(
        gravity=[0, -9.81],
        links={
            "ground": {"points": {"A0": [0, 0], "B0": [1, 0], "C0": [2, 0]}},
            "p1": link("A0", "A"), "p2": link("B0", "B", "B2"), "p3": link("C0", "C"),
            "c1": link("A", "B"), "c2": link("B2", "C"),
        },
        joints=joined("ground -A0- p1 -A- c1 -B- p2 -B2- c2 -C- p3, ground -B0- p2, ground -C0- p3"),
        drivers={"A0": {"speed": 1, "start": np.pi / 2, "free": True, "initial": {"speed": -1}}},
        assembly={"B": [1, 1], "C": [2, 1]},
    )  # fmt: skip


def slider_crank(friction: float | dict[str, Any] = 0.1, **more: Any) -> Mechanism:
    """A slider-crank with a motor, masses, a load and friction in its pins and its guide."""
    data: dict[str, Any] = {
        "gravity": [0, -9.81],
        "links": {
            "frame": {"points": {"O": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}},
            "crank": {"points": {"O": [0, 0], "P": [0.035, 0]}, "mass": 1.0, "centre": [0.01, 0], "inertia": 0.02},
            "rod": {"points": {"P": [0, 0], "Q": [0.12, 0]}, "mass": 0.5, "centre": [0.04, 0], "inertia": 1e-3},
            "piston": {"points": {"Q": [0, 0], "S": {"at": [0, 0], "axis": [1, 0]}}, "mass": 0.6},
        },
        "ground": "frame",
        "joints": joined("frame -O- crank -P- rod -Q- piston, frame =S= piston", S={"guide": {"length": 0.05}}),
        "joint_defaults": {"pin": {"radius": 0.01}, **({"friction": friction} if friction else {})},
        "drivers": {
            "O": {"speed": 100, "motor": {"kind": "linear", "stall_effort": 8, "no_load_speed": 157, "inertia": 1e-3}}
        },
        "loads": {"work": {"joint": "S", "resisting_force": 40}},
        "assembly": {"Q": [0.155, 0]},
    }
    return Mechanism(**{**data, **more})


def _slide(x: float = 0.0) -> dict[str, Any]:
    return {"at": [x, 0], "axis": [1, 0]}


def pulled_mass() -> Mechanism:
    """C. Canudas de Wit et al., IEEE Trans. Autom. Control 40 (1995) 419-425: 1 kg under 1 N of load, with bristles, is
    pulled by a spring whose end moves at 0.1 m/s."""
    law = {
        "law": "lugre", "coefficient": 1, "static": 1.5, "stribeck_speed": 1e-3, "stiffness": 1e5,
        "damping": np.sqrt(1e5), "viscous": 0.4,
    }  # fmt: skip
    return Mechanism(
        gravity=[0, -1],
        links={
            "ground": {"points": {"S": _slide(), "E": _slide()}},
            "mass": {"points": {"S": _slide()}, "mass": 1},
            "end": {"points": {"E": _slide(), "P": [1, 0]}},
        },
        joints=joined("ground =S= mass, ground =E= end", S={"guide": {"length": 0.1}, "friction": law}),
        drivers={
            "S": {"range": [0, 2.5], "speed": 0.1, "free": True, "initial": {"coordinate": 0, "speed": 0}},
            "E": {"range": [0, 2.5], "speed": 0.1},
        },
        springs={"pull": {"between": ["mass.S", "end.P"], "stiffness": 2, "free_length": 1}},
    )


def mass_on_a_belt() -> Mechanism:
    """1 kg on a belt at 0.1 m/s, held by a spring of 100 N/m; 1.5 N at rest, 1 N of sliding."""
    law = {"law": "stiction", "coefficient": 0.1, "static": 0.15}
    return Mechanism(
        gravity=[0, -10],
        links={
            "ground": {"points": {"B": _slide(), "F": [-1, 0]}},
            "belt": {"points": {"B": _slide(), "S": _slide()}},
            "mass": {"points": {"S": _slide()}, "mass": 1},
        },
        joints=joined("ground =B= belt =S= mass", S={"guide": {"length": 0.1}, "friction": law}),
        drivers={
            "B": {"range": [0, 0.5], "speed": 0.1},
            "S": {"range": [0, -0.5], "speed": -0.1, "free": True, "initial": {"coordinate": 0, "speed": 0}},
        },
        springs={"hold": {"between": ["ground.F", "mass.S"], "stiffness": 100, "free_length": 1}},
    )


TORQUE = {"kind": "constant", "effort": 2.0}


def in_space(place: list[float]) -> dict[str, Any]:
    return {"at": [*place, 0], "axis": [0, 0, 1]}


def driven_four_bar(space: str, sides: tuple[float, float, float, float], at: list[float], **driver: Any) -> Mechanism:
    """Crank, coupler, rocker and ground; in space with a ball and a cylinder. Bodies without gravity."""
    a, b, c, d = sides
    flat = space == "planar"

    def link(length: float, first: str, last: str) -> dict[str, Any]:
        inertia: Any = 0.01 if flat else {"xx": 0.01, "yy": 0.01, "zz": 0.01}
        points = {first: [0, 0], last: [length, 0]}
        centre = [length / 2, 0] if flat else [length / 2, 0, 0]
        return {"points": points if flat else {key: in_space(place) for key, place in points.items()},
                "mass": 1.0, "centre": centre, "inertia": inertia}  # fmt: skip

    begin: dict[str, Any] = {"initial": {"coordinate": 1.0}} if "range" in driver else {"start": 1.0}
    ground = {"A": [0, 0], "D": [d, 0]}
    ball, tube = ("", "") if flat else (":spherical", ":cylindrical")
    return Mechanism(
        space=space,
        gravity=[0, 0] if flat else [0, 0, 0],
        links={
            "ground": {"points": ground if flat else {key: in_space(place) for key, place in ground.items()}},
            "crank": link(a, "A", "B"), "coupler": link(b, "B", "C"), "rocker": link(c, "D", "C"),
        },
        joints=joined(f"ground -A- crank -B{ball}- coupler -C{tube}- rocker, ground -D- rocker"),
        drivers={"A": {"speed": 1, "motor": TORQUE, **begin, **driver}},
        assembly={"C": at if flat else [*at, 0]},
    )  # fmt: skip


PARALLELOGRAM = (0.3, 1.0, 0.3, 1.0), [1.16, 0.25]
ANTIPARALLELOGRAM = (0.3, 1.0, 0.3, 1.0), [0.9, -0.28]
DELTOID = (0.4, 1.0, 1.0, 0.4), [0.9, 0.8]
# both cranks about their pins, 0.01 + 0.15², and the coupler on a circle
INERTIA = 2 * (0.01 + 0.15**2) + 0.3**2


def beside(mechanism: Mechanism, speed: float = 3) -> Mechanism:
    """The same beside a wheel of its own that is free, too."""
    data = mechanism.data()
    flat = mechanism.space == "planar"
    data["links"]["ground"]["points"]["W"] = [5, 5] if flat else in_space([5, 5])
    data["links"]["disc"] = {"points": {"W": [0, 0] if flat else in_space([0, 0])},
                             "inertia": 0.05 if flat else {"xx": 0.1, "yy": 0.1, "zz": 0.1}}  # fmt: skip
    data["joints"]["W"] = {"type": "revolute", "links": ["ground", "disc"]}
    data["drivers"]["W"] = {"speed": 1, "free": True, "initial": {"speed": speed}}
    return Mechanism(**data)


def swinging(space: str, **spring: float) -> Mechanism:
    """A parallelogram at whose crank a spring or damper acts."""
    data = driven_four_bar(space, *PARALLELOGRAM, range=[0.2, 3.0], motor={"kind": "constant", "effort": 0.1}).data()
    data["springs"] = {"stop": {"joint": "A", **({"free_angle": 1.0} if "stiffness" in spring else {}), **spring}}
    return Mechanism(**data)
