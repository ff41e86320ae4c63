"""Spatial linkages of the gallery. Angles and slides are those of the tables of the examples, in rad and m."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

import trunnion
from gallery.entry import STEPS, Entry, Outcome

Row = tuple[str, float, float, float]  # pair R or C, twist in degrees, distance, constant slide


def joint(one: Outcome, quantity: str, name: str) -> Any:
    """A quantity of a joint at every position."""
    return one.result[quantity].sel(joint=name).values


def at(one: Outcome, quantity: str, name: str, degrees: float) -> float:
    """A quantity of a joint where a crank that goes round from 0 is so far on."""
    return float(joint(one, quantity, name)[round(degrees / 360 * STEPS)])


def ratio(one: Outcome, driven: str, driver: str) -> Any:
    """Speed of one joint over that of another."""
    return joint(one, "joint_rotation_velocity", driven) / joint(one, "joint_rotation_velocity", driver)


def closed(rows: Sequence[Row], first: float, guess: Sequence[float]) -> Any:
    """Angles, then slides of the cylindrical rows, that close a loop: the product of its 4×4 matrices is no motion.

    guess: near the solution, which tells its branch: angles of all rows but the first, then slides.
    """

    def gap(unknown: Any) -> Any:
        angles, slides = (first, *unknown[: len(rows) - 1]), list(unknown[len(rows) - 1 :])
        product = np.eye(4)
        for (kind, twist, distance, slide), angle in zip(rows, angles, strict=True):
            along = slides.pop(0) if kind == "C" else slide
            for turn, shift in (([0, 0, angle], [0, 0, along]), ([np.radians(twist), 0, 0], [distance, 0, 0])):
                step = np.eye(4)
                step[:3, :3], step[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), shift
                product = product @ step
        return [*Rotation.from_matrix(product[:3, :3]).as_rotvec(), *product[:3, 3]]

    return fsolve(gap, guess, xtol=1e-12)


def stroke(name: str) -> Callable[[Outcome], float]:
    """How far a joint slides over the cycle, m."""
    return lambda one: float(np.ptp(joint(one, "joint_slide", name)))


def elliptic(a: float, b: float, c: float, sign: int) -> float:
    """The root of a cos x + b sin x = c that lies ahead (+1) or behind (−1) of the direction (a, b)."""
    return float(np.arctan2(b, a) + sign * np.arccos(c / np.hypot(a, b)))


# pezzuti-cardan: what its errors do
CARDAN: list[Row] = [("R", 89.9, 1e-5, 0.0), ("C", 89.9, 1e-5, 0.0), ("C", 89.9, 2e-5, 0.0)]


def cardan(misalignment: float = 15.0) -> Any:
    """Angles of pin-1, pin-2 and output, then their slides, at each of the positions (6, STEPS)."""
    rows: list[Row] = [*CARDAN, ("C", 179.9 - misalignment, 1e-5, 0.0)]
    # without errors: all at right angles
    found = [np.array([np.pi / 2, -np.radians(90 - misalignment), np.pi / 2, 0.0, 0.0, 0.0])]
    for first in np.arange(STEPS) * 2 * np.pi / STEPS:
        found.append(closed(rows, float(first), found[-1]))
    return np.transpose(found[1:])


def lean(one: Outcome) -> float:
    """Most that pin-1 leans in its hole, from the offsets of its ends: tan α = |c₂ − c₁|/H."""
    ends = one.result["seat_offset"].sel(joint="pin-1", axis=["x", "y"]).transpose("end", "axis", "position").values
    return float(np.arctan(np.linalg.norm(ends[1] - ends[0], axis=0).max() / 0.01))


def lead(output: Any) -> float:
    """How far the output runs ahead of and behind the input over the turn."""
    return float(np.ptp(np.unwrap(output) - np.arange(STEPS) * 2 * np.pi / STEPS))


# rccc, seven-r: the loop closed by a root finder
RCCC: list[Row] = [("R", 25, 1.0, 0.6), ("C", 70, 3.0, 0.0), ("C", 55, 2.5, 0.0), ("C", 60, 2.8, 0.0)]
SEVEN: list[Row] = [
    ("R", 20, 0.030, -0.172), ("R", 80, 0.100, -0.010), ("R", 65, 0.070, 0.040), ("R", 135, 0.110, -0.030),
    ("R", 120, 0.150, 0.030), ("R", 95, 0.140, -0.040), ("R", 65, 0.131, -0.095),
]  # fmt: skip


def seven_half_way() -> float:
    """Angle of G half a turn on, found in small steps from the start."""
    angles = np.radians([65.664, 111.601, 5.323, 100.445, 89.941, 163.500])
    for first in np.linspace(0.0, np.pi, 60):
        angles = closed(SEVEN, float(first), angles)
    return float(angles[-1])


# rssr, spherical-four-bar: one equation a cos ψ + b sin ψ = c
def rocker_of_rssr(crank: float, *, a: float = 30e-3, b: float = 120e-3, c: float = 70e-3, d: float = 100e-3,
                   s1: float = 10e-3, s4: float = 20e-3, alpha: float = np.pi / 3) -> float:  # fmt: skip
    """ψ from |A − B|² = b², A the ball of the crank, B that of the rocker."""
    axis, x = np.array([0.0, -np.sin(alpha), np.cos(alpha)]), np.array([1.0, 0.0, 0.0])
    ball = np.array([a * np.cos(crank), a * np.sin(crank), s1]) - np.array([d, 0.0, 0.0]) - s4 * axis
    return elliptic(
        float(ball @ x), float(ball @ np.cross(axis, x)), float((ball @ ball + c * c - b * b) / (2 * c)), -1
    )


def rocker_on_the_sphere(crank: float) -> float:
    """θ₄ from the angle between the axes of B and C, by the spherical law of cosines."""
    (s1, _, s3, s4), (c1, c2, c3, c4) = (f(np.radians([30, 75, 65, 80])) for f in (np.sin, np.cos))
    a = -s1 * c4 * s3 * np.cos(crank) - c1 * s4 * s3
    b = s1 * s3 * np.sin(crank)
    return elliptic(a, b, c2 + s1 * np.cos(crank) * s4 * c3 - c1 * c4 * c3, -1)


def off_the_straight_line(one: Outcome) -> float:
    """Of the middle of Sarrus' platform from its height a sin φ + √(b² − a² cos² φ) straight above the base, m."""
    place = one.result["point_position"].sel(point="platform.middle").transpose("axis", "position").values
    leaf = 0.1 * np.exp(1j * joint(one, "joint_rotation", "A"))
    height = leaf.imag + np.sqrt(0.12**2 - leaf.real**2)
    return float(np.abs(place - [0 * height, 0 * height, height]).max())


# tilting-gudgeon-pin: when its first end strikes
def strikes_by_hand() -> float:
    """The rod turns about the ball that the crank moves, by Euler's equations, and the piston goes on as it went, until
    the pin is at the wall of one end of its hole."""
    r, length, w, begin, mass = 0.05, 0.12, 100 * np.pi, np.pi / 3, 0.21
    centre, own = np.array([length / 2, 0, 3e-3]), np.diag([2e-5, 2.5e-4, 2.5e-4])
    tensor = own + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    angle = -np.arcsin(r * np.sin(begin) / length)
    turn = -r * w * np.cos(begin) / (length * np.cos(angle))
    place = r * np.cos(begin) + length * np.cos(angle)
    speed = -r * w * np.sin(begin) - length * turn * np.sin(angle)

    def crank(t: float) -> Any:
        return r * np.array([np.cos(begin + w * t), np.sin(begin + w * t), 0.0])

    def gap(t: float, y: Any) -> float:
        rod = np.reshape(y[:9], (3, 3))
        ends = np.array([[place + speed * t, 0.0, side] for side in (-0.015, 0.015)])
        return float(1e-4 - np.max(np.linalg.norm(np.cross(crank(t) + length * rod[:, 0] - ends, rod[:, 2]), axis=1)))

    def rate(t: float, y: Any) -> Any:
        rod, spin = np.reshape(y[:9], (3, 3)), y[9:]
        moment = mass * np.cross(centre, rod.T @ (w * w * crank(t))) - np.cross(spin, tensor @ spin)
        return np.concatenate([np.cross(rod, spin).ravel(), np.linalg.solve(tensor, moment)])

    gap.terminal = True  # type: ignore[attr-defined]
    start = [*Rotation.from_euler("z", angle).as_matrix().ravel(), 0.0, 0.0, turn]
    found = solve_ivp(rate, (0, 1e-2), start, events=gap, rtol=1e-12, atol=1e-14, max_step=1e-4)
    return float(found.t_events[0][0])


ENTRIES = {
    "universal-joint": Entry(
        says="Greatest speed of the output over that of the input", unit="1", tolerance=1e-12,
        found=lambda one: float(np.abs(ratio(one, "output", "input")).max()),
        expected=lambda: float(1 / np.cos(np.radians(30))), source="the closed form 1/cos δ",
    ),
    "double-cardan": Entry(
        says="Largest difference of the output's speed over that of the input from 1", unit="1", tolerance=1e-12,
        found=lambda one: float(np.abs(ratio(one, "D", "A") - 1).max()), expected=lambda: 0.0,
        source="symmetry about the middle of the shaft",
    ),
    "pezzuti-cardan": Entry(
        says="How far the output runs ahead of and behind the input, both together", unit="rad", tolerance=1e-11,
        found=lambda one: lead(joint(one, "joint_rotation", "output")), expected=lambda: lead(cardan()[2]),
        source="closing the four matrices of the loop with SciPy's root finder",
    ),
    "pezzuti-cardan-45deg": Entry(
        says="How far the output runs ahead of and behind the input at the angle of Table II, both together",
        unit="rad", tolerance=1e-11, found=lambda one: lead(joint(one, "joint_rotation", "output")),
        expected=lambda: lead(cardan(45.0)[2]),
        source="closing the four matrices of the loop with SciPy's root finder",
    ),
    "pezzuti-cardan-as-built": Entry(
        says="Most that pin-1 leans in its hole", unit="rad", tolerance=1e-7, figures=("mechanism", "seat"),
        found=lean, expected=lambda: float(np.arctan(2 * 0.01 / 10)),
        source="the closed form tan α = 2 ρ/H of a pin whose ends are pressed to opposite sides of its hole",
    ),
    "pezzuti-cardan-10mm": Entry(
        says="Travel of pin-1 along its axis over the turn, which only the errors cause", unit="m", tolerance=1e-12,
        lost=STEPS, errors=("locked by friction",), found=stroke("pin-1"), expected=lambda: float(np.ptp(cardan()[3])),
        source="closing the four matrices of the loop with SciPy's root finder",
    ),
    "rccc": Entry(
        says="Slide of the output at 60° of the crank", unit="m", tolerance=1e-11,
        found=lambda one: at(one, "joint_slide", "D", 60),
        expected=lambda: float(closed(RCCC, np.pi / 3, [1.2, 1.7, 1.4, -3.0, -1.0, -2.1])[5]),
        source="closing the four matrices of the loop with SciPy's root finder",
    ),
    "rssr": Entry(
        says="Angle of the rocker at 60° of the crank", unit="rad", tolerance=1e-12,
        found=lambda one: at(one, "joint_rotation", "D", 60), expected=lambda: rocker_of_rssr(np.pi / 3),
        source="the one equation that the length of the rod leaves",
    ),
    "rssp": Entry(
        says="Stroke of the ram", unit="m", tolerance=1e-14, found=stroke("D"),
        expected=lambda: float(np.sqrt(0.26**2 - (0.12 - 0.04) ** 2) - np.sqrt(0.26**2 - (0.12 + 0.04) ** 2)),
        source="the closed form √(l² − (d − r)²) − √(l² − (d + r)²)",
    ),
    "swash-plate-pump": Entry(
        says="Stroke of the piston", unit="m", tolerance=1e-14, found=stroke("cylinder"),
        expected=lambda: float(2 * 0.04 * np.tan(np.radians(15))), source="the closed form 2 R tan α",
    ),
    "spherical-four-bar": Entry(
        says="Angle of the rocker at 90° of the crank", unit="rad", tolerance=1e-12,
        found=lambda one: at(one, "joint_rotation", "D", 90), expected=lambda: rocker_on_the_sphere(np.pi / 2),
        source="spherical trigonometry",
    ),
    "tilting-gudgeon-pin": Entry(
        says="When the first end of the gudgeon pin strikes the wall of its hole", unit="s", tolerance=1e-8,
        found=lambda one: float(trunnion.simulate(one.mechanism, 3e-4, 1)["impact_begin"][0]), expected=strikes_by_hand,
        source="Euler's equations of the rod about the ball on the crank, integrated on their own (SciPy)",
    ),
    "bennett": Entry(
        says="tan(θ/2) of the crank times that of the coupler, the same at every position", unit="1", tolerance=1e-12,
        found=lambda one: float(np.prod([np.tan(at(one, "joint_rotation", name, 60) / 2) for name in "AB"])),
        expected=lambda: float(np.sin(np.radians(80)) / np.sin(np.radians(30))),
        source="Bennett's closed form sin ½(β + α)/sin ½(β − α)",
    ),
    "sarrus": Entry(
        says="Largest distance of the platform from the height a sin φ + √(b² − a² cos² φ) straight above the base",
        unit="m", tolerance=1e-13, found=off_the_straight_line, expected=lambda: 0.0,
        source="the triangle of two leaves",
    ),
    "seven-r": Entry(
        says="Angle of the last pin half a turn on", unit="rad", tolerance=1e-10,
        found=lambda one: at(one, "joint_rotation", "G", 180), expected=seven_half_way,
        source="closing the seven matrices of the loop with SciPy's root finder",
    ),
}  # fmt: skip
