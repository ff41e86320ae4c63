"""A mechanism of the shared tables in MuJoCo, a multibody engine that has neither code nor coordinates of Trunnion's.

The engine has a spanning tree (driven joints and guides in it, some pins cut) and gives its own kinematics, inverse
dynamics, Jacobians of the cut pins and forces between bodies. Here the loops are closed by Newton on those Jacobians
and friction is iterated from the engine's forces: M = f r |F| at a pin, f times the load of both ends in a guide.
"""

from typing import Any

import numpy as np
import pytest

from mechanisms import Array, Data

mj = pytest.importorskip("mujoco")

Z = np.array([0.0, 0.0, 1.0])


def spatial(x: float, y: float) -> Array:
    return np.array([x, y, 0.0])


def element(data: Data, link: str, joint: str) -> tuple[Array, float]:
    """Point of a joint on a link, and the angle of its axis (a pin's: 0), in the link's frame."""
    point = data["links"][link]["points"][joint]
    if isinstance(point, dict):
        return spatial(*point["at"]), float(np.arctan2(point["axis"][1], point["axis"][0]))
    return spatial(*point), 0.0


class Engine:
    """A mechanism in MuJoCo. Forces, speeds and coordinates of a joint are of its second link against the first."""

    def __init__(self, data: Data, radius: float, guide: float) -> None:
        self.data, self.radius, self.guide = data, radius, guide
        self.joints, self.drivers = data["joints"], list(data["drivers"])
        spec = mj.MjSpec()
        spec.option.gravity = spatial(*data["gravity"])
        bodies, self.sense = {"ground": spec.worldbody}, dict[str, float]()  # sense: +1 where the child is second
        first = sorted(
            self.joints, key=lambda name: (name not in self.drivers, self.joints[name]["type"] != "prismatic")
        )
        while len(bodies) < len(data["links"]):
            name = next(n for n in first if sum(link in bodies for link in self.joints[n]["links"]) == 1)
            parent, child = sorted(self.joints[name]["links"], key=lambda link: link not in bodies)
            self.sense[name] = 1.0 if child == self.joints[name]["links"][1] else -1.0
            bodies[child] = self._hang(bodies[parent], parent, child, name)
        self.model = spec.compile()
        self.state = mj.MjData(self.model)
        self.cuts = [name for name in self.joints if name not in self.sense]
        self.dof = {name: int(self.model.joint(name).dofadr[0]) for name in self.sense}
        self.size = self.model.nv

    def _hang(self, parent: Any, above: str, link: str, joint: str) -> Any:
        (base, turn), (own, own_turn) = element(self.data, above, joint), element(self.data, link, joint)
        angle, body = turn - own_turn, self.data["links"][link]
        c, s = np.cos(angle), np.sin(angle)
        place = base - spatial(c * own[0] - s * own[1], s * own[0] + c * own[1])
        found = parent.add_body(name=link, pos=place, quat=[np.cos(angle / 2), 0, 0, np.sin(angle / 2)])
        found.mass, found.ipos, found.inertia = body["mass"], spatial(*body["centre"]), [body["inertia"]] * 3
        found.explicitinertial = True
        if self.joints[joint]["type"] == "revolute":
            found.add_joint(name=joint, type=mj.mjtJoint.mjJNT_HINGE, axis=Z, pos=own)
        else:
            axis = spatial(np.cos(own_turn), np.sin(own_turn))
            found.add_joint(name=joint, type=mj.mjtJoint.mjJNT_SLIDE, axis=axis, pos=own)
        for name in body["points"]:
            found.add_site(name=f"{link}.{name}", pos=element(self.data, link, name)[0])
        return found

    def body(self, link: str) -> int:
        return 0 if link == "ground" else int(self.model.body(link).id)

    def place(self, link: str, point: str) -> Array:
        """Global place of a point."""
        if link == "ground":
            return element(self.data, link, point)[0]
        return np.array(self.state.site(f"{link}.{point}").xpos)

    def rows(self, jacobian: Any = mj.mj_jac) -> Array:
        """Jacobian (or its rate) of what must be zero: the gaps of the cut pins, and the drives."""
        found = []
        for name in self.cuts:
            one, two = np.zeros((3, self.size)), np.zeros((3, self.size))
            for link, part in zip(self.joints[name]["links"], (one, two), strict=True):
                jacobian(self.model, self.state, part, None, self.place(link, name), self.body(link))
            found += list((two - one)[:2])
        found += [self.sense[n] * np.eye(self.size)[self.dof[n]] * (jacobian is mj.mj_jac) for n in self.drivers]
        return np.array(found)

    def move(self, guess: Array, drive: list[tuple[float, float]]) -> None:
        """Position by Newton from a guess, velocity, acceleration; drive: coordinate and constant rate."""
        state, q = self.state, guess
        for name, (value, _) in zip(self.drivers, drive, strict=True):
            q[self.dof[name]] = self.sense[name] * value  # whole turns included
        for _ in range(12):
            state.qpos = q
            mj.mj_fwdPosition(self.model, state)
            ends = [[self.place(link, name) for link in self.joints[name]["links"]] for name in self.cuts]
            gap = [n for one, two in ends for n in (two - one)[:2]]
            gap += [self.sense[n] * q[self.dof[n]] - value for n, (value, _) in zip(self.drivers, drive, strict=True)]
            q = q - np.linalg.solve(self.rows(), gap)
        assert np.max(np.abs(gap)) < 1e-14
        state.qvel = np.linalg.solve(self.rows(), [0.0] * 2 * len(self.cuts) + [rate for _, rate in drive])
        mj.mj_fwdVelocity(self.model, state)
        state.qacc = np.linalg.solve(self.rows(), -self.rows(mj.mj_jacDot) @ state.qvel)
        mj.mj_inverse(self.model, state)
        mj.mj_rnePostConstraint(self.model, state)

    def motion(self, link: str, point: str) -> tuple[Array, Array]:
        """Velocity and acceleration (x, y, turn) of a point."""
        velocity, second, site = np.zeros(6), np.zeros(6), self.model.site(f"{link}.{point}").id
        mj.mj_objectVelocity(self.model, self.state, mj.mjtObj.mjOBJ_SITE, site, velocity, 0)
        mj.mj_objectAcceleration(self.model, self.state, mj.mjtObj.mjOBJ_SITE, site, second, 0)
        second[3:] += self.model.opt.gravity  # the engine counts the ground as accelerated against gravity
        return velocity[[3, 4, 2]], second[[3, 4, 2]]

    def speed(self, joint: str) -> float:
        """Relative speed along the freedom."""
        if joint in self.dof:
            return float(self.sense[joint] * self.state.qvel[self.dof[joint]])
        one, two = (0.0 if n == "ground" else self.motion(n, joint)[0][2] for n in self.joints[joint]["links"])
        return float(two - one)

    def forces(self, coefficient: float) -> tuple[dict[str, Array], dict[str, float], dict[str, float]]:
        """Reactions (x, y, moment about the joint's point on the second link), friction, drive efforts."""
        friction, speed = dict.fromkeys(self.joints, 0.0), {name: self.speed(name) for name in self.joints}
        seen: list[dict[str, float]] = []  # rounding may go round in a circle of the same bits
        for _ in range(60):
            cut, drive = self._balance(friction)
            reactions = {name: self._reaction(name, cut) for name in self.joints}
            last = friction
            loads = {name: coefficient * self._normal(name, *reactions[name]) for name in self.joints}
            friction = {name: -np.sign(speed[name]) * load for name, load in loads.items()}
            if (
                all(abs(friction[n] - last[n]) <= 1e-15 * np.max(np.abs(reactions[n])) for n in friction)
                or friction in seen
            ):
                return reactions, friction, drive
            seen.append(friction)
        raise AssertionError("friction does not settle")

    def _balance(self, friction: dict[str, float]) -> tuple[dict[str, Array], dict[str, float]]:
        """Forces in the cut pins and drive efforts that, with loads and friction, give the motion; both are applied."""
        state, applied = self.state, np.zeros(self.size)
        state.xfrc_applied[:] = 0.0
        for load in self.data.get("loads", {}).values():
            at = self.place(load["link"], load["at"]) if "at" in load else state.body(load["link"]).xpos
            self._apply(load["link"], spatial(*load.get("force", (0, 0))), load.get("moment", 0.0), at, applied)
        for name, value in friction.items():
            if name in self.dof:
                applied[self.dof[name]] += self.sense[name] * value
            else:
                self._press(name, np.zeros(3), value, applied)
        found = np.linalg.solve(self.rows().T, state.qfrc_inverse - applied)
        cut = {name: spatial(*found[2 * k : 2 * k + 2]) for k, name in enumerate(self.cuts)}
        for name, force in cut.items():
            self._press(name, force, 0.0, applied)
        mj.mj_rnePostConstraint(self.model, state)
        return cut, dict(zip(self.drivers, found[2 * len(self.cuts) :], strict=True))

    def _press(self, cut: str, force: Array, moment: float, into: Array) -> None:
        """Load the second link of a cut pin, and the first with the opposite."""
        for link, sign in zip(self.joints[cut]["links"], (-1.0, 1.0), strict=True):
            self._apply(link, sign * force, sign * moment, self.place(link, cut), into)

    def _apply(self, link: str, force: Array, moment: float, at: Array, into: Array) -> None:
        """A load on a body, as the engine has it, and as generalised forces."""
        body = self.body(link)
        mj.mj_applyFT(self.model, self.state, force, moment * Z, at, body, into)
        self.state.xfrc_applied[body, :3] += force
        self.state.xfrc_applied[body, 3:] += moment * Z + np.cross(at - self.state.xipos[body], force)

    def _reaction(self, joint: str, cut: dict[str, Array]) -> Array:
        """Whole force of a joint, as (x, y, moment); of a guide without what acts along it."""
        if joint in cut:
            return cut[joint]
        first, second = self.joints[joint]["links"]
        child = self.body(second if self.sense[joint] > 0 else first)
        wrench = self.sense[joint] * self.state.cfrc_int[child]
        if self.joints[joint]["type"] == "revolute":
            return wrench[3:] * [1, 1, 0]
        about = self.state.subtree_com[self.model.body_rootid[child]] - self.place(second, joint)
        axis = self.state.joint(joint).xaxis
        force = wrench[3:] - axis * (axis @ wrench[3:])
        return spatial(*force[:2]) + Z * (wrench[2] + np.cross(about, wrench[3:])[2])

    def _normal(self, joint: str, x: float, y: float, moment: float) -> float:
        """Normal load of a guide on its two ends; of a pin times its radius."""
        if self.joints[joint]["type"] == "revolute":
            return self.radius * float(np.hypot(x, y))
        across = float(np.hypot(x, y)) * np.sign(np.cross(self.state.joint(joint).xaxis, [x, y, 0.0])[2])
        return float(abs(across / 2 + moment / self.guide) + abs(across / 2 - moment / self.guide))
