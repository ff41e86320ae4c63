"""Other people's tools set to the four-bar of Durango et al., each doing as much of the job as it can.

Each function returns a `Side` ready to run, or None where the package is not installed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import durango as d
from benchmarks.reference_kernels import COLUMN, numba_loop
from benchmarks.side import MOTION_COLUMNS, Job, Side, crank_angles, version

Array = NDArray[np.float64]

__all__ = ["fourbarhinge_side", "pinocchio_side", "pylinkage_side"]


def pylinkage_side(job: Job) -> Side | None:
    """Position, velocity and acceleration of B and C by pylinkage's compiled loop (`step_fast_with_kinematics`).

    It turns the crank before each step, so its first configuration is ours at one step: started one step back.
    """
    if not version("pylinkage") or not version("numba"):
        return None
    from pylinkage.actuators import Crank
    from pylinkage.components import Ground
    from pylinkage.dyads import RRRDyad
    from pylinkage.simulation import Linkage

    def build(n: int) -> Linkage:
        step = 2.0 * math.pi / n
        frame_a, frame_d = Ground(0.0, 0.0, name="A"), Ground(d.AD, 0.0, name="D")
        crank = Crank(anchor=frame_a, radius=d.AB, angular_velocity=step, initial_angle=-step, name="B")
        rocker = RRRDyad(crank.output, frame_d, distance1=d.BC, distance2=d.CD, x=3.9, y=2.5, name="C")
        linkage = Linkage([frame_a, frame_d, crank, rocker])
        linkage.compile()
        linkage.set_input_velocity(crank, d.OMEGA1)
        return linkage

    def table(motion: tuple[Array, Array, Array]) -> Array:
        return np.stack(motion, axis=1)[:, :, 2:].reshape(len(motion[0]), -1)

    return Side(
        "pylinkage",
        job,
        lambda n: build(n).step_fast_with_kinematics(iterations=n),
        table,
        MOTION_COLUMNS[9:],
        note=f"{version('pylinkage')}, its Numba path",
    )


def fourbarhinge_side(job: Job) -> Side | None:
    """Drive torque and the four reactions, without friction, by fourbarhinge (one 9×9 solve a configuration)."""
    if not version("fourbarhinge"):
        return None
    import fourbarhinge as fb

    def bar(length: float, mass: float, inertia: float, x: float, y: float = 0.0) -> fb.Bar:
        return fb.Bar(length=length, mass=mass, inertia=inertia, center_of_mass=fb.Point(x=x, y=y))

    geometry = fb.FourBarGeometry(
        position_ground=fb.Point(x=0.0, y=0.0),
        bar={
            fb.BarId.GROUND: fb.Bar(length=d.AD),
            fb.BarId.INPUT: bar(d.AB, d.M1, d.J1, d.S1),
            fb.BarId.COUPLER: bar(d.BC, d.M2, d.J2, d.S2_X, d.S2_Y),
            fb.BarId.OUTPUT: bar(d.CD, d.M3, d.J3, d.S3),
        },
    )
    loads = [
        fb.ExternalForce(bar=fb.BarId.COUPLER, point=fb.Point(x=d.E_X, y=d.E_Y), force=(d.FE_X, d.FE_Y)),
        fb.ExternalForce(bar=fb.BarId.OUTPUT, point=fb.Point(x=0.0, y=0.0), torque=d.M3_APPLIED),
    ]
    kinematics = fb.FourBarKinematics(geometry, theta_ground=0.0)
    dynamics = fb.FourBarDynamics(kinematics, external_forces=loads, gravity=(0.0, 0.0))
    reactions = fb.FourBarReactions(dynamics)
    motor = fb.Actuator(bar=fb.BarId.INPUT)

    def run(n: int) -> Array:
        out = np.empty((n, 9))
        for k, theta in enumerate(crank_angles(n)):
            kinematics.solve_configuration(theta, branch=-1)
            kinematics.solve_theta_dot(d.OMEGA1)
            kinematics.solve_theta_ddot(0.0)
            result = reactions.solve(motor)
            for j, joint in enumerate("ABCD"):
                out[k, 2 * j : 2 * j + 2] = result.reactions[joint]
            out[k, 8] = result.actuator_value
        return out

    columns = (*(f"reaction.{joint}.{axis}" for joint in "ABCD" for axis in "xy"), "drive_torque")
    return Side("fourbarhinge", job, run, np.asarray, columns, 500, note=version("fourbarhinge"))


def pinocchio_side(job: Job) -> Side | None:
    """Drive torque and force in the cut joint C, without friction, by Pinocchio's RNEA on the opened loop.

    Chain A–B and chain D, cut at C; the force there makes the torques of the passive joints B and D vanish (a
    2×2 solve, of all positions at once). Motion and loads are given and not timed: Pinocchio does not close loops in
    one step. What is left in the loop are its three calls and the copies of what they return.
    """
    if not version("pin"):
        return None
    import pinocchio as pin

    model, frames = _pinocchio_model()
    data = model.createData()
    first, second = frames
    rnea, jacobians, jacobian, frame = (
        pin.rnea, pin.computeJointJacobians, pin.getFrameJacobian, pin.LOCAL_WORLD_ALIGNED,
    )  # fmt: skip

    def one(q: Array, v: Array, a: Array, loads: Any) -> tuple[Array, Array, Array]:
        torque = rnea(model, data, q, v, a, loads)
        jacobians(model, data, q)
        return torque.copy(), jacobian(model, data, first, frame), jacobian(model, data, second, frame)

    given: dict[int, tuple[Any, ...]] = {}

    def run(n: int) -> Array:
        if n not in given:
            motion = _pinocchio_motion(n)
            given[n] = (*(list(rows) for rows in motion), _pinocchio_loads(model.njoints, motion[0]))
        torques, j1, j2 = (np.array(part) for part in zip(*map(one, *given[n]), strict=True))
        gap = (j2 - j1)[:, :2]  # Jacobian of the gap at C: the rocker's C against the coupler's
        force = np.linalg.solve(gap[:, :, 1:].transpose(0, 2, 1), torques[:, 1:, None])[:, :, 0]  # on the rocker
        return np.column_stack([force, torques[:, 0] - np.sum(gap[:, :, 0] * force, axis=1)])

    columns = ("reaction.C.x", "reaction.C.y", "drive_torque")
    note = f"{version('pin')}, motion given"
    return Side("Pinocchio", job, run, np.asarray, columns, 5_000, note=note)


def _pinocchio_model() -> tuple[Any, tuple[int, int]]:
    """Open chains A–B and D with a frame at either end of the cut joint C."""
    import pinocchio as pin

    model = pin.Model()
    model.gravity = pin.Motion.Zero()

    def add(parent: int, x: float, name: str, mass: float, inertia: float, centre: tuple[float, float]) -> int:
        joint = model.addJoint(parent, pin.JointModelRZ(), pin.SE3(np.eye(3), np.array([x, 0.0, 0.0])), name)
        spread = np.diag([0.0, 0.0, inertia])
        body = pin.Inertia(mass, np.array([*centre, 0.0]), spread)
        model.appendBodyToJoint(joint, body, pin.SE3.Identity())
        return int(joint)

    crank = add(0, 0.0, "A", d.M1, d.J1, (d.S1, 0.0))
    coupler = add(crank, d.AB, "B", d.M2, d.J2, (d.S2_X, d.S2_Y))
    rocker = add(0, d.AD, "D", d.M3, d.J3, (d.S3, 0.0))

    def end(joint: int, x: float, name: str) -> int:
        place = pin.SE3(np.eye(3), np.array([x, 0.0, 0.0]))
        return int(model.addFrame(pin.Frame(name, joint, place, pin.FrameType.OP_FRAME)))

    return model, (end(coupler, d.BC, "C of the coupler"), end(rocker, d.CD, "C of the rocker"))


def _pinocchio_loads(joints: int, q: Array) -> list[Any]:
    """The loads at each position, in each link's own frame."""
    import pinocchio as pin

    placement, found = pin.SE3(np.eye(3), np.array([d.E_X, d.E_Y, 0.0])), []
    for c, s in zip(np.cos(q[:, 0] + q[:, 1]), np.sin(q[:, 0] + q[:, 1]), strict=True):
        loads = pin.StdVec_Force()
        loads.extend([pin.Force.Zero() for _ in range(joints)])
        at_e = pin.Force(np.array([c * d.FE_X + s * d.FE_Y, c * d.FE_Y - s * d.FE_X, 0.0]), np.zeros(3))
        loads[2], loads[3] = placement.act(at_e), pin.Force(np.zeros(3), np.array([0.0, 0.0, d.M3_APPLIED]))
        found.append(loads)
    return found


def _pinocchio_motion(n: int) -> tuple[Array, Array, Array]:
    """Joint coordinates (A, B, D), speeds and accelerations, each (n, 3)."""
    table = numba_loop(crank_angles(n), friction_radius=0.0)

    def relative(quantity: str) -> Array:
        first, second, third = (table[:, COLUMN[f"link_{quantity}.{link}"]] for link in (1, 2, 3))
        return np.stack([first, second - first, third], axis=1)

    return relative("angle"), relative("velocity"), relative("acceleration")
