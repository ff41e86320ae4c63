"""What a designer also asks of a planar linkage: does it transmit well, where does it turn back, how does it shake.

Everything is read off one run over the cycle: the poses of the dyads, the twists of the links, the efforts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import plane
from trunnion.algebra.course import Accuracy, Courses, Place
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.panels import CANCELLED, GAUSS_WEIGHTS, INTEGRAL, ON_GAUSS
from trunnion.cycle.course import Mean, course_of, magnitude
from trunnion.cycle.scales import scales_of
from trunnion.errors import Finding, MechanismError, Status
from trunnion.measures.measures import pressure_angles
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import Figure
from trunnion.results.dataset import EVERYWHERE
from trunnion.solve.backward import pose_status
from trunnion.solve.forward import Forward, forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare
from trunnion.solve.switches import Mechanisms, knots_of

Array = NDArray[np.float64]

EXACT = Accuracy(1e-12, 1e-14, shortest=1e-14)  # of the motion alone: dead centres and limits
RESTS = 1e-9  # of the mean rate of a driver: less is none
FAR = 1e4  # sizes of the mechanism: an instant centre farther away lies at infinity
AT_REST = 1e-9  # of the speeds typical of the mechanism: slower than this two links move as one
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
            what = f"a fluctuation of {fluctuation:g} would need an infinite inertia"
            raise MechanismError(Finding(what, "fluctuation", "give a number above 0, such as 0.02"))
        return self.energy_swing / (fluctuation * self.mean_speed**2) if self.mean_speed else float("nan")


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def design(mechanism: Mechanism) -> Design:
    """What a designer asks of a planar linkage: transmission, dead centres, range, shaking, balance, motor.

    Returns
    -------
    Design
        SI and rad. Source: R. L. Norton, Design of Machinery.

    Raises
    ------
    MechanismError
        For a mechanism in space, or if the structure does not determine the motion.
    """
    run = _planar(mechanism)
    motion, driver = _motion(run), next(iter(mechanism.drivers), "")
    angles, extremes = motion.named("pressure angle"), dict[str, Extremes]()
    for name, row in angles.items():
        low, high = (motion.extreme([row], lambda rows: rows[0], motion.assembled, sign) for sign in (-1.0, 1.0))
        times = [0.0 if place.everywhere else place.time for place in (low, high)]
        at = [_coordinate(run, time % run.cycle.duration if run.cycle.periodic else time) for time in times]
        extremes[name] = Extremes(low.value, at[0], high.value, at[1])
    largest = {name: motion.extreme([row], magnitude, motion.assembled).value for name, row in angles.items()}
    force, moment = (
        motion.extreme(motion.rows(kind), magnitude, motion.sound).value for kind in ("shaking force", "shaking moment")
    )
    return Design(
        grashof(mechanism, run), {name: np.pi / 2 - angle for name, angle in largest.items()},
        extremes, dead_centres(run), limits(run),
        force, moment, *(motor(run, driver) if driver else (0.0,) * 4), motion.mean_speed() if driver else 0.0,
    )  # fmt: skip


def _planar(mechanism: Mechanism) -> Run:
    """The mechanism prepared; MechanismError if it is spatial."""
    if mechanism.space != "planar":
        what = "the figures of design (transmission angle, Grashof, instant centres, shaking force) are of the plane"
        raise MechanismError(Finding(what, "space", "use analyse and locking; screw axes are in the report"))
    return prepare(mechanism)


def transmission_angles(walk: Forward) -> dict[str, Array]:
    """Transmission angle of every dyad along the walk, rad in 0 … π/2, by its joints' names: π/2 less |φ|.

    φ is the pressure angle. RRR: between the two links at their common pin, folded to be acute; RRP: between the rod
    and the normal of the guide's path; RPR: between the line of the outer pins and the normal of the slide; PRP and
    RPP: between the two guides.
    """
    return {name: np.pi / 2 - np.abs(angle) for name, angle in pressure_angles(walk).items()}


def shaking(walk: Forward) -> tuple[tuple[Number, Number], Number]:
    """Force (x, y), N, and moment about the ground's origin, N m, that inertia and weightless links put on the frame.

    −Σ m a of all mass centres, and −Σ (r × m a + J α): what the foundation feels of the motion alone.
    """
    values = walk.values
    x: Number = 0.0
    y: Number = 0.0
    turn: Number = 0.0
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


@dataclass(frozen=True)
class Centre:
    """Instant centre of two links over a walk: x, y, m, where they have the same velocity.

    Where it lies at infinity, for the two turn alike, x, y are NaN and `far` is the unit vector (x, y) towards it;
    where they move as one there is neither. `joint`: the revolute that holds the two, in which the centre stays.
    """

    pair: tuple[str, str]
    joint: str | None
    x: Array
    y: Array
    far: tuple[Array, ...] | None


@np.errstate(all="ignore")
def instant_centres(walk: Forward, count: int, most: int) -> list[Centre]:
    """Return the instant centre of each pair of links, those of the ground first.  [Norton, Design of Machinery]

    count: positions of the walk; most: links whose centres against each other are told; of more only those against the
    ground.
    """
    mechanism = walk.system.mechanism
    links = sorted(mechanism.links, key=lambda link: link != mechanism.fixed_link)
    pivots = {frozenset(joint.links): name for name, joint in walk.system.joints.items() if joint.type == "revolute"}
    centres = []
    for pair in combinations(links, 2):
        if len(links) > most and mechanism.fixed_link not in pair:
            continue
        first, two = (walk.motions[link] for link in pair)
        between = plane.minus(two.twist, first.twist)
        # velocity of the second against the first at the second's origin; the centre lies across it
        speeds = plane.velocity_at(between, two.frame[:2])
        numbers = (between.x, between.y, between.w, *speeds, walk.size, walk.pace)
        along, across, turn, vx, vy, size, pace = (
            np.broadcast_to(np.asarray(primal(part), float), (count,)) for part in numbers
        )
        x, y = -across / turn, along / turn
        speed = np.hypot(vx, vy)
        still = (np.abs(turn) <= AT_REST * pace) & (speed <= AT_REST * pace * size)
        away = ~(np.hypot(x, y) <= FAR * size) & (speed > AT_REST * pace * size)
        x, y = (np.where(away | still, np.nan, part) for part in (x, y))
        sign = np.where(turn < 0, -1.0, 1.0)
        far = tuple(np.where(away, part / speed, np.nan) for part in (-sign * vy, sign * vx)) if np.any(away) else None
        centres.append(Centre(pair, pivots.get(frozenset(pair)), x, y, far))
    return centres


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
    if crank not in run.system.joints[b].links:
        b, d = d, b
    if crank not in run.system.joints[b].links or ground not in run.system.joints[d].links:
        return ""
    coupler = next(link for link in run.system.joints[b].links if link != crank)
    rocker = next(link for link in run.system.joints[d].links if link != ground)

    def span(link: str, first: str, two: str) -> float:
        p, q = local[link, first], local[link, two]
        return float(np.hypot(p.x - q.x, p.y - q.y))

    sides = {  # by the type of a four-bar of which that side is the shortest
        "double crank": span(ground, a, d),
        "crank-rocker": span(crank, a, b),
        "double rocker": span(coupler, b, c),
        "rocker-crank": span(rocker, c, d),
    }
    lengths = sorted(sides.values())
    margin = lengths[1] + lengths[2] - lengths[0] - lengths[3]
    if abs(margin) <= 1e-12 * lengths[3]:
        return "change point"
    return "triple rocker" if margin < 0 else min(sides, key=sides.__getitem__)


class _Motion(NamedTuple):
    """The courses of what the motion alone decides; places: the row of each number, by what it is and whose."""

    places: dict[tuple[str, str], int]
    courses: Courses

    def named(self, kind: str) -> dict[str, int]:
        """Rows of a kind of number, by whose they are."""
        return {name: row for (what, name), row in self.places.items() if what == kind}

    def rows(self, kind: str) -> list[int]:
        """The same alone."""
        return list(self.named(kind).values())

    @property
    def assembled(self) -> NDArray[np.bool_]:
        """Panels that have positions."""
        return np.asarray(self.courses.states != Status.NOT_ASSEMBLED)

    @property
    def sound(self) -> NDArray[np.bool_]:
        """Of these the ones away from singular positions, where accelerations have no bound; all if there are none."""
        solved = np.asarray(self.courses.states == Status.SOLVED)
        return solved if np.any(solved) else self.assembled

    def extreme(
        self, rows: list[int], of: Callable[[Array], Array], panels: NDArray[np.bool_], sign: float = 1.0
    ) -> Place:
        """The largest or least value of what is made of some rows, NaN where no panel has one."""
        place = self.courses.picked(np.array(rows)).extreme(of, sign, panels)
        return Place(np.nan, 0.0) if place is None else place

    def mean_speed(self) -> float:
        """Of the first driver, 0 if it rests or turns back."""
        (row,) = self.rows("rate")
        mean, everywhere = float(self.courses.mean()[row]), np.ones(len(self.courses.half), bool)
        least = self.extreme([row], lambda rows: rows[0] * np.sign(mean), everywhere, -1.0)
        return mean if least.value > RESTS * abs(mean) else 0.0


def _motion(run: Run) -> _Motion:
    """The courses of the motion, found once for a run."""
    system, places, scales = run.system, dict[tuple[str, str], int](), scales_of(run)

    def look(time: Array) -> tuple[Array, NDArray[np.intp]]:
        walk = forward(system, run.values, run.chosen.assembly, time)
        numbers = _numbers(walk, time)
        places.update({name: row for row, name in enumerate(numbers)})
        rows = np.array([np.broadcast_to(np.asarray(number, float), time.shape) for number in numbers.values()])
        return rows, pose_status(walk, time.shape).astype(np.intp)

    def like(sizes: Array) -> Array:
        """Forces that cancel are rounding beside the others, as angles are beside a radian."""
        least = {"shaking force": scales.force, "shaking moment": scales.force * scales.length, "pressure angle": 1.0}
        return np.maximum(sizes, [least.get(kind, 0.0) for kind, _ in places])

    def moved() -> _Motion:
        knots = [time for _, time in knots_of(Mechanisms(system, run.chosen.assembly, run.values, [run.cycle]))]
        return _Motion(places, run.courses(look, knots, EXACT, like))

    return run.once("design", moved)


def _numbers(walk: Forward, time: Array) -> dict[tuple[str, str], Number]:
    """What the figures are read of, by what it is and whose: rates, pressure angles, what inertia does.

    Speeds are of the joints on the ground that no driver turns; balance: the force, N, that 1 kg m on each axis of a
    link that turns about the ground puts on it.
    """
    system, driver = walk.system, next(iter(walk.system.mechanism.drivers), "")
    ground, drivers = system.mechanism.fixed_link, system.mechanism.drivers
    numbers: dict[tuple[str, str], Number] = {}
    for name, joint in system.joints.items():
        if ground not in joint.links:
            continue
        if name not in drivers:
            numbers["speed", name] = walk.speed(name)
        if joint.pair.turns:
            link = next(link for link in joint.links if link != ground)
            motion = walk.motions[link]
            frame, w, alpha = motion.frame, motion.twist.w, motion.acceleration.w
            for axis, c, s in (("x", frame.c, frame.s), ("y", -frame.s, frame.c)):  # −(α × r − ω² r) of 1 kg at R p
                numbers["balance", f"{link}.{axis}.x"] = alpha * s + w * w * c
                numbers["balance", f"{link}.{axis}.y"] = w * w * s - alpha * c
    numbers["rate", driver] = system.drive(walk.values, driver, time)[1] if driver else 1.0
    for name, angle in pressure_angles(walk).items():
        numbers["pressure angle", name] = angle
    (numbers["shaking force", "x"], numbers["shaking force", "y"]), numbers["shaking moment", ""] = shaking(walk)
    return numbers


def motor(run: Run, driver: str) -> tuple[float, float, float, float]:
    """Of a driver the RMS of its effort, N m or N; the largest magnitude and the mean of its power, W; the largest
    change of its energy about the mean, J. NaN where positions have no answer."""
    i = list(run.system.mechanism.drivers).index(driver)
    course = course_of(run, FrictionMethod(), names=("drive_effort", "drive_power"))
    power, peak = course.picked("drive_power", i), course.extreme("drive_power", i, of=magnitude)
    square = course.picked("drive_effort", i).mean(np.square)[0]
    value, size = float(power.mean()[0]), float(power.mean(np.abs)[0])
    mean = Mean(value, float(power.error()[0]), size, CANCELLED * size).net
    # the energy is level where the power is the mean, or at an edge
    cut = power.parted(power.passages(0, mean))
    energy = np.cumsum(np.append(0.0, cut.half * (cut.coefficients[:, 0] @ INTEGRAL - 2.0 * mean)))
    return float(np.sqrt(square)), 0.0 if peak is None else peak.value, mean, float(np.ptp(energy))


def dead_centres(run: Run) -> dict[str, tuple[float, ...]]:
    """Drive coordinates (rad, m) at which each link on the ground turns back; times (s) without a driver."""
    motion, courses = _motion(run), _motion(run).courses
    sides, duration = BESIDE * courses.span * np.array([-1.0, 1.0]), run.cycle.duration
    centres: dict[str, tuple[float, ...]] = {}
    for joint, row in motion.named("speed").items():
        passages = courses.passages(row)
        if run.cycle.periodic:  # its end is its start
            passages = np.sort(np.append(np.where(passages > duration * (1 - BESIDE), 0.0, passages), 0.0))
            passages = passages[np.diff(passages, prepend=-duration) > BESIDE * duration]
        around = passages[:, None] + sides
        around = around % duration if run.cycle.periodic else np.clip(around, 0.0, courses.span)
        before, after = courses.picked(np.array([row])).at(around.ravel()).reshape(-1, 2).T
        places = [round(_coordinate(run, time), 12) + 0.0 for time in passages[before * after < 0].tolist()]
        centres[joint] = tuple(sorted(set(places)))
    return centres


def _coordinate(run: Run, moment: float) -> float:
    """Coordinate of the first driver at a time; the time itself if there is none."""
    driver, moment = next(iter(run.system.mechanism.drivers), ""), moment if run.cycle.duration > 0 else 0.0
    return float(run.system.drive(run.values, driver, moment)[0]) if driver else moment


def limits(run: Run) -> tuple[tuple[float, float], ...]:
    """Intervals of the drive coordinate (rad, m) over which the linkage can be assembled."""
    motion, courses = _motion(run), _motion(run).courses
    turns = courses.passages(motion.rows("rate")[0])  # where the drive turns back
    edges = np.flatnonzero(np.diff(np.concatenate([[0], motion.assembled.astype(int), [0]])))
    intervals: list[tuple[float, float]] = []
    for first, after in zip(edges[::2], edges[1::2], strict=True):
        low, high = courses.edges[first], courses.edges[after]
        inside = turns[(turns > low) & (turns < high)]
        ends = [_coordinate(run, float(time)) for time in [low, high]]
        places = [*ends, *(_coordinate(run, float(time)) for time in inside)]
        reached = (min(places), max(places)) if len(inside) else (ends[0], ends[1])
        if not any(np.allclose(reached, other, rtol=1e-9, atol=0) for other in intervals):  # there and back again
            intervals.append(reached)
    return tuple(intervals)


def counterweights(run: Run) -> tuple[tuple[Counterweight, ...], float]:
    """Counterweights on the links that turn about the ground that best cancel the shaking force, and what is left.

    The momentum of the counterweight with mass times place p on link i is ω_i z × R_i p: linear in p. p is found so
    that the total momentum is nearest to constant over the cycle (least squares). The second number is the share of the
    RMS shaking force that remains: 0 to rounding for a four-bar of revolute pairs (Berkof and Lowen 1969).
    Raises MechanismError if no link turns about the ground.
    """
    motion = _motion(run)
    balance = motion.named("balance")
    if not balance:
        raise MechanismError(Finding("no link turns about the ground", "joints", "counterweights need one that does"))
    panels = motion.sound
    weights = np.sqrt(motion.courses.half[panels, None] * GAUSS_WEIGHTS)  # of a time in the mean square
    numbers = np.moveaxis(motion.courses.coefficients[panels] @ ON_GAUSS, 1, 0) * weights
    force = numbers[motion.rows("shaking force")].ravel()
    # per axis of a link its force along x, then along y
    matrix = numbers[list(balance.values())].reshape(len(balance) // 2, -1).T
    links = list(dict.fromkeys(name.rsplit(".", 2)[0] for name in balance))
    solution = np.linalg.lstsq(matrix, -force, rcond=None)[0] if len(force) else np.full(matrix.shape[1], np.nan)
    size = float(np.linalg.norm(force))
    left = np.linalg.norm(force + matrix @ solution) / size if size > 0 else float("nan")
    pairs = zip(links, solution.reshape(-1, 2).tolist(), strict=True)
    return tuple(Counterweight(link, x, y) for link, (x, y) in pairs), float(left)


def report_figures(mechanism: Mechanism, fluctuation: float = 0.05) -> list[Figure]:
    """The figures that one looks at first."""
    run = _planar(mechanism)
    answer, scales = design(mechanism), scales_of(run)
    driver = next(iter(mechanism.drivers), "")
    turns = not driver or run.system.turns(driver)
    unit, scale = ("°", 180 / np.pi) if turns else ("mm", 1e3)
    figures = [Figure("grashof", "four-bar type (Grashof)", answer.grashof)] if answer.grashof else []
    for name, angle in answer.transmission_angle.items():
        subject = f"transmission angle of {name}"
        figures.append(Figure(f"{name}.transmission_angle", subject, angle * 180 / np.pi, "°", "minimum"))
    for name, extremes in answer.pressure_angle.items():
        low, high = np.degrees(extremes.least), np.degrees(extremes.largest)
        at = scales.zeroed(scale * np.array([extremes.at_least, extremes.at_largest]), unit)
        ends = " and ".join(f"{place:.5g}{'' if unit == '°' else ' '}{unit}" for place in at.tolist())
        varies = high - low > scales.floor("°")
        value, where = (f"{low:.6g} … {high:.6g}", f"at {ends}") if varies else (low, EVERYWHERE)
        figures.append(Figure(f"{name}.pressure_angle", f"pressure angle of {name}", value, "°", place=where))
    for name, places in answer.dead_centres.items():
        if places:
            text = ", ".join(f"{place * scale:.6g}" for place in places)
            figures.append(Figure(f"{name}.dead_centres", f"dead centres of {name}", text, f"{unit} of {driver}"))
    text = ", ".join(f"{low * scale:.6g} … {high * scale:.6g}" for low, high in answer.limits) or "no position"
    within = "" if run.cycle.periodic else "within the stated motion"
    start = f"it starts at {_coordinate(run, 0.0) * scale:.6g}{unit}" * (len(answer.limits) > 1 and bool(driver))
    figures += [
        Figure("limits", "range of assembly", text, f"{unit} of {driver}" if driver else "", within, note=start),
        Figure("shaking_force", "shaking force", answer.shaking_force, "N", "maximum"),
        Figure("shaking_moment", "shaking moment about the ground's origin", answer.shaking_moment, "N m", "maximum"),
        Figure("effort_rms", "drive effort", answer.rms_effort, "N m" if turns else "N", "RMS"),
        Figure("peak_power", "drive power", answer.peak_power, "W", "maximum"),
        Figure("mean_power", "drive power", answer.mean_power, "W", "mean"),
        Figure("energy_swing", "energy swing about the mean", answer.energy_swing, "J"),
    ]
    if turns and driver and run.cycle.periodic and answer.mean_speed:
        subject = f"flywheel for a fluctuation of {fluctuation:g}"
        figures.append(Figure("flywheel", subject, answer.flywheel(fluctuation), "kg m^2"))
    if any(joint.pair.turns and mechanism.fixed_link in joint.links for joint in run.system.joints.values()):
        weights, left = counterweights(run)
        if np.isfinite(left):  # without mass there is nothing to balance
            for weight in weights:
                x, y = scales.zeroed(np.array([weight.x, weight.y]), "kg m")
                subject = f"counterweight on {weight.link}, mass × position in its frame"
                figures.append(Figure(f"{weight.link}.counterweight", subject, f"({x:.5g}, {y:.5g})", "kg m"))
            left, subject = float(scales.zeroed(np.array(left), "1")), "residual shaking force with counterweights"
            figures.append(Figure("shaking_left", subject, left, "of its RMS"))
    return scales.of_figures(figures)
