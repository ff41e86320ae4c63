"""Results made by hand, for what a view must bear: gaps, one position, odd names, a sliding drive.

The numbers are those of a plausible four-bar and slider; the views take them as they stand. What a real analysis
gives is looked at in `test_real.py`.
"""

from __future__ import annotations

import json

import numpy as np
import xarray as xr

from trunnion.results.dataset import driven

# names that try to break out of a page or a plot
NASTY = {
    "A": "Ω—Welle",
    "B": "</script><script>alert(1)</script>",
    "C": '<img src=x onerror="alert(2)">',
    "D": "_$x$ & <!-- 曲柄",
}


UNITS = {
    "joint_rotation": "rad", "joint_slide": "m", "link_angle": "rad", "point_position": "m",
    "reaction_force": "N", "reaction_moment": "N m", "friction_torque": "N m", "friction_force": "N",
    "friction_power": "W", "drive_effort": "N m", "drive_effort_lower": "N m", "drive_effort_upper": "N m",
    "drive_power": "W", "useful_power": "W", "efficiency": "1", "efficiency_instant": "1",
    "closure_residual": "m", "condition": "1", "power_residual": "W", "friction_iterations": "1",
    "friction_change": "N", "friction_residual": "N", "friction_contraction": "1", "status": "1",
}  # fmt: skip


def assemble(joints, links, points, drivers, columns, attrs, effort="N m"):
    """A Dataset of the contract from plain arrays; velocities and accelerations by difference over time."""
    count = len(columns["time"])
    dims = {
        "joint": ("joint", "position"), "link": ("link", "position"), "point": ("point", "axis", "position"),
        "drive": ("driver", "position"), "reaction_force": ("joint", "axis", "position"),
    }  # fmt: skip
    variables = {}
    for name, values in columns.items():
        values = np.asarray(values)
        if name == "time":
            continue
        key = name.split("_")[0] if name != "reaction_force" else name
        shape = dims.get({"reaction": "joint", "friction": "joint"}.get(key, key), ("position",))
        if values.ndim < len(shape):
            shape = ("position",) if values.ndim else ()
        unit = effort if name.startswith("drive_effort") else UNITS[name]
        variables[name] = (shape, values, {"units": unit, "long_name": name.replace("_", " ")})
    for name in ("joint_rotation", "joint_slide", "link_angle", "point_position"):
        shape, values, _ = variables[name]
        stem = "point" if name == "point_position" else name
        rate = np.gradient(values, columns["time"], axis=-1) if count > 1 else np.zeros_like(values)
        second = np.gradient(rate, columns["time"], axis=-1) if count > 1 else np.zeros_like(values)
        unit = UNITS[name]
        variables[f"{stem}_velocity"] = (shape, rate, {"units": f"{unit}/s", "long_name": f"{stem} velocity"})
        about = {"units": f"{unit}/s^2", "long_name": f"{stem} acceleration"}
        variables[f"{stem}_acceleration"] = (shape, second, about)
    mean = np.mean(np.array(columns["friction_power"], float), axis=1)
    variables["friction_power_mean"] = ("joint", mean, {"units": "W", "long_name": "mean friction power"})
    return xr.Dataset(
        variables,
        coords={
            **driven(columns["time"], *_drive(columns, joints, drivers[0], effort)),
            "joint": joints,
            "link": links,
            "point": points,
            "driver": drivers,
            "axis": ["x", "y"],
        },
        attrs={
            "model_hash": "9f2c41d07ab35e68",
            "trunnion_version": "0.1.0",
            "method": "newton",
            "references": "Durango, Calle, Ruiz (2010), J. Braz. Soc. Mech. Sci., doi:10.1590/S1678-58782010000300010",
            "findings": "[]",
            "inputs": "[]",
            "summary": "[]",
            **attrs,
        },
    )


def _drive(columns, joints, driver, effort):
    """Coordinate of the first driver, its unit and its name."""
    place = joints.index(driver)
    if effort == "N":
        return 1e3 * columns["joint_slide"][place], "mm", driver
    return np.degrees(columns["joint_rotation"][place]), "°", driver


def _solve(theta, friction=1.0):
    """Motion and reactions of the four-bar of Durango, roughly: enough to look right."""
    a, b, c, d = 2.0, 6.0, 3.0, 5.5
    A = np.zeros((2, theta.size))
    D = np.stack([np.full_like(theta, d), np.zeros_like(theta)])
    B = a * np.stack([np.cos(theta), np.sin(theta)])
    r = D - B
    e = np.hypot(*r)
    along = (b * b - c * c + e * e) / (2 * e)
    height = np.sqrt(b * b - along * along)
    u = r / e
    C = B + along * u + height * np.stack([-u[1], u[0]])
    phi = np.arctan2(*(C - B)[::-1])
    psi = np.unwrap(np.arctan2(*(C - D)[::-1]))
    E = B + 2.5 * np.stack([np.cos(phi + np.pi / 6), np.sin(phi + np.pi / 6)])
    dC = (
        np.gradient(np.gradient(C, 0.1 * np.diff(theta).mean() if theta.size > 1 else 1.0, axis=1), axis=1)
        if theta.size > 2
        else C
    )
    FC = np.stack([300 + 40 * np.abs(dC).max() * np.cos(theta), 900 * np.sin(theta) ** 2 - 120])
    FB = FC * 6 + np.stack([900 * np.cos(2 * theta), 700 * np.sin(theta - 0.4)])
    FA = FB + np.stack([240 * np.cos(theta), 240 * np.sin(theta)])
    forces = np.stack([FA, FB, FC, -FC * 1.2])
    loss = 0.4 * 0.0075 * np.hypot(forces[:, 0], forces[:, 1])
    slip = 10 * np.stack(
        [np.ones_like(theta), 1 + 0.4 * np.sin(theta), 0.7 + 0.5 * np.cos(theta), np.sin(theta - 0.25)]
    )
    power = friction * loss * np.abs(slip)
    ideal = B[0] * FB[1] - B[1] * FB[0]
    return A, B, C, D, E, phi, psi, forces, power, -np.sign(slip) * loss * friction, ideal + power.sum(0) / 10


def four_bar(count=360, friction=1.0, rename=None, gap=None):
    """The four-bar; `rename` maps joint names, `gap` (start, stop, status) blanks positions."""
    theta = np.arange(count) * (2 * np.pi / count)
    A, B, C, D, E, phi, psi, forces, power, torque, effort = _solve(theta, friction)
    nan = np.zeros(count)
    new = rename or {}
    a, b, c, d = (new.get(k, k) for k in "ABCD")
    joints = [a, b, c, d]
    links = ["ground", "crank", "coupler", "rocker"]
    points = [f"ground.{a}", f"ground.{d}", f"crank.{a}", f"crank.{b}", f"coupler.{b}", f"coupler.{c}", "coupler.E",
              f"rocker.{d}", f"rocker.{c}"]  # fmt: skip
    useful = 9 * effort
    result = assemble(
        joints, links, points, [a],
        {
            "time": theta / 10,
            "joint_rotation": [theta, phi - theta, psi - phi, psi], "joint_slide": np.zeros((4, count)),
            "link_angle": [nan, theta, phi, psi], "point_position": [A, D, A, B, B, C, E, D, C],
            "reaction_force": forces, "reaction_moment": np.zeros((4, count)), "friction_torque": torque,
            "friction_force": np.zeros((4, count)), "friction_power": power,
            "drive_effort": [effort], "drive_effort_lower": [effort], "drive_effort_upper": [effort],
            "drive_power": [10 * effort], "useful_power": useful, "efficiency": 0.87,
            "efficiency_instant": np.clip(useful / (10 * effort), 0, 1), "closure_residual": nan + 3e-16,
            "condition": 3 + 2 * np.cos(theta), "power_residual": 1e-12 * np.sin(theta),
            "friction_iterations": np.full(count, 4), "friction_change": nan + 1e-11, "friction_residual": nan + 1e-13,
            "friction_contraction": nan + 0.004, "status": np.zeros(count, np.int8),
        },
        {
            "name": "Four-bar of Durango, Calle and Ruiz (2010)", "formula": "I(0,1)R → II(2,3)RRR",
            "scene": json.dumps({
                "ground": "ground",
                "links": {"ground": {"points": [a, d]}, "crank": {"points": [a, b]},
                          "coupler": {"points": [b, c, "E"]}, "rocker": {"points": [d, c]}},
                "joints": {a: {"type": "revolute", "links": ["ground", "crank"]},
                           b: {"type": "revolute", "links": ["crank", "coupler"]},
                           c: {"type": "revolute", "links": ["coupler", "rocker"]},
                           d: {"type": "revolute", "links": ["ground", "rocker"]}},
                "loads": {"work": {"link": "coupler", "at": "E", "force": [0, -1000.0], "moment": 0, "useful": True},
                          "brake": {"link": "rocker", "at": None, "force": [0, 0], "moment": -250.0, "useful": True}},
            }),
            "summary": json.dumps([
                {"label": "Drive torque, largest", "value": 9288.302313, "unit": "N m"},
                {"label": "Drive torque, smallest", "value": -18552.874991, "unit": "N m"},
                {"label": "Friction power, mean", "value": 517.465106, "unit": "W"},
                {"label": "Efficiency over the turn", "value": 0.871234, "unit": "1"},
                {"label": "Worst power residual", "value": 3.1e-12, "unit": "W"},
                {"label": "Iterations, most", "value": 4, "unit": "1"}]),
            "findings": json.dumps([
                {"severity": "note", "where": "joints.D", "what": "relative speed changes sign at 14.4° and 212.2°",
                 "remedy": "expect stick there"}]),
            "inputs": json.dumps([
                {"path": "dimensions.AB", "value": 2.0, "unit": "m", "text": "2.00 m"},
                {"path": "dimensions.gamma", "value": 0.5235987755982988, "unit": "rad", "text": "30 deg"},
                {"path": "links.crank.mass", "value": 4.8, "unit": "kg", "text": "4.8 kg"},
                {"path": "joints.A.friction.coefficient", "value": 0.4, "unit": "1", "text": "0.40"}]),
        },
    )  # fmt: skip
    return blank(result, *gap) if gap else result


def blank(result, start, stop, status):
    """The same result with no answer at the positions start ≤ i < stop."""
    hole = (np.arange(result.sizes["position"]) >= start) & (np.arange(result.sizes["position"]) < stop)
    out = result.copy(deep=True)
    for name, column in out.data_vars.items():
        if "position" in column.dims and name != "status":
            out[name] = column.astype(float).where(~hole)
            out[name].attrs = column.attrs
    out["status"] = ("position", np.where(hole, int(status), out["status"].values).astype(np.int8), out["status"].attrs)
    return out


def slider(count=90):
    """A block pushed along an inclined guide, dragging a rod: a prismatic drive, lengths of millimetres."""
    s = np.linspace(0, 0.08, count)
    tilt = np.pi / 6
    axis = np.array([np.cos(tilt), np.sin(tilt)])[:, None]
    zero = np.zeros((2, count))
    S = axis * s
    height = S[1] + 0.02
    lean = np.arcsin(height / 0.2)
    Q = S + 0.0
    R = np.stack([Q[0] + 0.2 * np.cos(lean), Q[1] - 0.2 * np.sin(lean)])
    flat = np.zeros(count)
    force = np.stack([-40 + 100 * s, 15 + 0 * s])
    effort = 60 + 300 * s
    return assemble(
        ["S", "Q", "R", "T"], ["frame", "block", "rod", "foot"],
        ["frame.S", "frame.T", "block.S", "block.Q", "rod.Q", "rod.R", "foot.R", "foot.T"], ["S"],
        {
            "time": s / 0.05, "joint_rotation": [flat, -lean, lean, flat],
            "joint_slide": [s, flat, flat, R[0] - R[0][0]],
            "link_angle": [flat, flat + tilt, -lean, flat],
            "point_position": [zero, zero + np.array([[0.2], [-0.02]]), S, Q, Q, R, R, R],
            "reaction_force": [force, force * 0.8, force * 0.7, force * 0.3],
            "reaction_moment": [flat + 0.4, flat, flat, flat + 0.1],
            "friction_torque": np.zeros((4, count)), "friction_force": [flat + 4, flat, flat, flat + 2],
            "friction_power": [flat + 0.2, flat + 0.01, flat + 0.02, flat + 0.1],
            "drive_effort": [effort], "drive_effort_lower": [effort - 4], "drive_effort_upper": [effort + 6],
            "drive_power": [effort * 0.05], "useful_power": effort * 0.04, "efficiency": 0.8,
            "efficiency_instant": flat + 0.8, "closure_residual": flat, "condition": flat + 2, "power_residual": flat,
            "friction_iterations": np.full(count, 3), "friction_change": flat, "friction_residual": flat,
            "friction_contraction": flat,
            "status": np.zeros(count, np.int8),
        },
        {
            "name": "Inclined pusher", "formula": "I(0,1)P → II(2,3)RRP",
            "scene": json.dumps({
                "ground": "frame",
                "links": {"frame": {"points": ["S", "T"]}, "block": {"points": ["S", "Q"]},
                          "rod": {"points": ["Q", "R"]}, "foot": {"points": ["R", "T"]}},
                "joints": {"S": {"type": "prismatic", "links": ["frame", "block"], "axis": [axis[0, 0], axis[1, 0]]},
                           "Q": {"type": "revolute", "links": ["block", "rod"]},
                           "R": {"type": "revolute", "links": ["rod", "foot"]},
                           "T": {"type": "prismatic", "links": ["frame", "foot"], "axis": [1.0, 0.0]}},
                "loads": {"push": {"link": "foot", "at": "R", "force": [-50.0, 0], "moment": 0, "useful": True}},
            }),
        },
        "N",
    )  # fmt: skip
