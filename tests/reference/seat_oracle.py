"""Planar linkages whose pins lie where their loads press them, without Trunnion: an oracle for the loaded seat.

The massless-link model of play, written out for two linkages in complex numbers. A pin in the wall of its hole at the
offset c is a link of the length ρ without mass: the second link's point is moved by c and everything else is as if
ideal. Motion from the two sides of the triangle, with the offsets held; forces from the Newton–Euler equations of all
links at once (`newton_euler`); friction, then the seats, by substitution until nothing changes any more.

Signs as in the documentation: a hole is on the second link of its joint, Q the force of the pin on the hole in the axes
of the hole's link (of a guide: along its slide and across), and c = ρ n with n = Q/|Q| turned by atan μ about z times
the sign of the rate of the second link against the first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from reference import newton_euler
from reference.newton_euler import Solution

Data = dict[str, Any]
Offsets = dict[str, tuple[complex, ...]]  # of a pin one vector x + i y; of a guide both ends, across alone, real

__all__ = ["FourBar", "Link", "Linkage", "Settled", "SliderCrank"]

LIMIT = 1e-13


@dataclass(frozen=True)
class Link:
    """Motion of a link: origin, its velocity and acceleration, angle, rate and its derivative."""

    place: complex
    velocity: complex
    acceleration: complex
    angle: float
    rate: float
    second: float

    def point(self, local: complex) -> complex:
        return self.place + np.exp(1j * self.angle) * local

    def accelerated(self, local: complex) -> complex:
        r = np.exp(1j * self.angle) * local
        return self.acceleration + (1j * self.second - self.rate**2) * r


@dataclass(frozen=True)
class Settled:
    """A position with its pins in their seats: offsets, loads on the ends of the holes, motion, forces, rounds."""

    offsets: Offsets
    loads: dict[str, tuple[complex, ...]]
    links: dict[str, Link]
    solution: Solution
    friction: dict[str, float]
    rounds: int


def local(link: Data, name: str) -> complex:
    point = link["points"][name]
    return complex(*(point["at"] if isinstance(point, dict) else point))


def slide_of(link: Data, name: str) -> complex:
    axis = complex(*link["points"][name]["axis"])
    return axis / abs(axis)


class Linkage:
    """What both have in common; data as the model file has it, in SI numbers, one coefficient of friction."""

    def __init__(self, data: Data) -> None:
        self.data, self.links, self.joints = data, data["links"], data["joints"]
        defaults = data.get("joint_defaults", {})
        self.friction = float(defaults.get("friction", 0.0))
        self.parts = {
            name: {key: {**defaults.get(key, {}), **joint.get(key, {})} for key in ("pin", "guide")}
            for name, joint in self.joints.items()
        }
        (self.driven,) = data["drivers"]
        self.speed = float(data["drivers"][self.driven]["speed"])
        self.gravity = np.asarray(data.get("gravity", (0.0, 0.0)), float)

    def clearance(self, joint: str) -> float:
        part = self.parts[joint]["pin" if self.joints[joint]["type"] == "revolute" else "guide"]
        return float(part.get("clearance", 0.0))

    def at(self, link: str, joint: str, offsets: Offsets) -> complex:
        """Place of a pin on a link, where the pin's axis is: in the second link the middle of the hole and c."""
        moved = joint in offsets and self.joints[joint]["links"][1] == link
        return local(self.links[link], joint) + (offsets[joint][0] if moved else 0)

    def move(self, theta: float, offsets: Offsets) -> dict[str, Link]:
        raise NotImplementedError

    def bodies(self, links: Mapping[str, Link]) -> dict[str, newton_euler.Body]:
        found = {}
        for name, link in links.items():
            data = self.links[name]
            centre = complex(*data["centre"])
            loads = []
            for load in self.data.get("loads", {}).values():
                if load["link"] == name:
                    place = link.point(local(data, load["at"])) if "at" in load else 0j
                    force = load.get("force", (0.0, 0.0))
                    loads.append(newton_euler.Load(_pair(place), force, load.get("moment", 0.0)))
            found[name] = newton_euler.Body(
                data["mass"], data["inertia"], _pair(link.point(centre)), _pair(link.accelerated(centre)),
                link.second, loads,
            )  # fmt: skip
        return found

    def joints_at(
        self, links: Mapping[str, Link], offsets: Offsets, friction: Mapping[str, float]
    ) -> dict[str, newton_euler.Joint]:
        found = {}
        for name, joint in self.joints.items():
            first, second = (None if link == "ground" else link for link in joint["links"])
            axis = slide_of(self.links["ground"], name) if joint["type"] == "prismatic" else 1 + 0j
            assert second is not None
            if joint["type"] == "prismatic":  # the ground has the guide; the moment counts about the hole's middle
                place = links[second].point(local(self.links[second], name))
            else:
                place = links[second].point(self.at(second, name, offsets))
            found[name] = newton_euler.Joint(
                joint["type"], first, second, _pair(place), _pair(axis), friction.get(name, 0.0), name == self.driven
            )
        return found

    def rate(self, links: Mapping[str, Link], name: str) -> float:
        """Rate of the second link against the first: of a guide along its slide."""
        first, second = self.joints[name]["links"]
        if self.joints[name]["type"] == "prismatic":
            axis = slide_of(self.links["ground"], name)
            return float(np.real(links[second].velocity * np.conj(axis)))
        return links[second].rate - (links[first].rate if first != "ground" else 0.0)

    def balance(self, links: Mapping[str, Link], offsets: Offsets) -> tuple[Solution, dict[str, float]]:
        """Reactions with friction: torque f r |F| of a pin, force f (|F/2 + M/L| + |F/2 − M/L|) of a guide."""
        bodies, friction = self.bodies(links), dict.fromkeys(self.joints, 0.0)
        for _ in range(300):
            found = newton_euler.solve(bodies, self.joints_at(links, offsets, friction), self.gravity)
            wanted = {name: self.rubbed(links, found, name) for name in self.joints}
            change = max(abs(wanted[name] - friction[name]) for name in friction)
            friction = wanted
            if change <= LIMIT * max(1e-300, *(abs(n) for n in wanted.values())):
                return found, friction
        raise AssertionError("friction does not settle")

    def rubbed(self, links: Mapping[str, Link], found: Solution, name: str) -> float:
        sense = -np.sign(self.rate(links, name)) * self.friction
        if self.joints[name]["type"] == "revolute":
            return float(sense * self.parts[name]["pin"]["radius"] * np.hypot(*found.force[name]))
        axis = slide_of(self.links["ground"], name)
        across = float(np.real(complex(*found.force[name]) * np.conj(1j * axis)))
        couple = found.moment[name] / self.parts[name]["guide"]["length"]
        return float(sense * (abs(across / 2 + couple) + abs(across / 2 - couple)))

    def loads(self, links: Mapping[str, Link], found: Solution, name: str) -> tuple[complex, ...]:
        """Q of each end: in the axes of the second link; of a guide the components across."""
        second = self.joints[name]["links"][1]
        force = complex(*found.force[name]) * np.exp(-1j * links[second].angle)
        if self.joints[name]["type"] == "revolute":
            return (force,)
        across = float(np.real(force * np.conj(1j * slide_of(self.links[second], name))))
        couple = found.moment[name] / self.parts[name]["guide"]["length"]
        return (complex(across / 2 - couple), complex(across / 2 + couple))

    def seats(self, links: Mapping[str, Link], found: Solution) -> tuple[Offsets, dict[str, tuple[complex, ...]]]:
        """Where the loads press the pins."""
        offsets, loads = {}, {}
        for name, joint in self.joints.items():
            rho = self.clearance(name)
            if rho == 0:
                continue
            loads[name] = self.loads(links, found, name)
            turn = np.exp(1j * np.arctan(self.friction) * np.sign(self.rate(links, name)))
            turn = turn if joint["type"] == "revolute" else 1
            offsets[name] = tuple(rho * q / abs(q) * turn for q in loads[name])
        return offsets, loads

    def solve(self, theta: float, offsets: Offsets) -> tuple[dict[str, Link], Solution, dict[str, float]]:
        links = self.move(theta, offsets)
        return links, *self.balance(links, offsets)

    def settle(self, theta: float) -> Settled:
        """Seats and reactions in turn from the ideal position, until no seat moves by more than 1e-12 ρ."""
        offsets: Offsets = {}
        for rounds in range(200):
            links, found, friction = self.solve(theta, offsets)
            wanted, loads = self.seats(links, found)
            change = max(
                abs(a - b) / self.clearance(name)
                for name, ends in wanted.items()
                for a, b in zip(ends, offsets.get(name, (0j,) * len(ends)), strict=True)
            )
            if change <= 1e-12:
                return Settled(offsets, loads, links, found, friction, rounds)
            offsets = wanted
        raise AssertionError(f"the seats do not settle: {change:.2g} of the clearance")

    def travelling(self, theta: float) -> Settled:
        """A position with the whole motion of its links: differences of fourth order of their settled places."""
        step = 2e-3
        five = [self.settle(theta + k * step) for k in (-2, -1, 0, 1, 2)]
        links = {}
        for name in five[2].links:
            places = np.array([one.links[name].place for one in five])
            angles = np.unwrap([one.links[name].angle for one in five])
            first = np.array([1, -8, 0, 8, -1]) / (12 * step) * self.speed
            second = np.array([-1, 16, -30, 16, -1]) / (12 * step**2) * self.speed**2
            links[name] = Link(
                places[2], first @ places, second @ places, float(angles[2]), first @ angles, second @ angles
            )
        found, friction = self.balance(links, five[2].offsets)
        return replace(five[2], links=links, solution=found, friction=friction)

    def crank(self, theta: float, offsets: Offsets) -> Link:
        """The driven link: its hole at A, moved by its seat, about the ground's pin."""
        name = self.joints["A"]["links"][1]
        angle, rate = theta, self.speed
        arm = -np.exp(1j * angle) * self.at(name, "A", offsets)
        ground = local(self.links["ground"], "A")
        return Link(ground + arm, 1j * rate * arm, -(rate**2) * arm, angle, rate, 0.0)


class FourBar(Linkage):
    """Joints A (ground, crank), B (crank, coupler), C (coupler, rocker), D (ground, rocker); C left of B→D."""

    def move(self, theta: float, offsets: Offsets) -> dict[str, Link]:
        crank = self.crank(theta, offsets)
        b_local = self.at("crank", "B", offsets)
        start, end = crank.point(b_local), local(self.links["ground"], "D")
        start_rate = crank.velocity + 1j * crank.rate * np.exp(1j * theta) * b_local
        start_second = crank.accelerated(b_local)
        rod = self.at("coupler", "C", offsets) - self.at("coupler", "B", offsets)
        bar = self.at("rocker", "C", offsets) - self.at("rocker", "D", offsets)
        line = end - start
        along = (abs(rod) ** 2 - abs(bar) ** 2 + abs(line) ** 2) / (2 * abs(line))
        pin = start + line / abs(line) * (along + 1j * np.sqrt(abs(rod) ** 2 - along**2))
        u, v = pin - start, pin - end
        turns = [np.angle(u / rod), np.angle(v / bar)]
        # start + u = end + v; u̇ = i ω u
        A = np.array([[(1j * u).real, -(1j * v).real], [(1j * u).imag, -(1j * v).imag]])
        rates = np.linalg.solve(A, [-start_rate.real, -start_rate.imag])
        rest = -start_second + u * rates[0] ** 2 - v * rates[1] ** 2
        seconds = np.linalg.solve(A, [rest.real, rest.imag])
        coupler = _hung(
            start, start_rate, start_second, self.at("coupler", "B", offsets), turns[0], rates[0], seconds[0]
        )
        rocker = _hung(end, 0j, 0j, self.at("rocker", "D", offsets), turns[1], rates[1], seconds[1])
        return {"crank": crank, "coupler": coupler, "rocker": rocker}


class SliderCrank(Linkage):
    """Joints A (ground, crank), B (crank, rod), P (rod, piston), C (ground, piston; the guide on the ground)."""

    def move(self, theta: float, offsets: Offsets) -> dict[str, Link]:
        crank = self.crank(theta, offsets)
        b_local = self.at("crank", "B", offsets)
        start = crank.point(b_local)
        start_rate = crank.velocity + 1j * crank.rate * np.exp(1j * theta) * b_local
        start_second = crank.accelerated(b_local)
        rod = self.at("rod", "P", offsets) - self.at("rod", "B", offsets)
        axis, middle = slide_of(self.links["piston"], "C"), local(self.links["piston"], "C")
        if "C" in offsets:  # the line through the ends of the guide in the piston lies on that of the ground
            y1, y2 = (end.real for end in offsets["C"])
            middle = middle + 1j * axis * (y1 + y2) / 2
            axis = axis * np.exp(1j * np.arctan((y2 - y1) / self.parts["C"]["guide"]["length"]))
        way = slide_of(self.links["ground"], "C")
        angle = float(np.angle(way / axis))
        turn = np.exp(1j * angle)
        # of the piston's pin: base + s way
        base = local(self.links["ground"], "C") + turn * (self.at("piston", "P", offsets) - middle)
        gap = (base - start) * np.conj(way)
        s = -gap.real + np.sqrt(abs(rod) ** 2 - gap.imag**2)
        u = base + s * way - start
        A = np.array([[(1j * u).real, -way.real], [(1j * u).imag, -way.imag]])
        rate, slide = np.linalg.solve(A, [-start_rate.real, -start_rate.imag])
        rest = -start_second + u * rate**2
        second, slide_second = np.linalg.solve(A, [rest.real, rest.imag])
        origin = local(self.links["ground"], "C") + s * way - turn * middle
        piston = Link(origin, slide * way, slide_second * way, angle, 0.0, 0.0)
        turned = float(np.angle(u / rod))
        hung = _hung(start, start_rate, start_second, self.at("rod", "B", offsets), turned, float(rate), float(second))
        return {"crank": crank, "rod": hung, "piston": piston}


def _hung(
    at: complex, velocity: complex, acceleration: complex, own: complex, angle: float, rate: float, second: float
) -> Link:
    """A link of which one point and the turn are known."""
    r = -np.exp(1j * angle) * own
    return Link(
        at + r, velocity + 1j * rate * r, acceleration + (1j * second - rate**2) * r,
        float(angle), float(rate), float(second),
    )  # fmt: skip


def _pair(number: complex) -> tuple[float, float]:
    return float(np.real(number)), float(np.imag(number))
