"""Mechanisms nobody drew: grown at random from drivers and groups of pins and slides, built in a known pose.

Each is checked as a whole: the plan, the assembly that the hints name, closure, derivatives, the Newton–Euler
equations of all links, the balance of power, and the two ways of settling friction.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest
import test_newton_euler as oracle

import trunnion
from brief import brief
from mechanisms import KIND, Data, transformed
from reference import newton_euler
from trunnion import FrictionMethod, Mechanism, Status
from trunnion.solve.run import prepare

SEEDS = range(16)
GROWN = ("R", "P", "RRR", "RRP", "PRR", "RPR", "PRP", "RPP", "PPR", "R[P]RR", "RR[R]R", "triad", "triad with slides")


class Grower:
    """Adds links in random poses, and joints at random places between them, until it is a mechanism."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.pose: dict[str, tuple[float, float, float]] = {"ground": (0.0, 0.0, 0.0)}
        self.data: Data = {
            "links": {"ground": {"points": {}}},
            "joints": {},
            "drivers": {},
            "loads": {},
            "assembly": {},
            "gravity": [float(n) for n in self.rng.normal(0, 5, 2)],
            "joint_defaults": {"pin": {"radius": 0.01}, "guide": {"length": 0.8}, "friction": 0.08},
        }
        for _ in range(self.rng.integers(2, 5)):
            bases = list(self.pose)
            self.grow(str(self.rng.choice(GROWN if len(bases) > 1 else GROWN[:2])), bases)
        self.data["links"] = dict(sorted(self.data["links"].items(), key=lambda _: self.rng.random()))
        self.data["joints"] = dict(sorted(self.data["joints"].items(), key=lambda _: self.rng.random()))

    def link(self) -> str:
        name = f"L{len(self.pose)}"
        x, y, angle = self.rng.uniform(-1, 1, 3)
        self.pose[name] = (x, y, np.pi * angle)
        self.data["links"][name] = {
            "points": {},
            "mass": float(self.rng.uniform(0.5, 3)),
            "centre": [float(n) for n in self.rng.uniform(-0.5, 0.5, 2)],
            "inertia": float(self.rng.uniform(0.05, 0.5)),
        }
        return name

    def local(self, link: str, v: Any, free: bool = False) -> list[float]:
        x, y, angle = self.pose[link]
        dx, dy = v if free else (v[0] - x, v[1] - y)
        c, s = np.cos(angle), np.sin(angle)
        return [float(c * dx + s * dy), float(c * dy - s * dx)]

    def join(self, letter: str, one: str, two: str, driven: bool = False) -> None:
        name = f"J{len(self.data['joints'])}"
        first, second = (one, two) if self.rng.random() < 0.5 else (two, one)
        at = self.rng.uniform(-1, 1, 2)
        if letter == "R":
            for link in (first, second):
                self.data["links"][link]["points"][name] = self.local(link, at)
            q = self.pose[second][2] - self.pose[first][2]
            extent = float(self.rng.choice([-1, 1]) * self.rng.uniform(0.05, 0.12))
        else:
            turn, q = self.rng.uniform(-np.pi, np.pi), float(self.rng.uniform(-0.5, 0.5))
            axis = np.array([np.cos(turn), np.sin(turn)])
            for link, place in ((first, at), (second, at + q * axis)):
                self.data["links"][link]["points"][name] = {
                    "at": self.local(link, place),
                    "axis": self.local(link, axis, free=True),
                }
            extent = float(self.rng.choice([-1, 1]) * self.rng.uniform(0.03, 0.08))
        self.data["joints"][name] = {"type": KIND[letter], "links": [first, second]}
        if driven:
            self.data["drivers"][name] = {"speed": extent, "range": [float(q), float(q) + extent]}

    def grow(self, kind: str, bases: list[str]) -> None:
        base = [str(b) for b in self.rng.permutation(bases)]
        base += base
        if len(kind) == 1:
            new = [self.link()]
            self.join(kind, base[0], new[0], driven=True)
        elif kind.startswith("triad"):
            new = [self.link() for _ in range(4)]
            for i in range(3):
                self.join("P" if "slides" in kind and i == 1 else "R", base[i], new[i])
                self.join("P" if "slides" in kind and i == 2 else "R", new[i], new[3])
        else:
            letters = [
                (letter, before == "[") for before, letter in zip("x" + kind, kind, strict=False) if letter in "RP"
            ]
            new = [self.link() for _ in letters[1:]]
            chain = [base[0], *new, base[1]]
            for (letter, driven), one, two in zip(letters, chain, chain[1:], strict=False):
                self.join(letter, one, two, driven)
        for link in new:
            for name, point in list(self.data["links"][link]["points"].items())[:2]:
                x, y, angle = self.pose[link]
                px, py = point["at"] if isinstance(point, dict) else point
                c, s = np.cos(angle), np.sin(angle)
                self.data["assembly"][f"{link}.{name}"] = [float(x + c * px - s * py), float(y + s * px + c * py)]
            point = next(iter(self.data["links"][link]["points"]))
            force = [float(n) for n in self.rng.normal(0, 20, 2)]
            self.data["loads"][f"on {link}"] = {"link": link, "at": point, "force": force, "moment": 3.0}


@functools.cache
def grown(seed: int) -> tuple[Data, dict[str, tuple[float, float, float]]]:
    """The first mechanism of a seed whose modules are all well away from dead centres at the start."""
    for attempt in range(60):
        grower = Grower(1000 * seed + attempt)
        mechanism = Mechanism(**grower.data)
        if _well_conditioned(mechanism, grower.pose):
            return grower.data, grower.pose
    raise AssertionError("no regular mechanism among sixty")


def _well_conditioned(mechanism: Mechanism, pose: dict[str, tuple[float, float, float]]) -> bool:
    """Singular values of all joints' constraints and drivers on the links' twists: no solver of Trunnion involved."""
    links = {link: k for k, link in enumerate(link for link in pose if link != "ground")}
    rows = []
    for name, joint in mechanism.joints.items():
        row: dict[str, list[np.ndarray]] = {}
        values = mechanism.parameters()
        for link in joint.links:
            x, y, angle = pose[link]
            px, py = (values[f"links.{link}.points.{name}.{axis}"] for axis in "xy")
            c, s = np.cos(angle), np.sin(angle)
            at = np.array([c * px - s * py, s * px + c * py])
            row[link] = [
                np.array([1, 0, -at[1]]),
                np.array([0, 1, at[0]]),
                np.array([0.0, 0.0, 1.0]),
                at + np.array([x, y]),
            ]
        first, second = joint.links
        if joint.type == "revolute":
            wanted = [0, 1] + ([2] if name in mechanism.drivers else [])
            parts = [(row[first][i], row[second][i]) for i in wanted]
        else:
            ax, ay = (values[f"links.{first}.points.{name}.axis.{axis}"] for axis in "xy")
            angle = pose[first][2]
            axis = np.array([np.cos(angle) * ax - np.sin(angle) * ay, np.sin(angle) * ax + np.cos(angle) * ay])
            across = np.array([-axis[1], axis[0]])
            arm = row[second][3] - np.array(pose[first][:2])
            carried = [np.array([1, 0, -arm[1]]), np.array([0, 1, arm[0]])]
            directions = [across] + ([axis] if name in mechanism.drivers else [])
            parts = [
                (d[0] * carried[0] + d[1] * carried[1], d[0] * row[second][0] + d[1] * row[second][1])
                for d in directions
            ]
            parts.append((row[first][2], row[second][2]))
        for one, two in parts:
            line = np.zeros(3 * len(links))
            for link, part, sign in ((first, one, -1.0), (second, two, 1.0)):
                if link != "ground":
                    line[3 * links[link] : 3 * links[link] + 3] += sign * part
            rows.append(line)
    values_ = np.linalg.svd(np.array(rows), compute_uv=False)
    return len(rows) == 3 * len(links) and values_[0] / values_[-1] < 150


@pytest.mark.sample(8)
@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_random_mechanism(seed: int) -> None:
    data, pose = grown(seed)
    mechanism = Mechanism(**data)
    run = prepare(mechanism)
    assert trunnion.check(mechanism, 4).rank_mobility == len(data["drivers"])

    start = run.solve(np.array([0.0])).walk
    for link, (x, y, angle) in pose.items():
        frame = start.motions[link].frame
        found = [float(np.ravel(n)[0]) for n in frame]
        np.testing.assert_allclose(found, [x, y, np.cos(angle), np.sin(angle)], rtol=0, atol=1e-9, err_msg=link)

    result = brief(mechanism, 12)
    status = result["status"].values
    assert np.all(status != Status.NOT_ASSEMBLED) or np.any(result["condition"].values > 30), status
    solved = status < Status.NOT_CONVERGED
    powers = ("drive_power", "friction_power")
    flow = sum(float(np.abs(result[name].values[:, solved]).max(initial=0.0)) for name in powers)
    assert np.all(np.abs(result["power_residual"].values[solved]) < 1e-11 * flow)
    assert np.all(result["friction_power"].values[:, solved] >= -1e-14 * flow)

    named = brief(mechanism, 12, FrictionMethod("successive-approximation", 1e-10, 400))
    both = solved & (named["status"].values < Status.NOT_CONVERGED)
    assert np.all(both[solved] | (result["friction_contraction"].values[solved] > 0.9))
    for variable in ("reaction_force", "drive_effort"):
        a, b = named[variable].values[..., both], result[variable].values[..., both]
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-8 * (1 + np.abs(b).max(initial=0.0)), err_msg=variable)


@pytest.mark.spread(2)
@pytest.mark.parametrize("seed", SEEDS)
def test_random_mechanism_against_newton_euler(seed: int) -> None:
    data, _ = grown(seed)
    run = prepare(Mechanism(**data))
    time = 0.1 + 0.8 * np.arange(oracle.STEPS) / oracle.STEPS
    back = run.solve(time)
    size = np.max([np.broadcast_to(np.hypot(r.x, r.y), time.shape) for r in back.reactions.values()], axis=0)
    second = oracle.accelerations(run, time)
    checked = 0
    for i in range(0, oracle.STEPS, 4):
        joints = oracle.joints_at(run, back, i)
        bodies = oracle.bodies_at(run, data, back, second, i)
        if not np.isfinite(size[i]) or not all(np.isfinite(b.acceleration).all() for b in bodies.values()):
            continue
        expected = newton_euler.solve(bodies, joints, data["gravity"])
        if expected.condition > 1e4:
            continue
        checked += 1
        for joint, reaction in back.reactions.items():
            found = [float(np.broadcast_to(n, time.shape)[i]) for n in (reaction.x, reaction.y, reaction.m)]
            np.testing.assert_allclose(found[:2], expected.force[joint], rtol=0, atol=2e-7 * size[i], err_msg=joint)
            np.testing.assert_allclose(found[2], expected.moment[joint], rtol=0, atol=2e-7 * size[i], err_msg=joint)
        for driver, effort in back.efforts.items():
            found_effort = float(np.broadcast_to(effort, time.shape)[i])
            np.testing.assert_allclose(found_effort, expected.effort[driver], rtol=0, atol=2e-7 * size[i])
    assert checked > 0 or np.any(~np.isfinite(size))


@pytest.mark.sample(8)
@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_random_mechanism_elsewhere(seed: int) -> None:
    """Turned, and 1e4 m away, where four digits fewer are left of each position: the same machine."""
    data, _ = grown(seed)
    plain = brief(Mechanism(**data), 6)
    for shift, tolerance in (((0.0, 0.0), 1e-9), ((1e4, -2e4), 1e-6)):
        other = brief(Mechanism(**transformed(data, 0.6, shift)), 6)
        np.testing.assert_array_equal(other["status"], plain["status"])
        for variable in ("drive_effort", "friction_power", "link_angle_acceleration"):
            scale = 1 + float(np.nan_to_num(np.abs(plain[variable])).max())
            np.testing.assert_allclose(other[variable], plain[variable], rtol=0, atol=tolerance * scale)
