"""A spatial mechanism of plain data in MuJoCo, a multibody engine that has neither code nor coordinates of Trunnion's.

The engine has a spanning tree of hinges, slides and balls and gives positions, Jacobians with their rates, inverse
dynamics and the forces between bodies. Loops are closed here, by Newton on the equations of the joints that are cut
(`maximal_space`), whose derivatives are those Jacobians. No friction.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pytest

from reference.maximal_space import GAPS, SQUARE, Array, Data, Drive, Frame, Motion, cross, element
from reference.space_oracle import Oracle

mj = pytest.importorskip("mujoco")

TREE = {"revolute": ("hinge",), "prismatic": ("slide",), "cylindrical": ("slide", "hinge"), "spherical": ("ball",)}
TYPES = {"hinge": mj.mjtJoint.mjJNT_HINGE, "slide": mj.mjtJoint.mjJNT_SLIDE, "ball": mj.mjtJoint.mjJNT_BALL}
Z = np.array([0.0, 0.0, 1.0])


class Forces(NamedTuple):
    """On the second link by the first: reactions (force, moment about the bearing's middle), efforts; spin moments."""

    reactions: dict[str, tuple[Array, Array]]
    efforts: dict[str, float]
    spins: dict[str, float]


def quaternion(axes: Array) -> Array:
    found = np.zeros(4)
    mj.mju_mat2Quat(found, axes.ravel())
    return found


class Engine:
    """A mechanism in MuJoCo; `move` it, then ask for `forces`."""

    def __init__(self, data: Data) -> None:
        self.oracle = Oracle(data)
        self.links, self.joints, self.drivers = data["links"], data["joints"], self.oracle.drivers
        spec = mj.MjSpec()
        spec.option.gravity = data["gravity"]
        bodies, self.sense = {"ground": spec.worldbody}, dict[str, float]()  # sense: +1 where the child is second
        able = [name for name in self.joints if self.joints[name]["type"] in TREE]
        order = sorted(able, key=lambda name: (name not in self.drivers, self.joints[name]["type"] == "spherical"))
        while len(bodies) < len(self.links):
            name = next(n for n in order if sum(link in bodies for link in self.joints[n]["links"]) == 1)
            parent, child = sorted(self.joints[name]["links"], key=lambda link: link not in bodies)
            self.sense[name] = 1.0 if child == self.joints[name]["links"][1] else -1.0
            bodies[child] = self._hang(bodies[parent], parent, child, name)
        self.model = spec.compile()
        self.state = mj.MjData(self.model)
        self.cuts = [name for name in self.joints if name not in self.sense]
        self.size = self.model.nv

    def _hang(self, parent: Any, above: str, link: str, joint: str) -> Any:
        base, own = element(self.links[above], joint), element(self.links[link], joint)
        at, data = base @ own.inverse(), self.links[link]
        found = parent.add_body(name=link, pos=at.place, quat=quaternion(at.axes))
        second, axes = np.linalg.eigh(self.oracle.inertia(link, Frame(np.zeros(3), np.eye(3))))
        axes = axes * np.sign(np.linalg.det(axes))
        found.mass, found.ipos, found.inertia = data["mass"], np.asarray(data["centre"], float), second
        found.iquat, found.explicitinertial = quaternion(axes), True
        for kind in TREE[self.joints[joint]["type"]]:
            found.add_joint(name=f"{joint}.{kind}", type=TYPES[kind], axis=own.axes @ Z, pos=own.place)
        return found

    def body(self, link: str) -> int:
        return 0 if link == "ground" else int(self.model.body(link).id)

    def jacobian(self, link: str, function: Any = mj.mj_jac) -> tuple[Array, Array]:
        """Velocity of a link's origin and its rotation, by coordinate."""
        place, turn = np.zeros((3, self.size)), np.zeros((3, self.size))
        if link != "ground":
            body = self.body(link)
            function(self.model, self.state, place, turn, self.state.xpos[body], body)
        return place, turn

    def motions(self, velocity: Array, acceleration: Array, bias: bool = True) -> dict[str, Motion]:
        """Motions of the links at the engine's position."""
        found = {}
        for link in self.oracle.moving:
            body = self.body(link)
            frame = Frame(np.array(self.state.xpos[body]), self.state.xmat[body].reshape(3, 3).copy())
            (jp, jr), rate = self.jacobian(link), np.zeros((2, 3, self.size))
            if bias:
                rate = np.array(self.jacobian(link, mj.mj_jacDot))
            second = [jp @ acceleration + rate[0] @ velocity, jr @ acceleration + rate[1] @ velocity]
            found[link] = Motion(frame, jp @ velocity, jr @ velocity, *second)
        return found

    def equations(self, motions: Mapping[str, Motion], drive: Mapping[str, Drive]) -> Array:
        """What must be zero at the cut joints, drives and free spins, with its derivatives."""
        rows = [row for name in self.cuts for row in self.oracle.rows(name, motions, {})]
        rows += [self.oracle.rows(name, motions, drive)[-1] for name in self.drivers]
        for link in self.oracle.free:
            u, motion = self.oracle.line(motions, link), motions[link]
            rows.append((0.0, float(u @ motion.spin), float(u @ motion.spin_rate)))
        return np.array(rows).T

    def slopes(self) -> Array:
        """Derivatives of the equations by coordinate."""
        drive = {name: Drive(0.0) for name in self.drivers}
        none = np.zeros(self.size)
        units = [self.equations(self.motions(unit, none, bias=False), drive)[1] for unit in np.eye(self.size)]
        return np.array(units).T

    def guess(self, frames: Mapping[str, Frame]) -> None:
        """Coordinates of the tree from links' frames, rounded to tell the assembly and no more."""
        self.state.qpos[:] = self.model.qpos0
        still = {link: Motion(frame, *np.zeros((4, 3))) for link, frame in frames.items()}
        for name in self.sense:
            one, two = self.oracle.elements(still, name)
            relative = one.frame.inverse() @ two.frame
            back = relative.inverse() if self.sense[name] < 0 else relative
            for kind in TREE[self.joints[name]["type"]]:
                place = int(self.model.joint(f"{name}.{kind}").qposadr[0])
                if kind == "ball":  # in the frame of the link, which the element is turned against
                    child = self.joints[name]["links"][1 if self.sense[name] > 0 else 0]
                    axes = element(self.links[child], name).axes
                    q = np.round(quaternion(axes @ back.axes @ axes.T), 1)
                    self.state.qpos[place : place + 4] = q / np.linalg.norm(q)
                else:
                    turn = np.arctan2(back.axes[1, 0], back.axes[0, 0])
                    self.state.qpos[place] = np.round(turn if kind == "hinge" else back.place[2], 2)

    def move(self, frames: Mapping[str, Frame], drive: Mapping[str, Drive]) -> dict[str, Motion]:
        """Position by Newton from near some frames, velocity, acceleration."""
        self.guess(frames)
        none = np.zeros(self.size)
        for _ in range(15):
            mj.mj_fwdPosition(self.model, self.state)
            gap = self.equations(self.motions(none, none, bias=False), drive)[0]
            mj.mj_integratePos(self.model, self.state.qpos, -np.linalg.solve(self.slopes(), gap), 1.0)
        mj.mj_fwdPosition(self.model, self.state)
        assert np.max(np.abs(gap)) < 1e-13
        slopes = self.slopes()
        self.state.qvel = np.linalg.solve(slopes, -self.equations(self.motions(none, none, bias=False), drive)[1])
        mj.mj_fwdVelocity(self.model, self.state)
        still = self.equations(self.motions(self.state.qvel, none), drive)[2]
        self.state.qacc = np.linalg.solve(slopes, -still)
        mj.mj_inverse(self.model, self.state)
        return self.motions(self.state.qvel, self.state.qacc)

    def forces(self) -> Forces:
        """What the motion and the loads need, where `move` went."""
        motions, applied = self.motions(self.state.qvel, self.state.qacc), np.zeros(self.size)
        self.state.xfrc_applied[:] = 0.0
        for link, body in self.oracle.bodies(motions).items():
            for load in body.loads:
                self._apply(link, load.force, load.moment, load.point, applied)
        for name, joint in self.oracle.joints_at(motions, {}).items():  # what resists in joints
            self._press(name, np.asarray(joint.friction), joint.point, applied)
        found = np.linalg.solve(self.slopes().T, self.state.qfrc_inverse - applied)
        cuts: dict[str, Array] = {}
        first = 0
        for name in self.cuts:
            units = self._units(motions, name)
            cuts[name] = found[first : first + len(units)] @ units
            self._press(name, cuts[name], self._end(motions, name).place, applied)
            first += len(units)
        drives = {name: float(n) for name, n in zip(self.drivers, found[first:], strict=False)}
        spins = {link: float(n) for link, n in zip(self.oracle.free, found[first + len(drives) :], strict=True)}
        for link, moment in spins.items():
            self._apply(
                link, np.zeros(3), moment * self.oracle.line(motions, link), self.state.xpos[self.body(link)], applied
            )
        mj.mj_rnePostConstraint(self.model, self.state)
        reactions = {name: self._reaction(motions, name, cuts, drives) for name in self.joints}
        return Forces(reactions, drives, spins)

    def _end(self, motions: Mapping[str, Motion], name: str) -> Frame:
        """Element on the second link."""
        return self.oracle.elements(motions, name)[1].frame

    def _units(self, motions: Mapping[str, Motion], name: str) -> Array:
        """Force and moment on the second link, at its element, for unit multipliers of a cut joint's equations."""
        one, two = self.oracle.elements(motions, name)
        kind, e, f = self.joints[name]["type"], one.frame.axes.T, two.frame.axes.T
        forces = [np.concatenate([e[n], np.zeros(3)]) for n in GAPS.get(kind, (0, 1, 2))]
        moments = [np.concatenate([np.zeros(3), -cross(e[i], f[j])]) for i, j in SQUARE[kind]]
        return np.array([*forces, *moments])

    def _press(self, name: str, wrench: Array, at: Any, into: Array) -> None:
        """A wrench on the second link of a joint and its opposite on the first."""
        for link, sign in zip(self.joints[name]["links"], (-1.0, 1.0), strict=True):
            self._apply(link, sign * wrench[:3], sign * wrench[3:], at, into)

    def _apply(self, link: str, force: Any, moment: Any, at: Any, into: Array) -> None:
        """A load on a body, as the engine has it, and as generalised forces."""
        body, force, moment, at = self.body(link), *(np.array(part, float) for part in (force, moment, at))
        mj.mj_applyFT(self.model, self.state, force, moment, at, body, into)
        self.state.xfrc_applied[body, :3] += force
        self.state.xfrc_applied[body, 3:] += moment + np.cross(at - self.state.xipos[body], force)

    def _reaction(
        self, motions: Mapping[str, Motion], name: str, cuts: Mapping[str, Array], drives: Mapping[str, float]
    ) -> tuple[Array, Array]:
        """Force and moment about the middle of the bearing, without effort; what resists is an applied load here."""
        first, second = self.joints[name]["links"]
        end = self._end(motions, name)
        z = end.axes[:, 2]
        middle = end.place + self.oracle.joint[name]["pin"].get("offset", 0.0) * z
        if name in cuts:
            force, moment, at = cuts[name][:3], cuts[name][3:], end.place
        else:
            child = self.body(second if self.sense[name] > 0 else first)
            wrench = self.sense[name] * self.state.cfrc_int[child]
            force, moment, at = wrench[3:], wrench[:3], self.state.subtree_com[self.model.body_rootid[child]]
            turned = drives.get(name, 0.0) * z * (self.joints[name]["type"] != "prismatic")
            pushed = drives.get(name, 0.0) * z * (self.joints[name]["type"] == "prismatic")
            force = force - pushed
            moment = moment + np.cross(at - middle, wrench[3:]) - turned
            return force, moment
        return force, moment + np.cross(at - middle, force)
