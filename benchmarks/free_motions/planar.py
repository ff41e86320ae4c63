"""Random planar mechanisms let go, beside SciPy on the equations of all their links.

The mechanisms of `benchmarks.drawn.planar` whose one crank is let go from rest or from a speed: gravity, forces,
springs, dampers and friction in pins and guides move them. The equations have Lagrange multipliers for the joints, and
friction by its law from these (index 1, in the coordinates of every link).
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp

import trunnion
from benchmarks.drawn.planar import drawn
from benchmarks.judged.planar import cross, quarter, turned
from benchmarks.judged.verdict import Array, Data, friction_of, slope

LIMIT = 1e-6  # rad, and of the largest rate
TOLERANCE = 1e-10
STEPS = 60
ROUNDS = 60  # of friction and multipliers at one moment
SETTLED = 1e-13
STILL = 1e-11  # of the largest spin
MOST = 5_000  # evaluations of a motion: a stiff one is left out

__all__ = ["AllLinks", "examine", "free"]


def free(seed: int) -> Data | None:
    """A mechanism of one crank that moves freely; None for what these equations leave out."""
    _, data = drawn(seed)
    drivers = data["drivers"]
    resists = any("joint" in load for load in data.get("loads", {}).values())
    if len(drivers) != 1 or "gears" in data or resists:
        return None
    ((name, driver),) = drivers.items()
    if data["joints"][name]["type"] != "revolute" or "start" not in driver:
        return None
    rng = np.random.default_rng([20_29, seed])
    if all("inertia" not in link for link in data["links"].values()):
        return None
    speed = driver["speed"] * float(rng.choice([0.3, 1.0]))
    data["drivers"] = {name: {**driver, "free": True, "initial": {"coordinate": driver["start"], "speed": speed}}}
    return data


class AllLinks:
    """The equations of motion of every link by itself, x = (place of the mass centre, angle) of each.

    M ẍ = Q + Jᵀ λ + friction, J ẍ = γ. Friction of a pin is radius · μ(slip) · |R| against its turning, of a guide
    μ(slip) times the loads of its two ends, both of the multipliers; the two are settled in rounds.
    """

    def __init__(self, data: Data, pose: dict[str, tuple[Array, float]]) -> None:
        """pose: place of the origin and angle of every link where the motion begins."""
        self.data = data
        self.links = [name for name in data["links"] if name != "ground"]
        self.centre = {name: np.asarray(link.get("centre", (0.0, 0.0)), float) for name, link in data["links"].items()}
        self.mass = np.zeros(3 * len(self.links))
        for i, name in enumerate(self.links):
            link, c = data["links"][name], self.centre[name]
            mass, inertia = float(link.get("mass", 0.0)), float(link.get("inertia", 0.0))
            if link.get("inertia_about") == "origin":
                inertia -= mass * float(c @ c)
            self.mass[3 * i : 3 * i + 3] = mass, mass, inertia
        self.begin = np.concatenate([[*(pose[name][0] + turned(pose[name][1], self.centre[name])), pose[name][1]]
                                     for name in self.links])  # fmt: skip
        self.gravity = np.asarray(data.get("gravity", (0.0, 0.0)), float)
        self.start = {name: self.turn(self.begin, name) for name in data["joints"]}
        self.multipliers: Array | None = None

    # ---- places and speeds --------------------------------------------------------------------------------------

    def of(self, x: Array, link: str) -> Array:
        """The three numbers of a link, of the ground its place."""
        if link == "ground":
            return np.zeros(3)
        i = self.links.index(link)
        return x[3 * i : 3 * i + 3]

    def arm(self, x: Array, link: str, local: Any) -> Array:
        """From the mass centre to a place of the link, turned."""
        centre = np.zeros(2) if link == "ground" else self.centre[link]
        return turned(self.of(x, link)[2], np.asarray(local, float) - centre)

    def local(self, link: str, point: str) -> Any:
        stated = self.data["links"][link]["points"][point]
        return stated["at"] if isinstance(stated, dict) else stated

    def axis(self, x: Array, link: str, joint: str) -> Array:
        return turned(self.of(x, link)[2], np.asarray(self.data["links"][link]["points"][joint]["axis"], float))

    def place(self, x: Array, link: str, point: str) -> Array:
        return self.of(x, link)[:2] + self.arm(x, link, self.local(link, point))

    def speed(self, x: Array, v: Array, link: str, point: str) -> Array:
        own = self.of(v, link)
        return own[:2] + own[2] * quarter(self.arm(x, link, self.local(link, point)))

    def turn(self, x: Array, joint: str) -> float:
        first, second = self.data["joints"][joint]["links"]
        return float(self.of(x, second)[2] - self.of(x, first)[2])

    # ---- equations ------------------------------------------------------------------------------------------------

    def put(self, row: Array, link: str, part: Any) -> None:
        if link != "ground":
            i = self.links.index(link)
            row[3 * i : 3 * i + 3] += part

    def joints(self, x: Array, v: Array) -> tuple[Array, Array, list[tuple[str, Array]]]:
        """J, γ and the rows of each joint, whose multipliers act on the second link."""
        rows, right, of = [], [], []
        for name, joint in self.data["joints"].items():
            one, two = joint["links"]
            arms = {link: self.arm(x, link, self.local(link, name)) for link in (one, two)}
            inward = {link: -(self.of(v, link)[2] ** 2) * arms[link] for link in (one, two)}
            if joint["type"] == "revolute":
                for k, e in enumerate(np.eye(2)):
                    row = np.zeros(len(x))
                    for link, sign in ((two, 1.0), (one, -1.0)):
                        self.put(row, link, sign * np.array([*e, e @ quarter(arms[link])]))
                    rows.append(row)
                    right.append(-(inward[two] - inward[one])[k])
                of.append((name, np.arange(len(rows) - 2, len(rows))))
                continue
            a, d = self.axis(x, one, name), self.place(x, two, name) - self.place(x, one, name)
            n, w = quarter(a), self.of(v, one)[2]
            apart = self.speed(x, v, two, name) - self.speed(x, v, one, name)
            row = np.zeros(len(x))
            self.put(row, two, np.array([*n, n @ quarter(arms[two])]))
            self.put(row, one, -np.array([*n, n @ quarter(arms[one]) + a @ d]))
            rows.append(row)
            right.append(-(n @ (inward[two] - inward[one]) - 2 * w * (a @ apart) - w**2 * (n @ d)))
            row = np.zeros(len(x))
            self.put(row, two, np.array([0.0, 0.0, 1.0]))
            self.put(row, one, np.array([0.0, 0.0, -1.0]))
            rows.append(row)
            right.append(0.0)
            of.append((name, np.arange(len(rows) - 2, len(rows))))
        return np.array(rows), np.array(right), of

    def applied(self, x: Array, v: Array) -> Array:
        """Gravity, forces, moments, springs and dampers."""
        q = np.zeros(len(x))
        for i in range(len(self.links)):
            q[3 * i : 3 * i + 2] += self.mass[3 * i] * self.gravity
        for load in self.data.get("loads", {}).values():
            link, force = load["link"], np.asarray(load.get("force", (0.0, 0.0)), float)
            if load.get("frame") == "link":
                force = turned(self.of(x, link)[2], force)
            self.push(q, x, link, load["at"], force, float(load.get("moment", 0.0)))
        for spring in self.data.get("springs", {}).values():
            self.pull(q, x, v, spring)
        return q

    def push(self, q: Array, x: Array, link: str, point: str, force: Array, moment: float = 0.0) -> None:
        self.put(q, link, np.array([*force, cross(self.arm(x, link, self.local(link, point)), force) + moment]))

    def pull(self, q: Array, x: Array, v: Array, spring: Data) -> None:
        k, c = float(spring["stiffness"]), float(spring.get("damping", 0.0))
        if "between" in spring:
            (a, at), (b, to) = (end.rsplit(".", 1) for end in spring["between"])
            d = self.place(x, b, to) - self.place(x, a, at)
            length = float(np.hypot(*d))
            along = d / length
            rate = float(along @ (self.speed(x, v, b, to) - self.speed(x, v, a, at)))
            force = (k * (length - float(spring["free_length"])) + c * rate) * along
            self.push(q, x, a, at, force)
            self.push(q, x, b, to, -force)
            return
        name = spring["joint"]
        one, two = self.data["joints"][name]["links"]
        if self.data["joints"][name]["type"] == "revolute":
            begin = self.start[name] - float(spring.get("free_angle", 0.0))  # of all turns that nearest to the free one
            wound = float(np.arctan2(np.sin(begin), np.cos(begin))) + self.turn(x, name) - self.start[name]
            torque = k * wound + c * (self.of(v, two)[2] - self.of(v, one)[2])
            self.put(q, two, np.array([0.0, 0.0, -torque]))
            self.put(q, one, np.array([0.0, 0.0, torque]))
            return
        a = self.axis(x, one, name)
        slide = float(a @ (self.place(x, two, name) - self.place(x, one, name)))
        rate = float(a @ (self.speed(x, v, two, name) - self.speed(x, v, one, name)))
        force = (k * (slide - float(spring.get("free_length", 0.0))) + c * rate) * a
        self.push(q, x, two, name, -force)
        self.along_guide(q, x, one, two, name, force)

    def along_guide(self, q: Array, x: Array, one: str, two: str, name: str, force: Array) -> None:
        """A force on the first link of a guide at the place where the second link's point is now."""
        if one != "ground":
            self.put(q, one, np.array([*force, cross(self.place(x, two, name) - self.of(x, one)[:2], force)]))

    def friction(self, x: Array, v: Array, multipliers: Array, of: list[tuple[str, Array]]) -> Array:
        q = np.zeros(len(x))
        for name, rows in of:
            joint = self.data["joints"][name]
            law = friction_of(joint, self.data.get("joint_defaults"))
            if law is None:
                continue
            (one, two), own = joint["links"], multipliers[rows]
            if joint["type"] == "revolute":
                radius = float(joint["pin"]["radius"])
                rate = self.of(v, two)[2] - self.of(v, one)[2]
                if abs(rate) <= STILL * float(np.max(np.abs(v[2::3]))):
                    continue  # neither link can turn: the rate is rounding
                torque = float(slope(law, np.array(radius * rate))) * radius * float(np.hypot(*own))
                self.put(q, two, np.array([0.0, 0.0, torque]))
                self.put(q, one, np.array([0.0, 0.0, -torque]))
                continue
            a = self.axis(x, one, name)
            across, couple = float(own[0]), float(own[1]) / float(joint["guide"]["length"])
            load = abs(across / 2 + couple) + abs(across / 2 - couple)
            rate = float(a @ (self.speed(x, v, two, name) - self.speed(x, v, one, name)))
            force = float(slope(law, np.array(rate))) * load * a
            self.push(q, x, two, name, force)
            self.along_guide(q, x, one, two, name, -force)
        return q

    def accelerations(self, x: Array, v: Array) -> Array:
        """ẍ; NaN where friction and multipliers do not settle."""
        jacobian, right, of = self.joints(x, v)
        applied, count = self.applied(x, v), len(x)
        matrix = np.block([[np.diag(self.mass), -jacobian.T], [jacobian, np.zeros((len(right), len(right)))]])
        scale = np.concatenate([np.maximum(self.mass, np.max(self.mass) * 1e-9), np.ones(len(right))])
        multipliers = np.zeros(len(right)) if self.multipliers is None else self.multipliers
        for _ in range(ROUNDS):
            rubbed = self.friction(x, v, multipliers, of)
            found = np.linalg.solve(matrix / scale[:, None], np.concatenate([applied + rubbed, right]) / scale)
            change = float(np.max(np.abs(found[count:] - multipliers)))
            multipliers = found[count:]
            if change <= SETTLED * float(np.max(np.abs(multipliers))):
                self.multipliers = multipliers
                return found[:count]
        return np.full(count, np.nan)


def _posed(data: Data, result: xr.Dataset) -> AllLinks:
    """The equations in the pose in which a result begins."""
    pose = {}
    for link in data["links"]:
        if link != "ground":
            point, stated = next(iter(data["links"][link]["points"].items()))
            local = np.asarray(stated["at"] if isinstance(stated, dict) else stated, float)
            angle = float(result["link_angle"].sel(link=link)[0])
            at = np.ravel(result["point_position"].sel(point=f"{link}.{point}").values[..., 0])[:2]
            pose[link] = at - turned(angle, local), angle
    return AllLinks(data, pose)


def _integrated(system: AllLinks, name: str, speed: float, duration: float) -> Any:
    """SciPy's solution, to where the crank comes to rest at most; TimeoutError for a stiff motion."""
    x, count, evaluations = system.begin, len(system.begin), itertools.count()
    one, two = system.data["joints"][name]["links"]
    drive = np.zeros(count)
    system.put(drive, two, np.array([0.0, 0.0, 1.0]))
    system.put(drive, one, np.array([0.0, 0.0, -1.0]))
    jacobian = system.joints(x, np.zeros(count))[0]
    v, *_ = np.linalg.lstsq(np.vstack([jacobian, drive]), np.append(np.zeros(len(jacobian)), speed), rcond=None)

    def derivative(_: float, row: Array) -> Array:
        if next(evaluations) > MOST:
            raise TimeoutError
        return np.concatenate([row[count:], system.accelerations(row[:count], row[count:])])

    def rate(_: float, row: Array) -> float:
        return float(drive @ row[count:]) * np.sign(speed)

    rate.terminal = True  # type: ignore[attr-defined]
    allowed = TOLERANCE * np.concatenate([np.abs(x) + 1e-3, np.abs(v) + 1e-3])
    options: Any = {"rtol": TOLERANCE, "atol": allowed, "events": rate, "dense_output": True}
    with np.errstate(all="ignore"):
        return solve_ivp(derivative, (0.0, duration), np.concatenate([x, v]), "DOP853", **options)


def _off(system: AllLinks, solution: Any, result: xr.Dataset) -> float:
    """The largest difference of angles, rad, and of rates by the largest rate, as far as the result goes."""
    rows, count, worst = solution.sol(result["time"].values), len(system.begin), 0.0
    solved = np.isfinite(result["link_angle"].values[0])
    most = float(np.max(np.abs(rows[count + 2 :: 3])))
    for k, link in enumerate(system.links):
        turn = np.angle(np.exp(1j * (result["link_angle"].sel(link=link).values - rows[3 * k + 2])))
        spin = (result["link_angle_velocity"].sel(link=link).values - rows[count + 3 * k + 2]) / most
        worst = max(worst, float(np.max(np.abs(turn[solved]))), float(np.max(np.abs(spin[solved]))))
    return worst


def examine(seed: int) -> tuple[str, float]:
    """What a seed came to, and the largest difference: see `_off`."""
    data = free(seed)
    if data is None:
        return "not of these equations", 0.0
    ((name, driver),) = data["drivers"].items()
    duration = 2.0 / abs(float(driver["speed"]))
    try:
        mechanism = trunnion.Mechanism(**data)
        first = trunnion.simulate(mechanism, duration * 1e-3, 1, tolerance=TOLERANCE)
        if not np.all(np.isfinite(first["link_angle"].values[:, 0])):
            return "does not begin: " + ", ".join(one.code for one in first.trunnion.findings), 0.0
        system = _posed(data, first)
        own = _integrated(system, name, float(driver["initial"]["speed"]), duration)
    except trunnion.MechanismError as error:
        return f"refused: {error.findings[0].what}"[:60], 0.0
    except (TimeoutError, np.linalg.LinAlgError):
        return "stiff, or friction and multipliers do not settle", 0.0
    end = 0.9 * own.t[-1]
    if not end > 1e-3 * duration:
        return "ends at once", 0.0
    found = trunnion.simulate(mechanism, end, STEPS, tolerance=TOLERANCE)
    solved = np.isfinite(found["link_angle"].values[0])
    if not np.any(solved[1:]):
        return "ends at once", 0.0
    return "compared" if np.all(solved) else "compared up to its end", _off(system, own, found)
