"""What a designer also asks of a planar linkage: does it transmit well, where does it turn back, how does it shake.

Everything is read off one run over the cycle: the poses of the dyads, the twists of the links, the efforts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.cycle.scales import scales_of
from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import PAIRS
from trunnion.measures.transmission import pressure_angles
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.results.figure import Figure
from trunnion.results.scales import EVERYWHERE, Scales
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward, forward
from trunnion.solve.memory import in_blocks
from trunnion.solve.run import Run, prepare
from trunnion.solve.switches import Mechanisms, accuracy_of, breaks_between, knots_of
from trunnion.studies.motor import Motor, motor

__all__ = [
    "Counterweight",
    "Design",
    "Extremes",
    "all_instant_centres",
    "counterweights",
    "curvature",
    "dead_centres",
    "design",
    "grashof",
    "instant_centre",
    "limits",
    "pressure_angles",
    "report_figures",
    "shaking",
    "transmission_angles",
]

Array = NDArray[np.float64]

EXACT = Accuracy(1e-12, 1e-14, shortest=1e-14)  # of the motion alone: dead centres and limits
BESIDE = 1e-6  # of the cycle: before and after a place at which a link may turn back


@dataclass(frozen=True)
class Counterweight:
    """Mass times place (kg m, in the link's frame) to add to a link that turns about the ground."""

    link: str
    x: float
    y: float


class Extremes(NamedTuple):
    """Least and largest value over the positions of a cycle, and the drive coordinates (rad, m; s) where they are."""

    least: float
    at_least: float
    largest: float
    at_largest: float


@dataclass(frozen=True)
class Design:
    """Figures of a linkage over its cycle; angles in rad, SI.

    transmission_angle: least of each dyad, folded into 0 … π/2 (π/2 is best); pressure_angle: extremes of each
    dyad in −π/2 … π/2 (0 is best); dead_centres: of each link that turns about the ground or slides on it, the
    drive coordinates where it turns back; limits: drive coordinates between which the linkage can be assembled;
    shaking_force, shaking_moment (about the ground's origin): largest
    that inertia puts on the frame; rms_effort, peak_power, mean_power: of the first driver; energy_swing: largest
    change of its energy about the mean, J; mean_speed: of that driver, 0 if it turns back; grashof: type of a
    four-bar, empty if it is none.
    """

    grashof: str
    transmission_angle: dict[str, float]
    pressure_angle: dict[str, Extremes]
    dead_centres: dict[str, tuple[float, ...]]
    limits: tuple[tuple[float, float], ...]
    shaking_force: float
    shaking_moment: float
    rms_effort: float
    peak_power: float
    mean_power: float
    energy_swing: float
    mean_speed: float

    def flywheel(self, fluctuation: float) -> float:
        """Inertia on the drive shaft, kg m², that keeps its speed within mean · (1 ± fluctuation/2).

        J = ΔE / (δ ω²): the energy swing over the coefficient of fluctuation and the mean speed squared. NaN for a
        drive that turns back, which has no speed to keep.
        Source: any textbook of machine theory, e.g. R. L. Norton, Design of Machinery, "Flywheels".
        """
        if not fluctuation > 0:
            raise MechanismError(Finding(f"a fluctuation of {fluctuation:g} needs no end of inertia", "fluctuation"))
        return self.energy_swing / (fluctuation * self.mean_speed**2) if self.mean_speed else float("nan")


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def design(mechanism: Mechanism, steps: int = 720) -> Design:
    """What a designer asks of a planar linkage: transmission, dead centres, range, shaking, balance, motor.

    steps: equally spaced positions of the cycle, at which extremes of the motion are taken; dead centres, limits and
    what concerns the drive depend on none. Returns a Design, SI and
    rad. Source: R. L. Norton, Design of Machinery.
    Raises MechanismError for a mechanism in space, or if the structure does not determine the motion.
    """
    run = _planar(mechanism)
    time = run.cycle.times(steps)
    back = run.solve(time)
    walk = back.walk
    force, moment = shaking(back)
    steps = len(time)
    driver = next(iter(mechanism.drivers), "")
    rate = np.broadcast_to(run.system.drive(run.values, driver, time)[1], time.shape) if driver else np.zeros(steps)
    asked = motor(run, driver) if driver else Motor()
    return Design(
        grashof(mechanism, run),
        {name: _least(np.broadcast_to(angle, time.shape)) for name, angle in transmission_angles(walk).items()},
        {name: _extremes(run, np.broadcast_to(angle, time.shape)) for name, angle in pressure_angles(walk).items()},
        dead_centres(run),
        limits(run),
        _largest(np.hypot(*force)),
        _largest(moment),
        *asked,
        0.0 if np.any(rate * np.sum(rate) <= 0) else float(np.mean(rate)),
    )


def _planar(mechanism: Mechanism) -> Run:
    """The mechanism prepared; MechanismError if it is spatial."""
    if mechanism.space != "planar":
        what = "the figures of design (transmission angle, Grashof, instant centres, shaking force) are of the plane"
        raise MechanismError(Finding(what, "space", "use analyse and locking; screw axes are in the report"))
    return prepare(mechanism)


def _least(values: Array) -> float:
    return float(np.nanmin(values)) if np.any(np.isfinite(values)) else float("nan")


def _largest(values: Array) -> float:
    return float(np.nanmax(np.abs(values))) if np.any(np.isfinite(values)) else float("nan")


def transmission_angles(walk: Forward) -> dict[str, Array]:
    """Transmission angle of every dyad along the walk, rad in 0 … π/2, by its joints' names: π/2 less |φ|.

    φ is the pressure angle. RRR: between the two links at their common pin, folded to be acute; RRP: between the rod
    and the normal of the guide's path; RPR: between the line of the outer pins and the normal of the slide; PRP and
    RPP: between the two guides.
    """
    return {name: np.pi / 2 - np.abs(angle) for name, angle in pressure_angles(walk).items()}


def _extremes(run: Run, values: Array) -> Extremes:
    """Extremes over the positions of a cycle; NaN where there is no number at all."""
    if not np.any(np.isfinite(values)):
        return Extremes(*([float("nan")] * 4))
    time = run.cycle.times(len(values))
    low, high = int(np.nanargmin(values)), int(np.nanargmax(values))
    return Extremes(float(values[low]), _coordinate(run, time[low]), float(values[high]), _coordinate(run, time[high]))


def shaking(back: Backward) -> tuple[tuple[Array, Array], Array]:
    """Force (x, y), N, and moment about the ground's origin, N m, that inertia and weightless links put on the frame.

    −Σ m a of all mass centres, and −Σ (r × m a + J α): what the foundation feels of the motion alone.
    """
    walk, values = back.walk, back.walk.values
    shape = np.shape(back.walk.motions[walk.system.mechanism.fixed_link].twist.w)
    x, y, turn = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for name, link in walk.system.mechanism.links.items():
        if name == walk.system.mechanism.fixed_link:
            continue
        mass, inertia = values[f"links.{name}.mass"], values[f"links.{name}.inertia"]
        local = walk.system.centre(values, name)
        if link.inertia_about == "origin":
            inertia = inertia - mass * (local[0] ** 2 + local[1] ** 2)
        centre = walk.at(name, local)
        fx, fy = -mass * centre.acceleration[0], -mass * centre.acceleration[1]
        x, y = x + fx, y + fy
        alpha = walk.motions[name].acceleration.w
        turn = turn + centre.place[0] * fy - centre.place[1] * fx - inertia * alpha
    return (x, y), turn


def instant_centre(walk: Forward, first: str, second: str) -> tuple[Array, Array]:
    """Point (x, y), m, where two links have the same velocity; at infinity (±inf or NaN) where they turn alike."""
    one, two = walk.motions[first], walk.motions[second]
    w = np.asarray(two.twist.w - one.twist.w, float)
    with np.errstate(all="ignore"):
        return -(two.twist.y - one.twist.y) / w, (two.twist.x - one.twist.x) / w


def curvature(walk: Forward, link: str, point: str) -> Array:
    """Curvature of the path of a point, 1/m: (v × a)/|v|³, positive where it bends to the left."""
    motion = walk.point(link, point)
    (vx, vy), (ax, ay) = motion.velocity, motion.acceleration
    with np.errstate(all="ignore"):
        return np.asarray((vx * ay - vy * ax) / np.hypot(vx, vy) ** 3, float)


def grashof(mechanism: Mechanism, run: Run | None = None) -> str:
    """Type of a four-bar by Grashof's rule; empty for any other linkage.

    With s shortest, l longest, p, q the others: s + l < p + q lets a link turn fully; which one depends on where the
    shortest link is.
    """
    run = run or _planar(mechanism)
    kinds = [module.kind for module in run.system.plan.modules]
    if kinds != ["R", "RRR"]:
        return ""
    driver, dyad = run.system.plan.modules
    local = run.system.elements(run.values)
    ground, crank = mechanism.fixed_link, driver.links[0]
    a = driver.joints[0]
    b, c, d = dyad.joints
    if crank not in run.system.joints[b][1]:
        b, d = d, b
    if crank not in run.system.joints[b][1] or ground not in run.system.joints[d][1]:
        return ""
    coupler = next(link for link in run.system.joints[b][1] if link != crank)
    rocker = next(link for link in run.system.joints[d][1] if link != ground)

    def span(link: str, one: str, two: str) -> float:
        p, q = local[link, one], local[link, two]
        return float(np.hypot(p.x - q.x, p.y - q.y))

    sides = {
        "ground": span(ground, a, d),
        "input": span(crank, a, b),
        "coupler": span(coupler, b, c),
        "output": span(rocker, c, d),
    }
    lengths = sorted(sides.values())
    margin = lengths[1] + lengths[2] - lengths[0] - lengths[3]
    if abs(margin) <= 1e-12 * lengths[3]:
        return "change point"
    if margin < 0:
        return "triple rocker"
    shortest = min(sides, key=sides.__getitem__)
    return {
        "ground": "double crank",
        "input": "crank-rocker",
        "coupler": "double rocker",
        "output": "rocker-crank",
    }[shortest]


def _motion(run: Run) -> tuple[list[str], Courses]:
    """Joints on the ground that no driver turns, and the course of their speeds; its states say whether it closes.

    The last row is the rate of the first driver.
    """
    return run.once("turning", lambda: _moved(run))


def _moved(run: Run) -> tuple[list[str], Courses]:
    system, driver = run.system, next(iter(run.system.mechanism.drivers), "")
    ground, drivers = system.mechanism.fixed_link, system.mechanism.drivers
    joints = [name for name, (_, links) in system.joints.items() if ground in links and name not in drivers]

    def look(time: Array) -> tuple[Array, NDArray[np.intp]]:
        time = time if run.cycle.duration > 0 else 0.0 * time
        walk = forward(system, run.values, run.chosen.assembly, time)
        rates = [*(walk.speed(joint) for joint in joints), system.drive(run.values, driver, time)[1] if driver else 1.0]
        closed = np.ones(time.shape, bool)
        for motion in walk.motions.values():
            closed &= np.isfinite(np.broadcast_to(motion.frame.x + motion.frame.c, closed.shape))
        return np.array([np.broadcast_to(rate, time.shape) for rate in rates]), closed.astype(np.intp)

    of = Mechanisms(system, run.chosen.assembly, run.values, [run.cycle])
    knots = np.array([time for _, time in knots_of(of)])
    breaks = breaks_between(run.cycle, knots) if run.cycle.duration > 0 else np.array([0.0, 1.0])
    accuracy = accuracy_of(run.cycle, EXACT)
    return joints, Courses.of(in_blocks(look, len(system.joints)), breaks, None, accuracy)


def dead_centres(run: Run) -> dict[str, tuple[float, ...]]:
    """Drive coordinates (rad, m) at which each link on the ground turns back; times (s) without a driver."""
    joints, courses = _motion(run)
    beside, duration = BESIDE * courses.span * np.array([-1.0, 1.0]), run.cycle.duration
    found: dict[str, tuple[float, ...]] = {}
    for row, joint in enumerate(joints):
        passages = courses.passages(row)
        if run.cycle.periodic:  # its end is its start
            passages = np.sort(np.append(np.where(passages > duration * (1 - BESIDE), 0.0, passages), 0.0))
            passages = passages[np.diff(passages, prepend=-duration) > BESIDE * duration]
        around = passages[:, None] + beside
        around = around % duration if run.cycle.periodic else np.clip(around, 0.0, courses.span)
        before, after = courses.picked(np.array([row])).at(around.ravel()).reshape(-1, 2).T
        places = [round(_coordinate(run, time), 12) + 0.0 for time in passages[before * after < 0].tolist()]
        found[joint] = tuple(sorted(set(places)))
    return found


def _coordinate(run: Run, moment: float) -> float:
    """Coordinate of the first driver at a time; the time itself if there is none."""
    driver, moment = next(iter(run.system.mechanism.drivers), ""), moment if run.cycle.duration > 0 else 0.0
    return float(run.system.drive(run.values, driver, moment)[0]) if driver else moment


def limits(run: Run) -> tuple[tuple[float, float], ...]:
    """Intervals of the drive coordinate (rad, m) over which the linkage can be assembled."""
    _, courses = _motion(run)
    turns = courses.passages(len(courses.sizes) - 1)  # where the drive turns back
    edges = np.flatnonzero(np.diff(np.concatenate([[0], courses.states, [0]])))
    found: list[tuple[float, float]] = []
    for first, after in zip(edges[::2], edges[1::2], strict=True):
        low, high = courses.edges[first], courses.edges[after]
        inside = turns[(turns > low) & (turns < high)]
        ends = [_coordinate(run, float(time)) for time in [low, high]]
        places = [*ends, *(_coordinate(run, float(time)) for time in inside)]
        reached = (min(places), max(places)) if len(inside) else (ends[0], ends[1])
        if not any(np.allclose(reached, other, rtol=1e-9, atol=0) for other in found):  # there and back again
            found.append(reached)
    return tuple(found)


def counterweights(run: Run, steps: int = 90) -> tuple[tuple[Counterweight, ...], float]:
    """Counterweights on the links that turn about the ground that best cancel the shaking force, and what is left.

    The momentum of the counterweight with mass times place p on link i is ω_i z × R_i p: linear in p. p is found so
    that the total momentum is nearest to constant over the cycle (least squares). The second number is the share of the
    RMS shaking force that remains: 0 to rounding for a four-bar of revolute pairs (Berkof and Lowen 1969).
    Raises MechanismError if no link turns about the ground.
    """
    system, time = run.system, run.cycle.times(steps)
    back = run.solve(time)
    walk, ground = back.walk, system.mechanism.fixed_link
    turning = [
        next(link for link in links if link != ground)
        for kind, links in system.joints.values()
        if PAIRS[kind].turns and ground in links
    ]
    if not turning:
        raise MechanismError(Finding("no link turns about the ground", "joints", "counterweights need one that does"))
    columns = []
    for link in turning:
        frame, w = walk.motions[link].frame, walk.motions[link].twist.w
        alpha = walk.motions[link].acceleration.w
        for c, s in ((frame.c, frame.s), (-frame.s, frame.c)):  # R p for the unit vectors p = x, p = y
            # acceleration of the place: α × r − ω² r
            columns.append(np.concatenate([_full(-alpha * s - w * w * c, time), _full(alpha * c - w * w * s, time)]))
    force = np.concatenate([_full(part, time) for part in shaking(back)[0]])
    matrix = np.array(columns).T
    solved = np.isfinite(force) & np.isfinite(matrix).all(axis=1)
    matrix, force = matrix[solved], force[solved]
    solution = np.linalg.lstsq(matrix, force, rcond=None)[0] if len(force) else np.full(matrix.shape[1], np.nan)
    size = float(np.linalg.norm(force))
    left = np.linalg.norm(force - matrix @ solution) / size if size > 0 else float("nan")
    weights = tuple(
        Counterweight(link, float(solution[2 * i]), float(solution[2 * i + 1])) for i, link in enumerate(turning)
    )
    return weights, float(left)


def _full(values: Array, time: Array) -> Array:
    return np.broadcast_to(values, time.shape)


def all_instant_centres(walk: Forward) -> dict[tuple[str, str], tuple[Array, Array]]:
    """Instant centres of every pair of links: n (n − 1)/2 of them."""
    return {(a, b): instant_centre(walk, a, b) for a, b in combinations(walk.system.mechanism.links, 2)}


def report_figures(mechanism: Mechanism, steps: int = 720, fluctuation: float = 0.05) -> list[Figure]:
    """The figures that one looks at first."""
    run = _planar(mechanism)
    found, scales = design(mechanism, steps), scales_of(run)
    driver = next(iter(mechanism.drivers), "")
    turns = not driver or run.system.turns(driver)
    unit, scale = ("°", 180 / np.pi) if turns else ("mm", 1e3)
    figures = [Figure("grashof", "four-bar type (Grashof)", found.grashof)] if found.grashof else []
    if driver and not found.transmission_angle and mechanism.fixed_link not in run.system.joints[driver][1]:
        why = f"{driver} drives two moving links; both are of a driver on {mechanism.fixed_link}"
        figures.append(Figure("transmission_angle", "four-bar type and transmission angle", None, "°", note=why))
    for name, angle in found.transmission_angle.items():
        subject = f"transmission angle of {name}"
        figures.append(Figure(f"{name}.transmission_angle", subject, angle * 180 / np.pi, "°", "minimum"))
    figures += [_pressure(name, extremes, scale, unit, scales) for name, extremes in found.pressure_angle.items()]
    for name, places in found.dead_centres.items():
        if places:
            text = ", ".join(f"{place * scale:.6g}" for place in places)
            figures.append(Figure(f"{name}.dead_centres", f"dead centres of {name}", text, f"{unit} of {driver}"))
    text = ", ".join(f"{low * scale:.6g} … {high * scale:.6g}" for low, high in found.limits) or "no position"
    within = "" if run.cycle.periodic else "within the stated motion"
    start = f"it starts at {_coordinate(run, 0.0) * scale:.6g}{unit}" * (len(found.limits) > 1 and bool(driver))
    figures += [
        Figure("limits", "range of assembly", text, f"{unit} of {driver}" if driver else "", within, note=start),
        Figure("shaking_force", "shaking force", found.shaking_force, "N", "maximum"),
        Figure("shaking_moment", "shaking moment about the ground's origin", found.shaking_moment, "N m", "maximum"),
        Figure("effort_rms", "drive effort", found.rms_effort, "N m" if turns else "N", "RMS"),
        Figure("peak_power", "drive power", found.peak_power, "W", "maximum"),
        Figure("mean_power", "drive power", found.mean_power, "W", "mean"),
        Figure("energy_swing", "energy swing about the mean", found.energy_swing, "J"),
    ]
    if turns and driver and run.cycle.periodic and found.mean_speed:
        subject = f"flywheel for a fluctuation of {fluctuation:g}"
        figures.append(Figure("flywheel", subject, found.flywheel(fluctuation), "kg m^2"))
    if any(PAIRS[kind].turns and mechanism.fixed_link in links for kind, links in run.system.joints.values()):
        figures += _balanced(run, scales)
    return scales.of_figures(figures)


def _pressure(name: str, extremes: Extremes, scale: float, unit: str, scales: Scales) -> Figure:
    """The extremes of a pressure angle, in degrees, with their places; scale, unit: of the places."""
    low, high = np.degrees(extremes.least), np.degrees(extremes.largest)
    key, subject = f"{name}.pressure_angle", f"pressure angle of {name}"
    if not high - low > scales.floor("°"):
        return Figure(key, subject, low, "°", place=EVERYWHERE)
    gap = "" if unit == "°" else " "
    places = " and ".join(f"{place * scale:.5g}{gap}{unit}" for place in (extremes.at_least, extremes.at_largest))
    return Figure(key, subject, f"{low:.6g} … {high:.6g}", "°", place=f"at {places}")


def _balanced(run: Run, scales: Scales) -> Iterator[Figure]:
    """The counterweights; without mass there is nothing to balance."""
    weights, left = counterweights(run)
    for weight in weights if np.isfinite(left) else ():
        x, y = scales.zeroed(np.array([weight.x, weight.y]), "kg m")
        place = f"({x:.5g}, {y:.5g})"
        subject = f"counterweight on {weight.link}, mass × position in its frame"
        yield Figure(f"{weight.link}.counterweight", subject, place, "kg m")
    if np.isfinite(left):
        left = float(scales.zeroed(np.array(left), "1"))
        yield Figure("shaking_left", "residual shaking force with counterweights", left, "of its RMS")
