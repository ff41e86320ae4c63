"""Spatial results made by hand, as the contract has them: an RSSR, an ideal Cardan joint, one joint of every kind.

Motion is by closed form (THEORY, section 7, for the RSSR); forces are made up and only look plausible. Velocities are
differences over time. What a real analysis gives is looked at in `test_real_space.py`.
"""

from __future__ import annotations

import json

import numpy as np
import xarray as xr
from stand_in import blank

from trunnion.errors import Status
from trunnion.results.dataset import driven

X, Y, Z = np.eye(3)


def matrices(*columns):
    """(3, 3, position) of frames whose x, y, z are the given (3, position)."""
    return np.stack(np.broadcast_arrays(*columns), axis=1)


def frame(point=(0, 0, 0), z=Z, x=X):
    """Element of a joint on a link."""
    z, x = np.asarray(z, float), np.asarray(x, float)
    z = z / np.linalg.norm(z)
    x = Y - (Y @ z) * z if abs(x @ z) > 0.999 else x - (x @ z) * z
    return [list(map(float, point)), z.tolist(), (x / np.linalg.norm(x)).tolist()]


def quaternion(r):
    """w, x, y, z of (3, 3, position), continuous from one position to the next."""
    from scipy.spatial.transform import Rotation

    q = np.roll(Rotation.from_matrix(np.moveaxis(r, 2, 0)).as_quat(), 1, axis=1).T
    for i in range(1, q.shape[1]):
        if q[:, i] @ q[:, i - 1] < 0:
            q[:, i] *= -1
    return q


def rates(values, time):
    """First and second difference over time."""
    if time.size < 3:
        return np.zeros_like(values), np.zeros_like(values)
    first = np.gradient(values, time, axis=-1)
    return first, np.gradient(first, time, axis=-1)


def spin(r, time):
    """Angular velocity (3, position) of (3, 3, position)."""
    if time.size < 3:
        return np.zeros((3, time.size))
    w = np.einsum("ijn,kjn->ikn", np.gradient(r, time, axis=-1), r)
    return np.array([w[2, 1] - w[1, 2], w[0, 2] - w[2, 0], w[1, 0] - w[0, 1]]) / 2


def made(name, formula, links, joints, free, drivers, time, forces, moments, rotation, slide, **attrs):
    """A Dataset of the contract.

    links: name → (matrices, origin (3, position)), the ground first; joints: name → (type, [a, b], [frame, frame]);
    free: "link.point" → place in the link's frame; forces, moments: (joint, axis, position).
    """
    count = time.size
    points = {key: links[key.split(".")[0]] for key in free}
    places = {key: np.asarray(local, float) for key, local in free.items()}
    for joint, (_, two, frames) in joints.items():
        for link, one in zip(two, frames, strict=True):
            points[f"{link}.{joint}"], places[f"{link}.{joint}"] = links[link], np.array(one[0])
    track = np.array(
        [o + np.einsum("ijn,j->in", r, places[key]) for key, (r, o) in points.items()]
    )  # (point, axis, position)
    w = np.array([spin(r, time) for r, _ in links.values()])
    effort = np.array([moments[list(joints).index(one), :, :].sum(axis=0) + 4 for one in drivers])
    n = len(joints)
    loss = 0.01 * np.abs(forces).sum(axis=1)
    zero = np.zeros(count)
    data = {
        "link_position": (("link", "axis"), np.array([np.broadcast_to(o, (3, count)) for _, o in links.values()])),
        "link_rotation": (("link", "component"), np.array([quaternion(r) for r, _ in links.values()])),
        "link_angular_velocity": (("link", "axis"), w),
        "link_angular_acceleration": (("link", "axis"), rates(w, time)[0]),
        "point_position": (("point", "axis"), track),
        "point_velocity": (("point", "axis"), rates(track, time)[0]),
        "point_acceleration": (("point", "axis"), rates(track, time)[1]),
        "reaction_force": (("joint", "axis"), forces), "reaction_moment": (("joint", "axis"), moments),
        "friction_moment": (("joint", "axis"), -0.02 * moments), "friction_force": (("joint",), np.zeros((n, count))),
        "friction_torque": (("joint",), -0.01 * np.linalg.norm(moments, axis=1)),
        "friction_power": (("joint",), loss),
        "joint_rotation": (("joint",), rotation), "joint_slide": (("joint",), slide),
        "drive_effort": (("driver",), effort), "drive_effort_lower": (("driver",), effort),
        "drive_effort_upper": (("driver",), effort), "drive_power": (("driver",), 10 * effort),
        "useful_power": ((), 8 * effort.sum(axis=0)), "efficiency_instant": ((), zero + 0.8),
        "closure_residual": ((), zero + 1e-16), "condition": ((), zero + 3), "power_residual": ((), zero),
        "friction_iterations": ((), zero + 4), "friction_change": ((), zero),
        "friction_residual": ((), zero), "friction_contraction": ((), zero),
        "locking_margin": ((), zero + 5), "status": ((), np.zeros(count, np.int8)),
    }  # fmt: skip
    for stem in ("joint_rotation", "joint_slide"):
        dims, values = data[stem]
        data[f"{stem}_velocity"], data[f"{stem}_acceleration"] = ((dims, one) for one in rates(values, time))
    units = {"position": "m", "force": "N", "moment": "N m", "torque": "N m", "power": "W", "effort": "N m"}
    variables = {
        key: ((*dims, "position"), values, {"units": units.get(key.split("_")[-1], "1"), "long_name": key})
        for key, (dims, values) in data.items()
    }
    variables["friction_power_mean"] = ("joint", loss.mean(axis=1), {"units": "W", "long_name": "mean friction power"})
    variables["efficiency"] = ((), 0.8, {"units": "1", "long_name": "efficiency"})
    scene = {
        "space": "spatial", "ground": next(iter(links)),
        "links": {link: {"points": [key.split(".", 1)[1] for key in points if key.split(".")[0] == link]}
                  for link in links},
        "joints": {joint: {"type": kind, "links": list(two), "friction": True, "frames": frames}
                   for joint, (kind, two, frames) in joints.items()},
        "drivers": drivers, "gears": {}, "springs": {}, "passive": [],
        "loads": attrs.pop("loads", {}),
    }  # fmt: skip
    return xr.Dataset(
        variables,
        coords={**driven(time, np.degrees(rotation[list(joints).index(drivers[0])]), "°", drivers[0]),
                "joint": list(joints),
                "link": list(links), "point": list(points), "driver": drivers, "axis": ["x", "y", "z"],
                "component": ["w", "x", "y", "z"]},
        attrs={"name": name, "formula": formula, "model_hash": "9f2c41d07ab35e68", "trunnion_version": "0.1.0",
               "method": "newton", "references": "", "findings": "[]", "inputs": "[]", "summary": "[]",
               "scene": json.dumps(scene),
               "passive": "[]", **attrs},
    )  # fmt: skip


def _still(count):
    return np.broadcast_to(np.eye(3)[:, :, None], (3, 3, count)), np.zeros((3, count))


def _turned(angle):
    c, s, o = np.cos(angle), np.sin(angle), 0 * angle
    return matrices(np.array([c, s, o]), np.array([-s, c, o]), np.array([o, o, o + 1]))


def rssr(count=120, gap=None):
    """THEORY, section 7: a = 30, b = 120, c = 70, d = 100 mm, 60°, s₁ = 10, s₄ = 20 mm; one branch all the way."""
    a, b, c, d, alpha, s1, s4 = 0.03, 0.12, 0.07, 0.1, np.pi / 3, 0.01, 0.02
    theta = np.arange(count) * 2 * np.pi / count
    ball = np.array([a * np.cos(theta), a * np.sin(theta), s1 + 0 * theta])
    k = np.array([0, -np.sin(alpha), np.cos(alpha)])
    side = np.cross(k, X)
    centre = d * X + s4 * k
    reach = centre[:, None] - ball  # |reach + c (cos ψ X + sin ψ side)| = b
    p, q = 2 * c * (X @ reach), 2 * c * (side @ reach)
    rest = b * b - c * c - (reach**2).sum(axis=0)
    psi = np.unwrap(np.arctan2(q, p) + np.arccos(rest / np.hypot(p, q)))
    if np.degrees(psi[round(count / 6) % count]) < 0:
        psi = np.unwrap(np.arctan2(q, p) - np.arccos(rest / np.hypot(p, q)))
    end = centre[:, None] + c * (np.cos(psi) * X[:, None] + np.sin(psi) * side[:, None])
    along = (end - ball) / b
    across = np.cross(k, along.T).T
    across = across / np.linalg.norm(across, axis=0)
    tilt = matrices(X, np.cross(k, X), k)[..., None]
    links = {
        "ground": _still(count),
        "crank": (_turned(theta), np.zeros((3, count))),
        "coupler": (matrices(along, across, np.cross(along.T, across.T).T), ball),
        "rocker": (
            np.einsum("ijn,jkn->ikn", np.broadcast_to(tilt, (3, 3, count)), _turned(psi)),
            d * X[:, None] + 0 * theta,
        ),
    }
    joints = {
        "O": ("revolute", ["ground", "crank"], [frame(), frame()]),
        "A": ("spherical", ["crank", "coupler"], [frame((a, 0, s1)), frame()]),
        "B": ("spherical", ["coupler", "rocker"], [frame((b, 0, 0)), frame((c, 0, s4))]),
        "C": ("revolute", ["ground", "rocker"], [frame((d, 0, 0), k), frame()]),
    }
    push = 300 * along * (1 + 0.6 * np.cos(theta - 0.4))
    forces = np.array([push + 20 * Z[:, None], push, -push, push * 0.9])
    moments = np.array([np.cross(ball.T, push.T).T * [[1], [1], [0]], 0 * push, 0 * push, 0.02 * push])
    rotation = np.array([theta, 0.5 + 0.2 * np.sin(theta), 0.7 + 0.2 * np.cos(theta), psi])
    result = made(
        "RSSR linkage", "I(0,1)R → IV(2,3)SSR", links, joints,
        {"coupler.E": (0.06, 0.03, 0), "rocker.tip": (0.11, 0, s4)},
        ["O"], theta / 10, forces, moments, rotation, np.zeros((4, count)),
        loads={"work": {"link": "rocker", "joint": None, "at": "tip", "force": [0, -150.0, 60.0], "moment": None,
                        "frame": "global", "varies": False, "useful": True},
               "brake": {"link": "rocker", "joint": "C", "at": None, "force": None, "moment": [0, 0, -3.0],
                         "frame": "link", "varies": True, "useful": True}},
        passive=json.dumps(["coupler"]),
    )  # fmt: skip
    return blank(result, *gap) if gap else result


def cardan(count=120, delta=0.6, inputs=()):
    """An ideal Cardan joint as a Denavit–Hartenberg loop: all axes meet in one point."""
    theta = np.arange(count) * 2 * np.pi / count
    z1, z4 = Z[:, None] + 0 * theta, np.array([0, np.sin(delta), -np.cos(delta)])[:, None] + 0 * theta
    z2 = np.array([np.sin(theta), -np.cos(theta), 0 * theta])
    z3 = np.cross(z2.T, z4.T).T
    z3 = z3 / np.linalg.norm(z3, axis=0)

    def posed(z, following):
        x = np.cross(z.T, following.T).T
        x = x / np.linalg.norm(x, axis=0)
        return matrices(x, np.cross(z.T, x.T).T, z), np.zeros((3, count))

    links = {
        "ground": _still(count),
        "input-shaft": posed(z1, z2),
        "cross": posed(z2, z3),
        "output-shaft": posed(z3, z4),
    }
    quarter = frame(z=-Y)
    joints = {
        "input": ("revolute", ["ground", "input-shaft"], [frame(), frame()]),
        "pin-1": ("cylindrical", ["input-shaft", "cross"], [quarter, frame()]),
        "pin-2": ("cylindrical", ["cross", "output-shaft"], [quarter, frame()]),
        "output": ("cylindrical", ["output-shaft", "ground"], [quarter, frame(z=z4[:, 0])]),
    }
    out = np.unwrap(np.arctan2(np.cos(delta) * np.sin(theta), np.cos(theta)))
    moments = np.array([10 * z4 - 8 * z1, 10 * z3, 10 * z4, 8 * z2])
    forces = 0 * moments + 1e-3 * z3
    rotation = np.array([theta, np.sin(theta), np.cos(theta), out])
    return made("Ideal Cardan joint", "I(0,1)R → CCC", links, joints, {}, ["input"], theta / 100, forces, moments,
                rotation, np.zeros((4, count)), inputs=json.dumps(list(inputs)))  # fmt: skip


def every_kind(count=60):
    """A chain with one joint of every kind, each moved by itself; no closed loop."""
    turn = np.arange(count) * 2 * np.pi / count
    swing, flat = 0.5 * np.sin(turn), 0 * turn
    stay = _turned(flat)

    def step(pose, first, motion, slide, second):
        """Pose of the next link."""
        r, o = pose
        (p, z, x), (q, w, v) = first, second
        ra, rb = (np.array([one, np.cross(two, one), two]).T for one, two in ((x, z), (v, w)))
        rotation = np.einsum("ijn,jk,kln,lm->imn", r, ra, motion, rb.T)
        place = np.einsum("ijn,jn->in", r, np.array(p)[:, None] + np.einsum("ij,jn->in", ra, slide))
        return rotation, o + place - np.einsum("ijn,j->in", rotation, np.array(q))

    tilt = np.einsum("ijn,jk,kln->iln", _turned(swing), matrices(X, Z, -Y), _turned(swing))
    wave, third = np.sin(turn), np.array([flat, flat, flat + 1])
    around = np.array([np.sin(turn), np.cos(turn), flat])
    chain = [
        ("R", "revolute", frame((0, 0, 0)), _turned(turn * 0.1), np.zeros((3, count)), frame()),
        ("U", "universal", frame((0.2, 0, 0), X), tilt, np.zeros((3, count)), frame(z=Y)),
        ("C", "cylindrical", frame((0.2, 0, 0), Y), _turned(swing), 0.03 * wave * third, frame(z=Y)),
        ("H", "helical", frame((0.2, 0, 0), Z), _turned(swing), 0.02 * wave * third, frame(z=Z)),
        ("P", "prismatic", frame((0.2, 0, 0), X, Z), stay, (0.06 + 0.05 * wave) * third, frame(z=X, x=Z)),
        ("E", "planar", frame((0, 0.2, 0), Z), _turned(swing), 0.02 * around, frame()),
        ("S", "spherical", frame((0, 0.2, 0)), _turned(swing), np.zeros((3, count)), frame()),
        ("F", "fixed", frame((-0.2, 0, 0)), stay, np.zeros((3, count)), frame()),
    ]  # fmt: skip
    links, joints = {"ground": _still(count)}, {}
    before = "ground"
    for name, kind, first, motion, slide, second in chain:
        after = f"link {name}"
        links[after] = step(links[before], first, motion, slide, second)
        joints[name] = (kind, [before, after], [first, second])
        before = after
    n = len(joints)
    forces = np.zeros((n, 3, count)) + np.array([30, 40, 60])[None, :, None] * (1 + np.arange(n))[:, None, None]
    result = made("One joint of every kind", "", links, joints, {f"{before}.tip": (-0.15, 0, 0.1)}, ["R"], turn, forces,
                  0.05 * forces, np.array([turn] + [swing] * (n - 1)), np.zeros((n, count)) + swing * 0.02)  # fmt: skip
    return result


SPATIAL = {
    "RSSR": rssr,
    "gap": lambda: rssr(gap=(40, 60, Status.NOT_ASSEMBLED)),
    "nowhere": lambda: rssr(24, gap=(0, 24, Status.NOT_ASSEMBLED)),
    "locked": lambda: rssr(24, gap=(0, 24, Status.LOCKED)),
    "one position": lambda: rssr(1),
    "Cardan": cardan,
    "every kind": every_kind,
}
