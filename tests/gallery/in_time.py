"""Linkages of the gallery that move by themselves: what `simulate` finds, held against equations written out here."""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import trunnion
from gallery.entry import Entry, Outcome, corner
from trunnion.results.attributes import attribute

# landing-gear: how long it falls
FROM, STOP = np.radians([96.0, 226.0])  # of the brace
UPPER, LOWER, ARM = 0.45, 0.505, 0.6


def fall(one: Outcome) -> float:
    """When the brace meets its stop, without friction, s."""
    result = trunnion.simulate(one.mechanism.with_friction("off"), 6.0, 1, 1e-11)
    (stop,) = (row["figures"]["time"] for row in attribute(result, "findings") if row["code"] == "simulate.range")
    return float(stop)


def turned(brace: Any) -> tuple[Any, Any]:
    """Angles of the link and of the leg, rad, over that of the brace."""
    knee = 0.7 + 0.05j + UPPER * np.exp(1j * brace)
    heel = corner(knee, 0j, LOWER, ARM, 1)
    return np.unwrap(np.angle(heel - knee)), np.unwrap(np.angle(heel))


def fall_by_hand() -> float:
    """M(θ) θ″ + ½ M′ θ′² = −V′ − d ψ′² θ′: masses, weights and spring over the angle θ of the brace, ψ of the leg."""
    grid = np.linspace(FROM - 0.02, STOP + 0.02, 40_001)
    link, leg = turned(grid)
    leg_rate = np.gradient(leg, grid, edge_order=2)
    knee = 0.7 + 0.05j + UPPER * np.exp(1j * grid)
    middle = knee + LOWER / 2 * np.exp(1j * link)
    speed = np.abs(np.gradient(middle, grid, edge_order=2))
    link_rate = np.gradient(link, grid, edge_order=2)
    mass = 0.07 + 4 * (UPPER / 2) ** 2 + 0.065 * link_rate**2 + 3 * speed**2 + (9 + 62) * leg_rate**2
    high = 4 * UPPER / 2 * np.sin(grid) + 3 * np.imag(middle) + 62 * np.sin(leg)
    hook = 0.7 + 0.05j + 0.35 * np.exp(1j * grid) - (0.8 - 0.3j)
    energy = 9.81 * high + 0.5 * 400 * (np.abs(hook) - 0.25) ** 2

    def over(values: Any) -> Any:
        return lambda at: np.interp(at, grid, values)

    inertia, growth = over(mass), over(np.gradient(mass, grid, edge_order=2))
    force, drag = over(-np.gradient(energy, grid, edge_order=2)), over(700 * leg_rate**2)

    def rate(_: float, y: Any) -> list[float]:
        return [y[1], (force(y[0]) - 0.5 * growth(y[0]) * y[1] ** 2 - drag(y[0]) * y[1]) / inertia(y[0])]

    def stop(_: float, y: Any) -> float:
        return float(y[0] - STOP)

    stop.terminal = True  # type: ignore[attr-defined]
    done = solve_ivp(rate, (0, 6), [FROM, 0.0], events=stop, rtol=1e-9, atol=1e-11, method="LSODA", max_step=0.01)
    return float(done.t_events[0][0])


ENTRIES = {
    "landing-gear": Entry(
        says="Time of the fall to the stop, without friction", unit="s", tolerance=1e-6,
        figures=("mechanism", "motion"), found=fall, expected=fall_by_hand,
        source="the equation of motion of the brace written out, by SciPy",
    ),
    "andrews-squeezer-in-time": Entry(
        says="Angle of K1 after 0.03 s under 0.033 N m", unit="rad", tolerance=1e-8, figures=("mechanism", "torque"),
        found=lambda one: float(trunnion.simulate(one.mechanism, 0.03, 1, 1e-11)["drive_coordinate"][0, -1]),
        expected=lambda: 15.81077119629904,
        source="the published solution of the benchmark (F. Mazzia, C. Magherini)",
    ),
}  # fmt: skip
