"""Random spatial mechanisms let go, beside SciPy on the Newton-Euler equations of all their links.

The mechanisms of `benchmarks.drawn.spatial` without friction, moved by gravity, forces, moments and, of half of them,
a spring with a damper. The joints act by the principle of Gauss: of all accelerations that they allow, the links take
those nearest to the free ones in the norm of their masses. Redundant constraints so need no choice.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp

import trunnion
from benchmarks.drawn.spatial import drawn
from benchmarks.judged.elements import (
    AXES,
    MATRIX,
    SQUARE,
    Element,
    along,
    cosine,
    cross,
    dot,
    element,
    matrix,
    unrolled,
)
from benchmarks.judged.verdict import Array, Data

LIMIT = 1e-7  # of the mechanism's size, and of the largest spin
TOLERANCE = 1e-10
STEPS = 60
MOST = 5_000  # evaluations of a motion: a stiff one is left out
DEPENDENT = 1e-9  # singular values below this part of the largest are redundant constraints

__all__ = ["LIMIT", "NewtonEuler", "examine", "free"]


def free(seed: int) -> Data | None:
    """A mechanism without friction whose one crank moves freely; None if a slide or several drivers move it."""
    _, data = drawn(seed)
    ((name, driver), *others) = data["drivers"].items()
    rows = data["loop"] if "loop" in data else list(data["joints"].values())
    kinds = {row["joint"]: row["type"] for row in rows} if "loop" in data else {
        key: joint["type"] for key, joint in data["joints"].items()
    }  # fmt: skip
    if others or kinds[name] != "revolute":
        return None
    for row in rows:
        row.pop("friction", None)
    data["loads"] = {key: load for key, load in data["loads"].items() if "joint" not in load}
    for load in data["loads"].values():
        if "loop" not in data and _spins(data, load["link"]):
            load.pop("frame", None)  # which way such a link has spun is a rule of each, see `mobility.spin`
    rng = np.random.default_rng([20_30, seed])
    begin = driver["range"][0] if "range" in driver else driver["start"]
    speed = float(driver["speed"])
    initial = {"coordinate": begin, "speed": speed * float(rng.choice([0.3, 1.0]))}
    data["drivers"] = {name: {"start": begin, "speed": speed, "free": True, "initial": initial}}
    if "loop" not in data and rng.random() < 0.5:
        _sprung(data, rng, abs(speed))
    return data


def _spins(data: Data, link: str) -> bool:
    """Whether a link can turn about the line of two balls without moving anything else."""
    return sum(link in joint["links"] and joint["type"] == "spherical" for joint in data["joints"].values()) > 1


def _sprung(data: Data, rng: np.random.Generator, pace: float) -> None:
    """A spring with a damper from a moving link to a joint's point on the ground."""
    ends = [(link, body) for link, body in data["links"].items() if link != "ground" and "grip" in body["points"]]
    link, body = ends[int(rng.integers(len(ends)))]
    point = next(iter(data["links"]["ground"]["points"]))
    stiffness = float(body["mass"]) * pace**2 * float(rng.uniform(0.1, 1.0))
    data["springs"] = {
        "spring": {
            "between": [f"ground.{point}", f"{link}.grip"],
            "stiffness": stiffness,
            "free_length": float(np.linalg.norm(data["assembly"][f"{link}.grip"])) * float(rng.uniform(0.3, 1.0)),
            "damping": 0.3 * stiffness / pace,
        }
    }


class NewtonEuler:
    """Every link by itself: place of its mass centre, unit quaternion, velocity and spin, all in global axes."""

    def __init__(self, data: Data, first: xr.Dataset) -> None:
        """first: a result whose first position is the pose in which the motion begins."""
        self.data = data
        self.bodies: dict[str, Data] = dict(data["links"])
        if "loop" in data:
            self.joints, self.local = unrolled(data)
        else:
            self.joints = data["joints"]
            self.local = {
                (link, name): element(self.bodies[link]["points"][name])
                for name, joint in self.joints.items()
                for link in joint["links"]
            }
        self.links = [name for name in self.bodies if name != "ground"]
        self.mass = {name: float(self.bodies[name].get("mass", 0.0)) for name in self.links}
        self.centre = {name: np.asarray(self.bodies[name].get("centre", np.zeros(3)), float) for name in self.links}
        self.centre["ground"] = np.zeros(3)
        self.inertia = {name: self._about_centre(name) for name in self.links}
        places, turns = [], []
        for name in self.links:
            q = first["link_rotation"].sel(link=name).values[:, 0]
            axes = matrix(q).T
            places.append(first["link_position"].sel(link=name).values[:, 0] + axes @ self.centre[name])
            turns.append(q)
        self.places, self.turns = np.array(places), np.array(turns)

    def _about_centre(self, link: str) -> Array:
        body, c = self.bodies[link], self.centre[link]
        inertia = np.array([[float(body["inertia"][key]) for key in row] for row in MATRIX])
        if body.get("inertia_about") == "origin":
            inertia = inertia - self.mass[link] * (c @ c * np.eye(3) - np.outer(c, c))
        return inertia

    def element(self, link: str, joint: str, pose: dict[str, tuple[Array, ...]], rates: Array) -> Element:
        """A joint's frame on a link, for every column of accelerations in rates."""
        place, axes = self.local[link, joint]
        if link == "ground":
            still = np.zeros((3, 1))
            return Element(axes[:, :, None], place[:, None], still, still, still, still)
        centre, turn, velocity, spin = pose[link]
        i = 6 * self.links.index(link)
        r, w = (turn @ (place - self.centre[link]))[:, None], spin[:, None]
        a, rate = rates[i : i + 3], rates[i + 3 : i + 6]
        inward = cross(w, cross(w, r))
        return Element((axes @ turn.T)[:, :, None], centre[:, None] + r, velocity[:, None] + cross(w, r),
                       a + cross(rate, r) + inward, w, rate)  # fmt: skip

    def constraints(self, pose: dict[str, tuple[Array, ...]]) -> tuple[Array, Array]:
        """J and γ of J a = γ: the second derivatives of what the joints hold, at no and at unit accelerations."""
        count = 6 * len(self.links)
        rates = np.hstack([np.zeros((count, 1)), np.eye(count)])
        rows = []
        for name, joint in self.joints.items():
            one, two = (self.element(link, name, pose, rates) for link in joint["links"])
            kind = joint["type"]
            rows += [along(one, two, k)[2] for k in AXES.get(kind, (0, 1, 2))]
            rows += [cosine(one, two, i, k)[2] for i, k in SQUARE[kind]]
            if kind == "helical":
                z, dz, _ = one.vector(2)
                turn = dot(dz, two.spin - one.spin) + dot(z, two.spin_rate - one.spin_rate)
                rows.append(along(one, two, 2)[2] - joint["pitch"] / (2 * np.pi) * turn)
        table = np.array(rows)
        jacobian = table[:, 1:] - table[:, :1]
        scale = np.linalg.norm(jacobian, axis=1)
        scale[scale == 0] = 1.0  # a row that holds nothing at this pose
        return jacobian / scale[:, None], -table[:, 0] / scale

    def pose(self, row: Array) -> dict[str, tuple[Array, ...]]:
        """Of a state: centre, matrix of rotation, velocity and spin of every link."""
        found = {"ground": (np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3))}
        for name, s in zip(self.links, row.reshape(-1, 13), strict=True):
            found[name] = s[:3], matrix(s[3:7] / np.linalg.norm(s[3:7])).T, s[7:10], s[10:13]
        return found

    def applied(self, pose: dict[str, tuple[Array, ...]]) -> Array:
        """Forces and moments about the mass centres: gravity, gyroscopic moments, loads, springs with dampers."""
        q = np.zeros((len(self.links), 6))
        gravity = np.asarray(self.data.get("gravity", np.zeros(3)), float)
        for i, name in enumerate(self.links):
            _, turn, _, spin = pose[name]
            q[i, :3] = self.mass[name] * gravity
            q[i, 3:] = -np.cross(spin, turn @ self.inertia[name] @ turn.T @ spin)
        for load in self.data["loads"].values():
            force, moment = (np.asarray(load.get(key, np.zeros(3)), float) for key in ("force", "moment"))
            turn = pose[load["link"]][1] if load.get("frame") == "link" else np.eye(3)
            self._push(q, load["link"], self._arm(pose, load["link"], load["at"]), turn @ force, turn @ moment)
        for spring in self.data.get("springs", {}).values():
            ends = [end.rsplit(".", 1) for end in spring["between"]]
            arms = [self._arm(pose, link, point) for link, point in ends]
            states = [pose[link] for link, _ in ends]
            d = states[1][0] + arms[1] - states[0][0] - arms[0]
            moves = [s[2] + np.cross(s[3], r) for s, r in zip(states, arms, strict=True)]
            length = float(np.linalg.norm(d))
            pull = spring["stiffness"] * (length - spring["free_length"])
            pull += spring["damping"] * float(d @ (moves[1] - moves[0])) / length
            for (link, _), arm, sign in zip(ends, arms, (1.0, -1.0), strict=True):
                self._push(q, link, arm, sign * pull * d / length, np.zeros(3))
        return q.ravel()

    def _arm(self, pose: dict[str, tuple[Array, ...]], link: str, point: str) -> Array:
        stated = self.bodies[link]["points"][point]
        local = np.asarray(stated["at"] if isinstance(stated, dict) else stated, float)
        return np.asarray(pose[link][1] @ (local - self.centre[link]))

    def _push(self, q: Array, link: str, arm: Array, force: Array, moment: Array) -> None:
        if link != "ground":
            q[self.links.index(link)] += np.concatenate([force, moment + np.cross(arm, force)])

    def derivative(self, row: Array) -> Array:
        """Of a state."""
        pose = self.pose(row)
        roots = np.zeros((6 * len(self.links), 6 * len(self.links)))  # L⁻ᵀ of the masses M = L Lᵀ
        for i, name in enumerate(self.links):
            turn = pose[name][1]
            roots[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = np.eye(3) / np.sqrt(self.mass[name])
            lower = np.linalg.cholesky(turn @ self.inertia[name] @ turn.T)
            roots[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = np.linalg.inv(lower).T
        jacobian, right = self.constraints(pose)
        unbound = roots @ (roots.T @ self.applied(pose))
        weighted = jacobian @ roots
        scale = np.linalg.norm(weighted, axis=1)
        scale[scale == 0] = 1.0
        change = np.linalg.lstsq(weighted / scale[:, None], (right - jacobian @ unbound) / scale, rcond=DEPENDENT)[0]
        rates = (unbound + roots @ change).reshape(-1, 6)
        state, out = row.reshape(-1, 13), np.zeros((len(self.links), 13))
        out[:, :3], out[:, 7:] = state[:, 7:10], rates
        w, v, spin = state[:, 3:4], state[:, 4:7], state[:, 10:13]
        out[:, 3:4] = -0.5 * np.sum(spin * v, axis=1, keepdims=True)
        out[:, 4:7] = 0.5 * (w * spin + np.cross(spin, v))
        return out.ravel()

    def drive(self, row: Array, joint: str) -> Array:
        """The row of the crank's speed in the velocities of all links."""
        one, two = self.joints[joint]["links"]
        pose, found = self.pose(row), np.zeros((len(self.links), 6))
        axis = pose[two][1] @ self.local[two, joint][1][2]
        for link, sign in ((two, 1.0), (one, -1.0)):
            if link != "ground":
                found[self.links.index(link), 3:] += sign * axis
        return found.ravel()

    def begin(self, joint: str, speed: float) -> Array:
        """The state in which the motion begins; a spin that nothing holds is none."""
        still = np.hstack([self.places, self.turns, np.zeros((len(self.links), 6))])
        rows = np.vstack([self.constraints(self.pose(still.ravel()))[0], self.drive(still.ravel(), joint)])
        right = np.append(np.zeros(len(rows) - 1), speed)
        still[:, 7:] = np.linalg.lstsq(rows, right, rcond=DEPENDENT)[0].reshape(-1, 6)
        return still.ravel()


def _integrated(system: NewtonEuler, joint: str, speed: float, duration: float) -> Any:
    """SciPy's solution, to where the crank comes to rest at most; TimeoutError for a stiff motion."""
    begin, evaluations = system.begin(joint, speed), itertools.count()

    def derivative(_: float, row: Array) -> Array:
        if next(evaluations) > MOST:
            raise TimeoutError
        return system.derivative(row)

    def rate(_: float, row: Array) -> float:
        return float(system.drive(row, joint) @ row.reshape(-1, 13)[:, 7:].ravel()) * np.sign(speed)

    rate.terminal = True  # type: ignore[attr-defined]
    state = np.abs(begin.reshape(-1, 13))
    size = np.repeat(
        [np.max(state[:, part]) for part in (np.s_[:3], np.s_[3:7], np.s_[7:10], np.s_[10:])], (3, 4, 3, 3)
    )
    allowed = TOLERANCE * np.tile(size, len(state))
    options: Any = {"rtol": TOLERANCE, "atol": allowed, "events": rate, "dense_output": True}
    return solve_ivp(derivative, (0.0, duration), begin, "DOP853", **options)


def _off(system: NewtonEuler, solution: Any, result: xr.Dataset) -> float:
    """The largest difference of places by the mechanism's size and of spins by the largest, as far as the result goes.

    The places of each link are its joints and its mass centre: how a link is turned about the line of two balls is no
    matter of its motion.
    """
    rows = solution.sol(result["time"].values).reshape(len(system.links), 13, -1)
    most, size, differences = float(np.max(np.abs(rows[:, 10:]))), 0.0, []
    solved = np.isfinite(result["link_position"].values[0, 0])
    for link, row in zip(system.links, rows, strict=True):
        spin = result["link_angular_velocity"].sel(link=link).values - row[10:]
        origin, axes = (result[name].sel(link=link).values for name in ("link_position", "link_rotation"))
        turns = [np.einsum("ij...->ji...", matrix(q / np.linalg.norm(q, axis=0))) for q in (axes, row[3:7])]
        local = [place for (body, _), (place, _) in system.local.items() if body == link] + [system.centre[link]]
        arms = np.array(local) - system.centre[link]
        shown = origin + np.einsum("ijt,kj->kit", turns[0], np.array(local))
        own = row[:3] + np.einsum("ijt,kj->kit", turns[1], arms)
        size = max(size, float(np.max(np.abs(own - own.mean(axis=(0, 2), keepdims=True)))))
        differences.append((np.max(np.abs(spin[:, solved])) / most, np.max(np.abs((shown - own)[..., solved]))))
    spins, places = np.max(differences, axis=0)
    return float(max(spins, places / size))


def examine(seed: int) -> tuple[str, float]:
    """What a seed came to, and the largest difference: see `_off`."""
    data = free(seed)
    if data is None:
        return "not of these equations", 0.0
    ((name, driver),) = data["drivers"].items()
    duration = (0.5 if "loop" not in data else 2.0) / abs(float(driver["speed"]))
    try:
        mechanism = trunnion.Mechanism(**data)
        first = trunnion.simulate(mechanism, duration * 1e-3, 1, tolerance=TOLERANCE)
        if not np.all(np.isfinite(first["link_position"].values[..., 0])):
            return "does not begin: " + ", ".join(finding.code for finding in first.trunnion.findings), 0.0
        system = NewtonEuler(data, first)
        own = _integrated(system, name, float(driver["initial"]["speed"]), duration)
    except trunnion.MechanismError as error:
        return f"refused: {error.findings[0].what}"[:60], 0.0
    except (TimeoutError, np.linalg.LinAlgError):
        return "stiff", 0.0
    end = 0.9 * own.t[-1]
    if not end > 1e-3 * duration:
        return "ends at once", 0.0
    result = trunnion.simulate(mechanism, end, STEPS, tolerance=TOLERANCE)
    solved = np.isfinite(result["link_position"].values[0, 0])
    if not np.any(solved[1:]):
        return "ends at once", 0.0
    return "compared" if np.all(solved) else "compared up to its end", _off(system, own, result)
