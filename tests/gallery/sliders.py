"""Linkages with slides of the gallery."""

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

import trunnion
from gallery.entry import STEPS, Entry, Outcome
from trunnion.algebra.dual import Dual, derivative
from trunnion.results.attributes import attribute
from trunnion.solve.run import prepare
from trunnion.studies.design import design


# toleranced-slider-crank: ∂x/∂r of the piston at 60°
def sensitivity(one: Outcome) -> float:
    run = prepare(one.mechanism)
    back = run.solve(run.cycle.times(6)[1:2], one.mechanism.parameters({"dimensions.crank": Dual(0.05, 1.0)}))
    return float(np.ravel(derivative(back.walk.point("piston", "Q").place[0]))[0])


def sensitivity_by_hand() -> float:
    """Of x = r cos θ + √(l² − r² sin² θ), m/m."""
    q = np.pi / 3
    return float(np.cos(q) - 0.05 * np.sin(q) ** 2 / np.sqrt(0.2**2 - (0.05 * np.sin(q)) ** 2))


# quick returns: time of the stroke outwards over that of the return
def time_ratio(slide: str) -> Callable[[Outcome], float]:
    """From the two places at which the slide turns back; over half of the positions move the slow way."""

    def found(one: Outcome) -> float:
        first, second = design(one.mechanism).dead_centres[slide]
        between = second - first
        outwards = float(np.mean(one.result["joint_slide_velocity"].sel(joint=slide) > 0))
        slow, fast = max(between, 2 * np.pi - between), min(between, 2 * np.pi - between)
        return slow / fast if outwards > 0.5 else fast / slow

    return found


def ratio_of_offset() -> float:
    """Crank and rod in line at ±: the lines to the guide's ends differ by φ, the strokes take 180° ± φ."""
    r, length, e = 0.08, 0.24, 0.1
    phi = np.arcsin(e / (length - r)) - np.arcsin(e / (length + r))
    return float((np.pi + phi) / (np.pi - phi))


def ratio_of_whitworth() -> float:
    """The ram turns back where the lever is level; the crank pin is then at ± acos(d/r) from straight down."""
    fast = 2 * np.arccos(60 / 120)
    return float((2 * np.pi - fast) / fast)


# worn-gudgeon-pin: how fast the pin first strikes its hole
def strikes_at_by_hand() -> float:
    """The rod swings freely about the crank pin and the slider stands still until the pin is at the wall."""
    r, length, mass, inertia, clearance, w = 0.05, 0.12, 0.21, 2.5e-4, 2.5e-4, 100 * np.pi
    half, x = length / 2, r + length

    def offset(t: float, y: list[float]) -> tuple[float, float]:
        return (r * np.cos(w * t) + length * np.cos(y[0]) - x, r * np.sin(w * t) + length * np.sin(y[0]))

    def rate(t: float, y: list[float]) -> list[float]:
        moment = np.cos(w * t) * np.sin(y[0]) - np.sin(w * t) * np.cos(y[0])
        return [y[1], -mass * half * r * w**2 * moment / (inertia + mass * half**2)]

    def gap(t: float, y: list[float]) -> float:
        return clearance - float(np.hypot(*offset(t, y)))

    gap.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(rate, (0, 1e-3), [0.0, -w * r / length], events=gap, rtol=1e-12, atol=1e-14)
    t, (angle, speed) = found.t_events[0][0], found.y_events[0][0]
    cx, cy = offset(t, [angle])
    ux = -r * w * np.sin(w * t) - length * speed * np.sin(angle)
    uy = r * w * np.cos(w * t) + length * speed * np.cos(angle)
    return float((cx * ux + cy * uy) / np.hypot(cx, cy))


# stick-slip-drive: how long it slips
def slip_of(one: Outcome) -> float:
    """From the first break-away to the rest after it, s."""
    result = trunnion.simulate(one.mechanism, 0.45, 1)
    kinds = [kind for kind, *_ in attribute(result, "events")]
    begin = kinds.index("break-away")
    times = result["event_time"].values
    return float(times[kinds.index("rest", begin)] - times[begin])


def slip_by_hand() -> float:
    """2/ω (π − atan(Δ ω/v)), Δ = (f_s − f) m g/k: an oscillation from Δ too long a stretch, at the feed's speed."""
    omega, over = np.sqrt(40e3 / 40), 0.05 * 40 * 9.81 / 40e3
    return float(2 / omega * (np.pi - np.arctan(over * omega / 0.005)))


ENTRIES = {
    "worn-gudgeon-pin": Entry(
        says="Speed at which the gudgeon pin first strikes the wall of its hole", unit="m/s", tolerance=1e-8,
        figures=("mechanism", "torque"), expected=strikes_at_by_hand,
        found=lambda one: float(trunnion.simulate(one.mechanism, 5e-4, 1)["impact_approach"][0]),
        source="the rod as a pendulum on the crank pin, integrated on its own (SciPy)",
    ),
    "stick-slip-drive": Entry(
        says="How long the carriage slips", unit="s", tolerance=1e-8, found=slip_of, expected=slip_by_hand,
        source="the oscillation on a spring with constant friction, in closed form",
    ),
    "slider-crank": Entry(
        says="Acceleration of the piston at the top dead centre", unit="m/s^2", tolerance=1e-9,
        figures=("mechanism", "torque"), source="the closed form −r ω² (1 + r/l)",
        found=lambda one: float(one.result["point_acceleration"].sel(point="piston.Q", axis="x")[0]),
        expected=lambda: -0.035 * (1450 * 2 * np.pi / 60) ** 2 * (1 + 0.035 / 0.130),
    ),
    "toleranced-slider-crank": Entry(
        says="Shift of the piston at 60° of the crank per shift of the crank pin along the crank", unit="1",
        tolerance=1e-12, figures=("mechanism", "torque"), found=sensitivity, expected=sensitivity_by_hand,
        source="the derivative of x = r cos θ + √(l² − r² sin² θ)",
    ),
    "offset-slider-crank": Entry(
        says="Time of the stroke outwards over that of the return", unit="1", tolerance=1e-10, found=time_ratio("S"),
        expected=ratio_of_offset,
        source="the closed form (180° + φ)/(180° − φ), φ = asin(e/(l − r)) − asin(e/(l + r))",
    ),
    "whitworth-quick-return": Entry(
        says="Time of the cutting stroke over that of the return", unit="1", tolerance=1e-10,
        figures=("mechanism", "torque"), found=time_ratio("G"), expected=ratio_of_whitworth,
        source="the closed form (360° − φ)/φ, φ = 2 acos(d/r)",
    ),
    "scotch-yoke": Entry(
        says="Largest difference of the yoke's place from r cos θ", unit="m", tolerance=1e-15,
        figures=("mechanism", "friction-power"), expected=lambda: 0.0, source="geometry",
        found=lambda one: float(
            np.abs(one.track("yoke.S")[0] - 0.05 * np.cos(np.arange(STEPS) * 2 * np.pi / STEPS)).max()
        ),
    ),
    "elliptic-trammel": Entry(
        says="Largest value of (x/a)² + (y/b)² − 1 at T", unit="1", tolerance=1e-13, expected=lambda: 0.0,
        found=lambda one: float(abs(np.hypot(*np.divide(one.track("bar.T"), [[0.15], [0.09]])) ** 2 - 1).max()),
        source="geometry",
    ),
    "inverted-slider-crank": Entry(
        says="Swing of the boom over the stroke of the cylinder", unit="rad", tolerance=1e-13,
        figures=("mechanism", "torque"), found=lambda one: float(np.ptp(one.angle("boom"))),
        expected=lambda: float(np.ptp(np.arccos((1.1**2 + 0.9**2 - np.array([0.95, 1.7]) ** 2) / (2 * 1.1 * 0.9)))),
        source="the law of cosines in the triangle of pivot, foot and eye",
    ),
}  # fmt: skip
