"""Linkages of the gallery with tolerances, with play and misaligned axes."""

from collections.abc import Callable
from itertools import product

import numpy as np

import trunnion
from gallery.entry import STEPS, Entry, Outcome, corner, slope
from gallery.spatial import rocker_of_rssr
from trunnion.algebra.dual import Dual, derivative
from trunnion.measures.measures import named, value
from trunnion.solve.run import prepare


def corners(one: Outcome) -> float:
    """Largest wedge angle with every dimension at one of its limits."""
    ends = [[(tolerance.path, tolerance.nominal + end) for end in (tolerance.lower, tolerance.upper)]
            for tolerance in one.mechanism.tolerated()]  # fmt: skip
    models = (one.mechanism.with_values(dict(values)) for values in product(*ends))
    return max(float(trunnion.analyse(model)["link_angle"].sel(link="strut")[0]) for model in models)


def steepest() -> float:
    """cos φ = (a + c)/(e − c), a and c at their least, e at its most."""
    a, c, e = 27.645 - 0.0125, 11.43 - 0.01, 50.8 + 0.0125
    return float(np.arccos((a + c) / (e - c)))


def shifts(one: Outcome, measure: str) -> dict[str, float]:
    """|∂y/∂p| t of a measure at 60° of the crank, by dual numbers, of every tolerance that does anything to it."""
    run = prepare(one.mechanism)
    (what,) = named(one.mechanism, [measure], run.values)
    found = {}
    for tolerance in one.mechanism.tolerated():
        values = one.mechanism.parameters(deviations={tolerance.path: Dual(0.0, 1.0)})
        walk = run.solve(run.cycle.times(6)[1:2], values).walk
        found[tolerance.path] = abs(float(np.ravel(derivative(value(what, walk)))[0])) * tolerance.half_width
    return found


def worst(measure: str) -> Callable[[Outcome], float]:
    return lambda one: sum(shifts(one, measure).values())


def squares(measure: str) -> Callable[[Outcome], float]:
    return lambda one: float(np.linalg.norm(list(shifts(one, measure).values())))


def by_corner(widths: tuple[float, ...]) -> list[float]:
    """The same of the rocker of 100, 30, 90, 70 mm from its triangle, by differences; widths: half, mm."""
    lengths = (100.0, 30.0, 90.0, 70.0)

    def rocker(place: int) -> Callable[[float], complex]:
        def angle(length: float) -> complex:
            ground, crank, coupler, one = (*lengths[:place], length, *lengths[place + 1 :])
            c = corner(crank * np.exp(1j * np.pi / 3), ground, coupler, one, 1)
            return complex(np.angle(c - ground))

        return angle

    return [abs(slope(rocker(i), lengths[i], 1e-3).real) * widths[i] for i in range(4)]


def swing_of_rssr() -> float:
    """Σ |∂ψ/∂p| t, by differences of the one equation that the length of the rod leaves."""
    widths = {"a": 2e-5, "b": 5e-5, "c": 3e-5, "d": 4e-5, "alpha": np.radians(0.1), "s1": 5e-5, "s4": 5e-5}
    nominal = {"a": 30e-3, "b": 120e-3, "c": 70e-3, "d": 100e-3, "alpha": np.pi / 3, "s1": 10e-3, "s4": 20e-3}

    def turned(name: str) -> Callable[[float], complex]:
        return lambda value: complex(rocker_of_rssr(np.pi / 3, **{name: value}))

    return sum(abs(slope(turned(name), nominal[name], 1e-5).real) * width for name, width in widths.items())


def least_cost_by_hand() -> float:
    """Σ B/√t with t ∝ (B/|S|)^(2/3) and Σ |S| t = 0.1 mm, S of the piston at 60° by the triangle of its rod."""
    angle = np.arcsin(50 * np.sin(np.pi / 3) / 200)
    rod = 1 / np.cos(angle)  # a pin's load under a unit load at the piston, too
    slopes = np.array([np.cos(np.pi / 3) - np.sin(np.pi / 3) * np.tan(angle), rod, rod, rod, rod])
    prices = np.array([0.5, 0.8, 0.2, 0.2, 0.3])
    shape = (prices / slopes) ** (2 / 3)
    return float(np.sum(prices / np.sqrt(0.1 * shape / (slopes @ shape))))


ENTRIES = {
    "one-way-clutch": Entry(
        says="Largest wedge angle that the limits of its dimensions allow", unit="rad", tolerance=1e-12, found=corners,
        expected=steepest, source="the closed form cos φ = (a + c)/(e − c) at the corner",
    ),
    "toleranced-fourbar": Entry(
        says="Most that the tolerances turn the rocker at 60° of the crank, to first order", unit="rad",
        tolerance=1e-11, figures=("mechanism", "torque"), found=worst("rotation:D"),
        expected=lambda: sum(by_corner((0.03, 0.02, 0.03, 0.03))),
        source="the triangle of coupler and rocker, its derivatives by differences",
    ),
    "fourbar-by-grades": Entry(
        says="Root of the sum of squares of what the tolerances turn the rocker at 60° of the crank", unit="rad",
        tolerance=1e-11, found=squares("rotation:D"),
        expected=lambda: float(np.linalg.norm(by_corner((0.027, 0.02, 0.027, 0.023)))),
        source="the triangle of coupler and rocker, its derivatives by differences",
    ),
    "piston-by-cost": Entry(
        says="Least cost of tolerances and pins with which the piston keeps its stop", unit="1", tolerance=1e-9,
        figures=("mechanism", "torque"), expected=least_cost_by_hand,
        found=lambda one: float(trunnion.allocate(one.mechanism, steps=4, samples=0)["cost_total"]),
        source="the closed form of one limit, t ∝ (B/|S|)^(2/3)",
    ),
    "toleranced-rssr": Entry(
        says="Most that the tolerances turn the rocker at 60° of the crank, to first order", unit="rad",
        tolerance=1e-10, found=worst("rotation:D"), expected=swing_of_rssr,
        source="the one equation that the length of the rod leaves, its derivatives by differences",
    ),
}  # fmt: skip


def by_one_play(one: Outcome) -> float:
    """The most that the play of C does to the angle of the rocker, at 60° of the crank."""
    found = trunnion.play(one.mechanism, ["rotation:D"], steps=6)
    return float(found["worst_case"].sel(joint="C", measure="rotation:D")[1])


def ideal_output(one: Outcome) -> float:
    """The same of the spatial linkage."""
    result = trunnion.analyse(one.mechanism.with_values({"joints.D.seat": "free"}), 6)
    return float(result["joint_rotation"].sel(joint="D")[1])


def smallest(one: Outcome) -> float:
    """The clearance, the same in every pin, that lets it turn all the way, m."""
    return float(trunnion.assemble(one.mechanism, 36)["smallest_clearance"])


def play_along_the_coupler() -> float:
    """ϱ/(c sin μ): the coupler is longer by ϱ, c the 70 mm rocker and μ its angle with the coupler of 90 mm."""
    b = 0.03 * np.exp(1j * np.pi / 3)
    c = corner(b, 0.1, 0.09, 0.07, 1)
    return float(2e-5 / (0.07 * abs(np.sin(np.angle((c - b) / (c - 0.1))))))


def leaned_hinges() -> float:
    """ρ = δ H (2 D + H − f)/(4 (D + H)): pins of 80 mm, 1 m apart, one hole leaned by 0.1°, end float of 1 mm.

    The line of the pins goes through the middle of the leaned hole; with the float it is half of it off, where the
    hole's axis has come nearer to the other by δ f/2.
    """
    lean, pin, apart, play = np.radians(0.1), 0.08, 1.0, 1e-3
    return float(lean * pin * (2 * apart + pin - play) / (4 * (apart + pin)))


PLAYED = {
    "fourbar-with-play": Entry(
        says="Most that the play of C turns the rocker at 60° of the crank", unit="rad", tolerance=1e-12,
        figures=("mechanism", "error"), found=by_one_play, expected=play_along_the_coupler,
        source="the closed form ϱ/(c sin μ), a coupler longer by the play",
    ),
    "rssr-with-play": Entry(
        says="Angle of the rocker at 60° of the crank with its shaft centred", unit="rad", tolerance=1e-12,
        figures=("mechanism", "seat"), found=ideal_output, expected=lambda: rocker_of_rssr(np.pi / 3),
        source="the one equation that the length of the rod leaves",
    ),
    "misaligned-fourbar": Entry(
        says="Smallest clearance, the same in all four pins, with which it turns", unit="m", tolerance=1e-11,
        figures=("assemble",), lost=STEPS, errors=("cannot be assembled",), found=smallest,
        expected=lambda: float(0.01 * np.tan(np.radians(0.2) / 4)),
        source="the closed form ½ H tan(δ/4), four pins that take up a quarter of the error each",
    ),
    "misaligned-hinges": Entry(
        says="Smallest clearance, the same in both pins, with which it swings", unit="m", tolerance=1e-10,
        figures=("assemble",), lost=STEPS, errors=("cannot be assembled",), found=smallest, expected=leaned_hinges,
        source="the closed form δ H (2 D + H − f)/(4 (D + H)) of the line through two holes, f the end float",
    ),
}  # fmt: skip
