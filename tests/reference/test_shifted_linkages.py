"""What pins off the middle of their holes do to whole linkages, against closures written here once more.

The four-bar and the RSSR of THEORY section 7 with their published numbers; then whole random mechanisms in which the
places of the elements are changed in the model data, by another program, and not by the engine.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import optimize

import trunnion
from mechanisms import MODELS, build, four_bar, model
from mechanisms_space import MODELS as SPACE_MODELS
from mechanisms_space import Drawn
from mechanisms_space import rssr as rssr_model
from reference.maximal_space import Array, Data, Drive, Frame, Linkage, rotation
from reference.shifted_space import moved
from trunnion.joints.clearance import CLEARANCE_MODELS, worst_case
from trunnion.solve.run import prepare

FOUR_BAR = (0.100, 0.030, 0.090, 0.070)  # ground, crank, coupler, rocker; m
SIZE, THETA = 2e-5, np.pi / 3
NOW = np.array([0.0])
HOLES = {"A": "crank", "B": "coupler", "C": "rocker", "D": "rocker"}  # the second link of each joint


# ---- four-bar ---------------------------------------------------------------------------------------------------


def rocker_angle(shift: dict[str, Any]) -> Any:
    """Angle of the rocker at 60°, open branch, pins off the middle of their holes by vectors x + i y, global axes.

    The hole is on the second link: its point lies at −c from where the first link's is.
    """
    ground, ab, bc, cd = FOUR_BAR
    start = -shift.get("A", 0) + ab * np.exp(1j * THETA) - shift.get("B", 0)
    end = ground - shift.get("D", 0) + shift.get("C", 0)  # middle of the coupler pin's circle, as C is on the coupler
    far = np.abs(end - start)
    along = (bc**2 - cd**2 + far**2) / (2 * far)
    pin = start + (end - start) / far * (along + 1j * np.sqrt(bc**2 - along**2))
    return np.angle(pin - end)


@pytest.mark.parametrize("joint", ["A", "B", "C", "D"])
def test_four_bar_with_play_in_one_joint(joint: str) -> None:
    """0.02 mm in any one joint at 60°: 0.017902° by ρ |Q|, and by going round to second order."""
    ideal = rocker_angle({})
    assert np.degrees(ideal) == pytest.approx(95.195700, abs=5e-7)
    around = np.exp(1j * np.linspace(0, 2 * np.pi, 72001))
    worst = [np.degrees(np.max(np.abs(rocker_angle({joint: rho * around}) - ideal))) for rho in (SIZE, SIZE / 10)]
    assert worst[0] == pytest.approx(0.017902, abs=6e-6)
    assert 10 * worst[1] == pytest.approx(0.017902, abs=1e-6)
    # unit moment on the rocker: the coupler carries the force that balances it, and so does every joint
    _, ab, bc, cd = FOUR_BAR
    arm = cd * np.exp(1j * ideal)
    rod = (FOUR_BAR[0] + arm - ab * np.exp(1j * THETA)) / bc
    load = rod / np.imag(np.conj(arm) * rod)
    loads = CLEARANCE_MODELS["planar"]["revolute"].loads((load.real, load.imag), (0.0,), 1.0)
    assert np.degrees(float(worst_case(loads, [SIZE]))) == pytest.approx(0.017902, abs=5e-7)


@pytest.mark.parametrize("joints", ["A", "B", "C", "D", "ABCD"])
def test_four_bar_of_the_engine_with_given_offsets(joints: str) -> None:
    """The same angle from `seats.JOINT.1.x` among the values, to 1e-12, alone and in all joints at once."""
    ground, ab, bc, cd = FOUR_BAR
    data = four_bar(ab, bc, cd, ground)
    data["drivers"]["A"]["start"] = THETA
    run, rng = prepare(build(data, friction=None)), np.random.default_rng(9)
    for _ in range(20):
        c = {joint: SIZE * complex(*rng.normal(size=2)) for joint in joints}
        seats = {f"seats.{joint}.1.{axis}": float(part) for joint, vector in c.items()
                 for axis, part in (("x", vector.real), ("y", vector.imag))}  # fmt: skip
        found = run.solve(NOW, values={**run.values, **seats}).walk
        frames = {link: motion.frame for link, motion in found.motions.items()}
        # stated in the axes of the link with the hole: in global ones by that link's angle as it comes
        turns = {link: complex(np.ravel(frame.c)[0], np.ravel(frame.s)[0]) for link, frame in frames.items()}
        shift = {joint: vector * turns[HOLES[joint]] for joint, vector in c.items()}
        assert np.angle(turns["crank"]) == pytest.approx(THETA, abs=1e-12)
        assert np.angle(turns["rocker"]) == pytest.approx(rocker_angle(shift), abs=1e-12)


# ---- RSSR -------------------------------------------------------------------------------------------------------

RSSR = {"a": 0.030, "b": 0.120, "c": 0.070, "d": 0.100, "alpha": np.pi / 3, "s1": 0.010, "s4": 0.020}
LENGTH = 0.020  # H of the output bearing, mid-length at (d, 0, 0)
K = np.array([0, -np.sin(RSSR["alpha"]), np.cos(RSSR["alpha"])])
AXES = np.column_stack([[1.0, 0, 0], np.cross(K, [1.0, 0, 0]), K])
BALL = np.array([RSSR["a"] * np.cos(THETA), RSSR["a"] * np.sin(THETA), RSSR["s1"]])


def tilted(c1: Array, c2: Array) -> Frame:
    """Frame of a pin whose axis passes the ends at c₁, c₂: z turned on C₂ − C₁ by the shortest way."""
    u = np.array([*(c2 - c1), LENGTH]) / np.hypot(LENGTH, np.linalg.norm(c2 - c1))
    axis = np.array([-u[1], u[0], 0])
    size = np.linalg.norm(axis)
    turn = rotation(axis, float(np.arctan2(size, u[2]))) if size else np.eye(3)
    return Frame(np.array([*(c1 + c2) / 2, 0.0]), turn)


def output_angle(shift: Frame, hole: str) -> float:
    """ψ with |AB| = b. The hole is in the ground: its frame goes to the pin's; in the rocker: the other way round."""
    bearing, local = Frame(np.array([RSSR["d"], 0, 0]), AXES), np.array([RSSR["c"], 0, RSSR["s4"]])
    if hole == "ground":
        bearing = bearing @ shift
    else:
        local = shift.axes.T @ (local - shift.place)
    x, y, k = bearing.axes.T
    radius, start = np.hypot(local[0], local[1]), np.arctan2(local[1], local[0])
    p = bearing.place + local[2] * k - BALL
    e, f = 2 * radius * p @ x, 2 * radius * p @ y
    g = RSSR["b"] ** 2 - radius**2 - p @ p
    return float(np.arctan2(f, e) + np.arctan2(np.sqrt(e * e + f * f - g * g), g) - start)


def ends(angles: Array, radius: float = SIZE) -> tuple[Array, Array]:
    c1, c2 = (radius * np.array([np.cos(angle), np.sin(angle)]) for angle in angles)
    return c1, c2


def worst(hole: str, sign: int, radius: float = SIZE) -> tuple[float, Array]:
    """Largest change of ψ to one side over the whole play, deg, and where the pin's ends are: from many starts."""
    ideal, rng, best = output_angle(tilted(*ends(np.zeros(2), 0.0)), hole), np.random.default_rng(1), (0.0, np.zeros(2))

    def less(angles: Array) -> float:
        return -sign * (output_angle(tilted(*ends(angles, radius)), hole) - ideal) / radius

    for _ in range(12):
        found = optimize.minimize(less, rng.uniform(-np.pi, np.pi, 2), method="BFGS", options={"gtol": 1e-7})
        if -found.fun > best[0]:
            best = (-float(found.fun), found.x)
    inside = [less(angles) * sign for angles in rng.uniform(-np.pi, np.pi, (200, 2))]
    assert np.max(np.abs(inside)) <= best[0] * 1.01
    return float(np.degrees(best[0] * radius)), best[1]


def unit_loads() -> list[Any]:
    """Loads of the rocker's pin on the ends of the output bearing, from a unit moment on the rocker about its axis.

    The rod holds the rocker against that moment; all of its force goes on into the bearing.
    """
    psi = output_angle(tilted(*ends(np.zeros(2), 0.0)), "ground")
    arm = RSSR["s4"] * K + RSSR["c"] * (np.cos(psi) * AXES[:, 0] + np.sin(psi) * AXES[:, 1])
    rod = (np.array([RSSR["d"], 0, 0]) + arm - BALL) / RSSR["b"]
    force = -rod / (K @ np.cross(arm, rod))
    moment = np.cross(arm, force)
    return CLEARANCE_MODELS["spatial"]["revolute"].loads(tuple(force @ AXES), tuple(moment @ AXES), LENGTH)[:2]


def test_rssr_output_bearing() -> None:
    """ρ (|Q₁| + |Q₂|) = 0.044402°; the whole closure gives 0.044448° one way (ψ rises) and 0.044356° the other.

    The same whether the hole is in the ground or in the rocker; half the clearance has a quarter of the difference.
    """
    assert np.degrees(output_angle(tilted(*ends(np.zeros(2), 0.0)), "ground")) == pytest.approx(73.843222, abs=5e-7)
    loads = unit_loads()
    linear = np.degrees(float(worst_case(loads, [SIZE, SIZE])))
    assert linear == pytest.approx(0.044402, abs=5e-7)
    for hole in ("ground", "rocker"):
        up, where = worst(hole, 1)
        assert up == pytest.approx(0.044448, abs=5e-7)
        assert worst(hole, -1)[0] == pytest.approx(0.0443555, abs=5e-7)
        assert np.degrees(np.abs(np.angle(np.exp(1j * (where[0] - where[1]))))) == pytest.approx(124.42, abs=0.01)
        half = worst(hole, 1, SIZE / 2)[0]
        assert (up - linear) / (half - linear / 2) == pytest.approx(4.0, rel=0.02)
    # with the hole in the ground the best seat lies along the loads, to first order, in the axes of the ground
    for q, c in zip(loads, ends(worst("ground", 1)[1]), strict=True):
        away = np.degrees(np.angle(complex(*c) / complex(*(float(n) for n in q))))
        assert abs(away) < 0.1


def test_rssr_of_the_engine_with_given_offsets() -> None:
    """ψ from `seats.D.1.x` … among the values to 1e-12, offsets at the walls and inside; the rocker has the hole."""
    data = rssr_model(start=THETA).data
    data["joint_defaults"]["pin"] |= {"bearing": LENGTH}
    run, rng = prepare(trunnion.Mechanism(trunnion=1, **data)), np.random.default_rng(3)
    for _ in range(40):
        c = SIZE * rng.normal(size=(2, 2))
        seats = {f"seats.D.{i + 1}.{axis}": float(c[i, k]) for i in range(2) for k, axis in enumerate("xy")}
        psi, _ = run.solve(NOW, values={**run.values, **seats}).walk.coordinates("D")
        assert float(np.ravel(psi)[0]) == pytest.approx(output_angle(tilted(c[0], c[1]), "rocker"), abs=1e-12)


# ---- any mechanism: another model with its elements moved by hand ----------------------------------------------


def offsets_for(space: str, data: Data, size: float, seed: int) -> dict[str, float]:
    """Random offsets of every joint that has a model of its play."""
    rng, found = np.random.default_rng(seed), {}
    for name, joint in data["joints"].items():
        if joint["type"] in CLEARANCE_MODELS[space]:
            keys = [key for end in CLEARANCE_MODELS[space][joint["type"]].ends for key in end]
            found |= {f"seats.{name}.{key}": float(size * rng.uniform(-1, 1)) for key in keys}
    return found


@pytest.mark.spread(2)
@pytest.mark.parametrize("name", SPACE_MODELS)
def test_mechanisms_in_space_with_offsets_in_every_joint(name: str) -> None:
    """Frames of all links against maximal coordinates, to 1e-10: offsets up to 1 mm, bearings off their points."""
    drawn = SPACE_MODELS[name]()
    assert isinstance(drawn, Drawn)
    seats = offsets_for("spatial", drawn.data, 1e-3, seed=4)
    if not seats:
        pytest.skip("no joint with play")
    run = prepare(trunnion.Mechanism(trunnion=1, **drawn.data))
    motions = run.solve(NOW, values={**run.values, **seats}).walk.motions
    other = Linkage(moved(drawn.data, seats))
    drive = {joint: Drive(float(run.system.drive(run.values, joint, 0.0)[0])) for joint in drawn.data["drivers"]}
    home = drawn.home if drawn.home else {}
    frames = other.move(home, drive)
    for link in other.moving:
        if link in other.free:
            continue
        frame = motions[link].frame
        axes = np.array([[float(np.ravel(axis[i])[0]) for axis in frame[:3]] for i in range(3)])
        place = [float(np.ravel(n)[0]) for n in frame.place]
        np.testing.assert_allclose(axes, frames[link].frame.axes, rtol=0, atol=1e-10)
        np.testing.assert_allclose(place, frames[link].frame.place, rtol=0, atol=1e-10)


def moved_planar(data: Data, seats: dict[str, float], guide: float) -> Data:
    """The planar model with second elements moved as the offsets say; loads stay where they are."""
    links = {name: {**link, "points": dict(link["points"])} for name, link in data["links"].items()}
    loads = {name: dict(load) for name, load in data.get("loads", {}).items()}
    for load in loads.values():
        if "at" in load:
            at = links[load["link"]]["points"][load["at"]]
            load["at"] = f"under {load['at']}"
            links[load["link"]]["points"][load["at"]] = at["at"] if isinstance(at, dict) else at
    for name, joint in data["joints"].items():
        if f"seats.{name}.1.y" not in seats:
            continue
        points = links[joint["links"][1]]["points"]
        if joint["type"] == "revolute":
            points[name] = [n + seats[f"seats.{name}.1.{axis}"] for n, axis in zip(points[name], "xy", strict=True)]
        else:
            axis = complex(*points[name]["axis"]) / abs(complex(*points[name]["axis"]))
            y1, y2 = (seats[f"seats.{name}.{end}.y"] for end in (1, 2))
            turned = axis * np.exp(1j * np.arctan((y2 - y1) / guide))
            at = complex(*points[name]["at"]) + 1j * axis * (y1 + y2) / 2
            points[name] = {"at": [at.real, at.imag], "axis": [turned.real, turned.imag]}
    return {**data, "links": links, "loads": loads}


@pytest.mark.spread(12)
@pytest.mark.parametrize("name", MODELS)
def test_planar_mechanisms_with_offsets_in_every_joint(name: str) -> None:
    """Seats as values and a model with its points moved are one mechanism: poses, forces and drives to 1e-9."""
    data, guide = model(MODELS[name](), friction=0.1), 0.4
    seats = offsets_for("planar", data, 1e-3, seed=5)
    run = prepare(trunnion.Mechanism(trunnion=1, **data))
    time = run.cycle.times(7)
    one = run.solve(time, values={**run.values, **seats})
    other_run = prepare(trunnion.Mechanism(trunnion=1, **moved_planar(data, seats, guide)))
    other = other_run.solve(time)
    for link, motion in one.walk.motions.items():
        for a, b in zip(motion.frame, other.walk.motions[link].frame, strict=True):
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-10)
    for driver, effort in one.efforts.items():
        expected = np.asarray(other.efforts[driver])
        np.testing.assert_allclose(effort, expected, rtol=0, atol=1e-8 * np.nanmax(np.abs(expected)))
