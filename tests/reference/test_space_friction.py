"""Friction and efficiency in space against closed forms: massless Cardan joint, screws, locking, no friction at all."""

from __future__ import annotations

from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import trunnion
from brief import brief
from mechanisms_space import cardan, floating, rssr
from reference.maximal_space import Data, unrolled
from reference.space_oracle import Oracle
from reference.test_newton_euler_space import Compared
from reference.test_space_values import loop
from trunnion.solve.run import prepare
from trunnion.solve.space.determinacy import LOOKED

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
LOCKED = int(trunnion.Status.LOCKED)
PIN, ARM = 0.010, 0.040  # radius of the cross pins, and where on the cross the forks hold it


def analysed(data: Data, steps: int, **options: Any) -> xr.Dataset:
    return trunnion.analyse(trunnion.Mechanism(trunnion=1, **data), steps=steps, **options)


def hooke(delta: float, friction: float, shafts: float = 0.0) -> Data:
    """Massless ideal Cardan joint; the ends of a bearing as long as the cross is wide are where the forks hold it."""
    brake = {"brake": {"joint": "D", "resisting_torque": 10.0, "useful": True}}
    data = loop("RCCC", (90, 90, 90, 180 - delta), start=0.003, assembly={"D": -np.pi / 2}, loads=brake)
    for row in data["loop"][1:3]:
        row |= {"pin": {"radius": PIN, "bearing": 2 * ARM}, "friction": friction}
    if shafts:
        for row, span in ((data["loop"][0], 0.1), (data["loop"][3], 0.15)):
            row |= {"pin": {"radius": shafts, "bearing": span}, "friction": friction}
    return data


@pytest.mark.spread(3)
@pytest.mark.parametrize("shafts", [0.0, 0.02])
@pytest.mark.parametrize("delta", [5.0, 15.0, 30.0, 45.0])
def test_massless_cardan(delta: float, shafts: float) -> None:
    """1 − η to the first order in f; what is left shrinks as f².

    Pins (2/π) f (r_p/R_c) [tan δ + ln tan(π/4 + δ/2)]; shafts (4/π) f r_b [tan δ/l₂ + ln tan(π/4 + δ/2)/l₁], l₁ of the
    input, l₂ of the output, whose torque is constant here. With a constant torque of the input they change places.
    """
    d = np.radians(delta)
    tangent, logarithm = np.tan(d), np.log(np.tan(np.pi / 4 + d / 2))
    slope = 2 / np.pi * PIN / ARM * (tangent + logarithm) + 4 / np.pi * shafts * (logarithm / 0.1 + tangent / 0.15)
    left = []
    for f in np.array([0.02, 0.01, 0.005]) / (5 if shafts else 1):  # the shafts' own friction leans on their load
        loss = 1 - float(analysed(hooke(delta, f, shafts), 1440).efficiency)
        assert loss == pytest.approx(slope * f, rel=0.05)
        left.append(loss - slope * f)
    assert left[0] / left[1] == pytest.approx(4, rel=0.1)
    assert left[1] / left[2] == pytest.approx(4, rel=0.1)


@pytest.mark.parametrize(
    "data",
    [
        {**cardan(), "joint_defaults": {}},
        {**cardan(misalignment=45.0, error=0.5, offset=30.0), "joint_defaults": {}},
        hooke(30.0, 0.0),
        {**rssr().data, "joint_defaults": {}, "gravity": [0, 0, 0]},
    ],
    ids=["Cardan with inertia", "at 45 degrees", "massless", "RSSR with inertia"],
)
def test_nothing_is_lost_without_friction(data: Data) -> None:
    """η = 1 within 1e-12, and the power balances to 1e-10 of its peak at every position."""
    data = {**data, "drivers": {name: {**one, "start": 0.003} for name, one in data["drivers"].items()}}
    result = analysed(data, 720)
    peak = float(np.max(np.abs(result.drive_power.values)))
    assert np.max(np.abs(result.power_residual.values)) < 1e-10 * peak
    taken, given = float(result.useful_power.mean()), float(result.drive_power.sum("driver").mean())
    assert float(result.efficiency) == pytest.approx(taken / given, abs=1e-13)
    assert float(result.efficiency) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.slow
def test_efficiency_falls_with_angle_and_speed() -> None:
    """As in Fig. 9 of Pezzuti et al.: with misalignment (left), and with speed (right) by the inertia alone."""
    angles = [float(analysed(cardan(misalignment=angle), 45).efficiency) for angle in (5.0, 20.0, 35.0)]
    assert all(a > b for a, b in pairwise(angles))
    speeds = []
    for speed in (10.0, 150.0, 300.0):
        data = {**cardan(), "drivers": {"input": {"speed": speed}}}
        speeds.append(float(analysed(data, 45).efficiency))
    assert all(a > b for a, b in pairwise(speeds))
    massless = [
        float(analysed({**hooke(20.0, 0.1), "drivers": {"A": {"speed": speed, "start": 0.003}}}, 90).efficiency)
        for speed in (1.0, 300.0)
    ]
    assert massless[0] == pytest.approx(massless[1], abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["two-contact", "pezzuti"])
def test_short_bearing_locks(model: str) -> None:
    """As printed, with 10 mm, it is locked at every position; the margin is where the oracle's effort goes to infinity.

    Just below it the effort grows as 1/(margin − share), so it is ten times as large ten times nearer; above it the
    oracle has no solution.
    """
    data = {**cardan(bearing=0.010, model=model), "drivers": {"input": {"speed": 100.0, "start": 0.07}}}
    result = analysed(data, 9)
    assert set(result.status.values) == {LOCKED}
    assert np.isnan(result.drive_effort.values).all()
    margin = result.locking_margin.values
    assert np.all(margin < 1)
    if model == "pezzuti":
        assert 0.42 * float(margin.min()) == pytest.approx(0.2, abs=0.01), "critical coefficient of their law"
    compared = Compared.__new__(Compared)
    compared.result, compared.oracle = result, Oracle(unrolled(data))
    for i in (0, 4):
        motions = compared.motion(i)

        def effort(share: float, at: int = i, motions: Any = motions) -> float:
            for joint in compared.oracle.joint.values():
                joint["friction"]["coefficient"] = 0.42 * share * float(margin[at])
            return compared.oracle.rub(motions)[0].effort["input"]

        near, nearer = effort(0.999), effort(0.9999)
        assert near > 100 * effort(0.0)
        assert nearer / near == pytest.approx(10, rel=0.02)
        with pytest.raises(AssertionError, match="does not settle"):
            effort(1.001)


@pytest.mark.slow
def test_long_bearing_runs() -> None:
    """With 60 mm at 15° it runs; Newton in at most 20 rounds, successive approximation in far more near its limit."""
    for model in ("two-contact", "pezzuti"):
        result = analysed(cardan(model=model), 72)
        assert set(result.status.values) <= {0, 1}
        assert np.isfinite(result.drive_effort.values).all()
        assert np.all(result.locking_margin.values > 1)
        assert 0.3 < float(result.efficiency) < 1
        assert int(result.friction_iterations.max()) <= 20
    slow = trunnion.FrictionMethod("successive-approximation", criterion=1e-6, limit=2000)
    other = analysed(cardan(model="pezzuti"), 72, friction_method=slow)
    assert int(other.friction_iterations.max()) > 100
    np.testing.assert_allclose(other.drive_effort.values, result.drive_effort.values, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["two-contact", "pezzuti"])
def test_pin_at_rest(model: str) -> None:
    """At θ₁ = 0 a pin of the Cardan joint does not turn: its friction is an interval, and so is the torque.

    The ends are the oracle's answers with the pin taken to slip one way and the other, by [P] to turn and to slide so.
    """
    data = cardan(error=0.0, offset=0.0, model=model) if model == "two-contact" else cardan(model=model)
    result = analysed(data, 8)
    assert int(result.status.values[0]) == int(trunnion.Status.ZERO_SLIP)
    compared = Compared.__new__(Compared)
    compared.result, compared.oracle = result, Oracle(unrolled(data))
    motions, oracle = compared.motion(0), compared.oracle
    rates = {joint: oracle.slip(motions, joint) for joint in oracle.joints}
    if model == "two-contact":  # nothing slides in a joint without errors: what is left is rounding
        rates = {joint: rate._replace(slide=0.0) for joint, rate in rates.items()}
    still = min(rates, key=lambda joint: abs(rates[joint].turn))
    assert abs(rates[still].turn) < 1e-9
    ends = []
    for turn, slide in product(*[(1.0, 0.0, -1.0)] * 2) if model == "pezzuti" else [(1.0, 0.0), (-1.0, 0.0)]:
        rates[still] = rates[still]._replace(turn=turn, slide=slide)
        oracle.slip = lambda _, joint: rates[joint]  # type: ignore[method-assign]
        ends.append(oracle.rub(motions)[0].effort["input"])
    lower, upper = (float(result[f"drive_effort_{end}"].values[0, 0]) for end in ("lower", "upper"))
    assert upper - lower > 0.1
    if model == "two-contact":
        np.testing.assert_allclose([lower, upper], [min(ends), max(ends)], rtol=1e-8)
    else:  # the least effort lies inside the interval of the friction, where `test_rest` scans it
        assert upper == pytest.approx(max(ends), rel=1e-8)
        assert min(ends) - 0.03 * (upper - lower) < lower < min(ends)
    assert lower <= float(result.drive_effort.values[0, 0]) <= upper


# ---- screws -----------------------------------------------------------------------------------------------------

PITCH, MEAN, LOAD = 0.010, 0.012, 5000.0
LEAD = np.arctan(PITCH / (2 * np.pi * MEAN))


@pytest.mark.parametrize("friction", [0.0, 0.08, 0.2])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_screw_jack(friction: float, way: float) -> None:
    """Torque F r tan(λ ± φ) to raise and to lower; a thread with φ > λ has to be driven down."""
    data = {
        "space": "spatial",
        "links": {
            "ground": {"points": {"A": {"at": [0, 0, 0], "axis": [0, 0, 1]}}},
            "screw": {"points": {"A": {"at": [0, 0, 0], "axis": [0, 0, 1]}, "top": [0, 0, 0.2]}},
        },
        "joints": {
            "A": {
                "type": "helical",
                "links": ["ground", "screw"],
                "pitch": PITCH,
                "pin": {"radius": MEAN, "bearing": 0.1},
                "friction": friction,
            }
        },
        "drivers": {"A": {"speed": way, "range": [0.0, 9.0][:: int(way)]}},
        "loads": {"weight": {"link": "screw", "at": "top", "force": [0, 0, -LOAD], "useful": True}},
    }
    result = analysed(data, 5)
    phi = np.arctan(friction)
    np.testing.assert_allclose(result.drive_effort.values, LOAD * MEAN * np.tan(LEAD + way * phi), rtol=1e-12)
    np.testing.assert_allclose(
        result.joint_slide.values, result.joint_rotation.values * PITCH / (2 * np.pi), rtol=0, atol=1e-15
    )
    np.testing.assert_allclose(
        result.link_position.sel(link="screw", axis="z").values, result.joint_slide.values[0], rtol=0, atol=1e-14
    )
    if way > 0:
        assert float(result.efficiency) == pytest.approx(np.tan(LEAD) / np.tan(LEAD + phi), rel=1e-12)
    else:
        assert np.all(result.drive_effort.values > 0) == (phi < LEAD)
    held = np.tan(LEAD) / friction if phi > LEAD else np.nan  # by the load it raises or is lowered by
    found = trunnion.locking(trunnion.Mechanism(trunnion=1, **data), 5)
    np.testing.assert_allclose(found["holding_multiple"].values, held, rtol=1e-9)


@pytest.mark.parametrize("friction", [0.05, 0.1, 0.2])
def test_nut_pushed_along_its_screw(friction: float) -> None:
    """Force T/(r tan(λ − φ)); self-locking from φ = λ on, and the margin is tan λ/f."""
    y, z = {"at": [0, 0, 0], "axis": [0, 1, 0]}, {"at": [0, 0, 0], "axis": [0, 0, 1]}
    torque, (links, joints) = 3.0, floating("nut")
    pin = {"pin": {"radius": MEAN, "bearing": 0.1}, "friction": friction}
    data = {
        "space": "spatial",
        "links": {
            "ground": {"points": {"P": z, "R": z}},
            "nut": {"points": {"U": y, "H": z}},
            "screw": {"points": {"H": z, "R": z}},
            **links,
        },
        "joints": {
            **joints,
            "H": {"type": "helical", "links": ["nut", "screw"], "pitch": PITCH, **pin},
            "R": {"type": "revolute", "links": ["ground", "screw"]},
        },
        "drivers": {"P": {"speed": 0.01, "range": [0.0, 0.02]}},
        "loads": {"brake": {"joint": "R", "resisting_torque": torque, "useful": True}},
    }
    result = analysed(data, 5)
    phi = np.arctan(friction)
    np.testing.assert_allclose(result.locking_margin.values, np.tan(LEAD) / friction, rtol=1e-6)
    if phi > LEAD:
        assert set(result.status.values) == {LOCKED}
        return
    np.testing.assert_allclose(result.drive_effort.values, torque / (MEAN * np.tan(LEAD - phi)), rtol=1e-10)
    assert float(result.efficiency) == pytest.approx(np.tan(LEAD - phi) / np.tan(LEAD), rel=1e-10)
    turn = np.ptp(result.joint_rotation.sel(joint="R").values)
    assert float(turn) == pytest.approx(2 * np.pi * 0.02 / PITCH, rel=1e-12)


@pytest.mark.parametrize("turned", [(), ("B",)])
def test_friction_that_drags_a_rod_round(turned: tuple[str, ...]) -> None:
    """Each ball drags the rod by f r |F| along the other link's turn against it; what is along the rod adds up.

    Whichever link of a ball is named first: here by the turns of the links themselves, over the same positions.
    """
    data = trunnion.Mechanism.read(EXAMPLES / "rssr.yaml").data()
    for joint in turned:
        data["joints"][joint]["links"] = data["joints"][joint]["links"][::-1]
    run = prepare(trunnion.Mechanism(**data))
    assert run.determinacy is not None
    back = run.solve(run.cycle.times(LOOKED))
    motions, radius, friction = back.walk.motions, 0.007, 0.1

    def vector(numbers: Any) -> Any:
        return np.array([np.broadcast_to(one, LOOKED) for one in numbers], float)

    ends = {joint: vector(back.walk.element("rod", joint).place) for joint in ("B", "C")}
    line = ends["C"] - ends["B"]
    line = line / np.linalg.norm(line, axis=0)
    dragged = np.zeros(LOOKED)
    for joint, other in (("B", "crank"), ("C", "rocker")):
        turn = vector(motions[other].twist.u) - vector(motions["rod"].twist.u)
        force = np.linalg.norm(vector(back.reactions[joint].u), axis=0)
        dragged += friction * radius * force * np.sum(turn * line, axis=0) / np.linalg.norm(turn, axis=0)
    assert run.determinacy.dragged["rod"] == pytest.approx(np.max(np.abs(dragged)), rel=1e-6)


# ---- forces that statics leaves open ---------------------------------------------------------------------------------

DOOR, ARM_OF_WEIGHT = 20.0, 0.4
STILL = {"drivers": {"lower": {"speed": 1e-6, "range": [0.0, 1.5]}}}


def door(hinges: dict[str, float], bearing: float, friction: float = 0.1, **more: Any) -> trunnion.Mechanism:
    """A door of 20 kg on hinges at these heights, whose pins of 6 mm turn in bearings of the given length."""
    points = {name: {"at": [0, 0, height], "axis": [0, 0, 1]} for name, height in hinges.items()}
    leaf = {"mass": DOOR, "centre": [ARM_OF_WEIGHT, 0, 0.5], "inertia": {"xx": 2.4, "yy": 3.5, "zz": 1.1}}
    pin = {"pin": {"radius": 0.006, "bearing": bearing}, "friction": friction}
    data = {
        "space": "spatial",
        "over_constraint": "minimum-norm",
        "gravity": [0, 0, -9.81],
        "links": {"ground": {"points": points}, "leaf": {"points": points, **leaf}},
        "joints": {name: {"type": "revolute", "links": ["ground", "leaf"], **pin} for name in hinges},
        "drivers": {"lower": {"speed": 0.6, "range": [0.0, 1.5]}},
        "tolerances": {"joints.lower.pin.radius": "0.1 mm"},
        "measures": {"torque": {"effort": "lower", "as": "maximum"}},
    }
    return trunnion.Mechanism(trunnion=1, **{**data, **more})


VERBS = {
    "analyse": lambda model: trunnion.analyse(model, 4).drive_effort.values[0, 0],
    "sweep": lambda model: trunnion.sweep(
        model, {"joints.lower.friction.coefficient": [0.1]}, steps=4
    ).drive_effort_max.values.ravel()[0],
    "tolerance": lambda model: trunnion.tolerance(model, ["torque"], steps=4).nominal.values[0],
}


@pytest.mark.slow
@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize(("apart", "bearing"), [(0.5, 0.2), (2.0, 0.02)])
def test_hinges_share_the_load_as_two_ends_of_a_bearing_each_do(verb: str, apart: float, bearing: float) -> None:
    """A hinge gives way across by F/k and tilts by M/(k h²), h half its bearing: F a = C/(1 + 4 h²/a²)."""
    model = door({"lower": 0.0, "upper": apart}, bearing, **STILL)
    force = DOOR * 9.81 * ARM_OF_WEIGHT / apart / (1 + (bearing / apart) ** 2)
    assert VERBS[verb](model) == pytest.approx(0.1 * 0.006 * 2 * force, rel=1e-9)
    (finding,) = (one for one in trunnion.check(model, 4).findings if one.code == "mobility.friction_open")
    assert finding.severity == "warning"
    share = (bearing / apart) ** 2
    assert finding.figures["change"] == pytest.approx(1 - (1 + share) / (1 + 1.125 * share), rel=1e-3)


def test_hinges_of_stated_stiffness_are_a_rigid_beam_on_springs() -> None:
    """Three hinges: deflections δ and rotation φ from the balance of forces and moments, F = k (δ + z φ), M = κ φ."""
    heights, radial = np.array([0.1, 0.7, 1.6]), np.array([3e6, 1e6, 8e6])
    tilting = np.array([2e3, 9e5, 4e4])
    names = ("lower", "middle", "upper")
    model = door(dict(zip(names, heights.tolist(), strict=True)), 0.05, **STILL).data()
    for name, k, t in zip(names, radial, tilting, strict=True):
        model["joints"][name]["stiffness"] = {"radial": float(k), "tilting": float(t), "axial": 2e6}
    result = trunnion.analyse(trunnion.Mechanism(**model), 4)
    stiff = np.array([[radial.sum(), radial @ heights], [radial @ heights, radial @ heights**2 + tilting.sum()]])
    shift, turn = np.linalg.solve(stiff, [0.0, DOOR * 9.81 * ARM_OF_WEIGHT])
    forces, moments = radial * (shift + heights * turn), tilting * turn
    for name, force, moment in zip(names, forces, moments, strict=True):
        across = result.reaction_force.sel(joint=name).values[:2, 0]
        assert np.linalg.norm(across) == pytest.approx(abs(force), rel=1e-9)
        assert np.linalg.norm(result.reaction_moment.sel(joint=name).values[:2, 0]) == pytest.approx(moment, rel=1e-9)
    ends = [abs(f / 2 + m / 0.05) + abs(f / 2 - m / 0.05) for f, m in zip(forces, moments, strict=True)]
    assert result.drive_effort.values[0, 0] == pytest.approx(0.1 * 0.006 * sum(ends), rel=1e-9)
    del model["joints"]["middle"]["stiffness"]
    with pytest.raises(trunnion.MechanismError, match="the stiffness of middle is not stated"):
        trunnion.analyse(trunnion.Mechanism(**model), 4)


def test_one_bearing_with_two_ends_has_the_friction_of_a_door() -> None:
    """The weight turns the leaf over: each end carries W a/L whatever the bearing is made of."""
    result = brief(door({"lower": 0.5}, bearing=1.0), 4)
    torque = 0.1 * 0.006 * 2 * DOOR * 9.81 * ARM_OF_WEIGHT / 1.0
    np.testing.assert_allclose(result.drive_effort.values, torque, rtol=1e-12)
    free = brief(door({"lower": 0.0, "upper": 1.0}, bearing=0.02, friction=0.0), 4)
    np.testing.assert_allclose(free.drive_effort.values, 0.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize("rubbing", ["A", "U"])
def test_friction_that_no_open_force_presses_on_is_kept(rubbing: str) -> None:
    """A shaft that its bearing and a plate on a cross both hold along: the thrust is open, what bends the shaft is not.

    The bearing feels the load across it alone; a pin of the cross feels the thrust.
    """
    x, y, z = ({"at": [0, 0, 0], "axis": list(axis)} for axis in np.eye(3))
    pin = {"pin": {"radius": 0.01, "bearing": 0.05}, "friction": 0.1}
    data = {
        "space": "spatial",
        "over_constraint": "minimum-norm",
        "links": {
            "ground": {"points": {"A": z, "U": x}},
            "plate": {"points": {"U": y, "E": z}},
            "shaft": {"points": {"A": z, "E": z, "P": [0, 0, 0.3]}},
        },
        "joints": {
            "A": {"type": "revolute", "links": ["ground", "shaft"]},
            "U": {"type": "universal", "links": ["ground", "plate"]},
            "E": {"type": "planar", "links": ["plate", "shaft"]},
        },
        "drivers": {"A": {"speed": 2.0}},
        "loads": {"belt": {"link": "shaft", "at": "P", "force": [50.0, 0.0, -300.0]}},
    }
    data["joints"][rubbing] |= pin
    result = analysed(data, 4)
    depends = [one.figures["joints"] for one in result.trunnion.findings if one.code == "mobility.friction_open"]
    assert depends == ([["U"]] if rubbing == "U" else [])
    if rubbing == "U":
        return
    expected = 0.1 * 0.01 * 2 * 50 * 0.3 / 0.05  # the ends carry 25 N -+ 300 N
    np.testing.assert_allclose(result.drive_effort.values, expected, rtol=1e-9)
