"""Means over the cycle, however many positions are asked for, by fine integrals; useful work and work beside it."""

import json
from math import pi

import numpy as np
import pytest

import trunnion
from mechanisms_parts import example, joined, slide
from trunnion import Mechanism, analyse
from trunnion.cycle.summary import balance
from trunnion.errors import Status
from trunnion.measures.measures import named
from trunnion.results.attributes import summary_of
from trunnion.solve.loads import useful_loads
from trunnion.solve.run import prepare
from trunnion.solve.seating import seating_of
from trunnion.solve.switches import Mechanisms, bends

PRESS = {  # of docs/how-to/model-file.md
    "space": "planar",
    "dimensions": {"r": "40 mm", "l": "160 mm", "offset": "60 mm"},
    "links": {
        "frame": {"points": {"O": [0, 0], "S": slide(0, 0)}},
        "crank": {"points": {"O": [0, 0], "P": ["r", 0]}},
        "rod": {"points": {"P": [0, 0], "Q": ["l", 0]}},
        "ram": {"points": {"Q": [0, 0], "S": {"at": [0, "offset"], "axis": [1, 0]}}},
    },
    "joints": joined("frame -O- crank -P- rod -Q- ram, frame =S= ram", S={"guide": {"length": "30 mm"}}),
    "joint_defaults": {"pin": {"radius": "12 mm"}, "friction": 0.2},
    "drivers": {"O": {"speed": "60 rpm"}},
    "loads": {"work": {"joint": "S", "resisting_force": "1 kN", "useful": True}},
    "assembly": {"Q": ["200 mm", 0]},
}
LOADS = (
    "1 kN * between(drive, 340 deg, 343 deg)",
    "1 kN * max(0, cos(drive - 341 deg) - 0.9999)",  # a pulse of 1.6 deg that no function states the edges of
    "1 kN * between(time, 0.9441 s, 0.9527 s)",
)


def press(force=LOADS[0], **changes):
    return Mechanism(**(PRESS | changes)).with_values({"work.resisting_force": force})


def finely(run, cells):
    """Efficiency by the midpoint rule over very many cells, straight from the walk."""
    time = (np.arange(cells) + 0.5) * run.cycle.duration / cells
    work = np.zeros(2)
    for part in np.array_split(time, max(1, cells // 10_000)):
        back = run.solve(part)
        useful = -sum(back.load_powers[name] for name in useful_loads(run.system.mechanism))
        driven = sum(effort * back.walk.rate(name) for name, effort in back.efforts.items())
        work += np.sum(np.broadcast_to(useful, part.shape)), np.sum(np.broadcast_to(driven, part.shape))
    return float(work[0] / work[1])


def bumper():
    """A spring that the ram just touches for some degrees."""
    data = json.loads(json.dumps(PRESS))
    data["links"]["frame"]["points"]["W"] = ["230 mm", "60 mm"]
    spring = {"between": ["frame.W", "ram.Q"], "stiffness": "200 N/mm", "free_length": "38 mm", "damping": "2 N s/mm"}
    return Mechanism(**data, springs={"bumper": {**spring, "only": "push"}})


@pytest.mark.spread(1)
@pytest.mark.parametrize(
    ("mechanism", "steps", "same", "cells", "close"),
    [
        *((lambda force=force: press(force), (60, 720), 1e-9, 360_000, 2e-4) for force in LOADS),
        (bumper, (60, 720), 1e-7, 200_000, 1e-5),
        (lambda: example("rssr"), (50, 333), 1e-6, 60_000, 1e-4),
        (lambda: example("klann"), (50, 333), 1e-6, 60_000, 1e-4),
    ],
    ids=["drive", "pulse", "time", "bumper", "rssr", "klann"],
)
def test_efficiency_does_not_depend_on_the_number_of_positions(mechanism, steps, same, cells, close):
    found = [trunnion.analyse(mechanism(), count) for count in steps]
    values = [float(result["efficiency"]) for result in found]
    assert values[1] == pytest.approx(values[0], rel=same)
    assert values[0] == pytest.approx(finely(prepare(mechanism()), cells), rel=close)
    assert same > 1e-9 or all(0 <= float(result["efficiency_error"]) < 1e-6 * values[0] for result in found)


@pytest.mark.slow
def test_a_sweep_has_the_efficiencies_of_the_analysis_at_any_number_of_positions():
    lengths = ["110 mm", "130 mm", "160 mm", "200 mm"]
    few, many = (trunnion.sweep(press(), {"l": lengths}, steps) for steps in (60, 720))
    one = [float(trunnion.analyse(press().with_values({"l": length}), 72)["efficiency"]) for length in lengths]
    assert np.all(few["efficiency"] > 0.01)
    for name in ("efficiency", "friction_power_mean", "drive_power_mean", "drive_effort_rms"):
        np.testing.assert_allclose(few[name], many[name], rtol=1e-8)
    np.testing.assert_allclose(few["efficiency"], one, rtol=1e-8)


def test_a_load_that_no_position_meets_is_in_the_extremes():
    """Of 72 positions none lies in the 3° of the load; of 3600 thirty do."""
    most = [
        {one.name: one.value for one in summary_of(trunnion.analyse(press(), steps))}["O.effort_max"]
        for steps in (72, 3600)
    ]
    assert most[0] == most[1]
    dense = float(trunnion.analyse(press(), 3600)["drive_effort"].max())
    assert dense <= most[0] <= 1.02 * dense


def test_bends_are_where_the_model_switches():
    run = prepare(press())
    (found,) = bends(Mechanisms(run.system, run.chosen.assembly, run.values, [run.cycle]))
    degrees = np.array([bend.time for bend in found]) / run.cycle.duration * 360
    # Q turns round where the crank is upright, S in its dead centres: sin φ = −offset/(r + l), offset/(l − r)
    dead = [np.degrees(np.arcsin(-60 / 200)) % 360, 180 - np.degrees(np.arcsin(60 / 120))]
    for place in (340, 343, 90, 270, *dead):
        assert np.min(np.abs(degrees - place)) < 1e-8


@pytest.mark.spread(1)
@pytest.mark.parametrize("model", ["fourbar-with-play", "rssr-with-play"])
def test_extremes_are_of_positions_that_are_valid(model):
    """Where a pin loses contact its forces are no answer: the summary, a sweep and the report leave them out."""
    mechanism = example(model).with_values({"A.speed": "300 rpm"})
    result, dense = (trunnion.analyse(mechanism, steps) for steps in (360, 7200))
    lost = result["status"].values == Status.CONTACT_LOST
    assert np.any(lost)
    fine = np.sqrt((dense["reaction_force"].values ** 2).sum(axis=1))
    rows = {row.name: row.value for row in summary_of(result)}
    low, high = seating_of(prepare(mechanism)).gaps[..., None]
    kept = ~np.any((low < dense["time"].values) & (dense["time"].values < high), axis=0)
    for size, joint in zip(fine, result["joint"].values, strict=True):
        assert rows[f"{joint}.reaction_max"] == pytest.approx(np.max(size[kept]), rel=1e-3)
    assert rows["positions_lost"] == np.count_nonzero(lost)
    assert rows["positions_solved"] == 360 - np.count_nonzero(lost)
    swept = trunnion.sweep(mechanism, {"A.speed": ["300 rpm"]}, 360)
    most = [rows[f"{joint}.reaction_max"] for joint in result["joint"].values]
    np.testing.assert_allclose(swept["reaction_max"].values[:, 0], most, rtol=1e-12)
    assert int(swept["not_valid"][0]) == np.count_nonzero(lost)


def shaft(driver, body=None, **more):
    points = {"points": {"A": [0, 0]}}
    links = {"ground": points, "shaft": {**points, **(body or {})}}
    return Mechanism(links=links, joints=joined("ground -A- shaft"), drivers={"A": driver}, **more)


@pytest.mark.parametrize(
    ("torques", "spring", "marked", "share"),
    [
        ({"mill": 6.0, "fan": 2.0}, 0.0, "mill", 0.75), ({"mill": 6.0, "fan": 2.0}, 0.0, "fan", 0.25),
        ({"mill": 6.0, "fan": 2.0}, 0.0, "", 1.0), ({"brake": 6.0}, 4.0, "", 0.6), ({"brake": 6.0}, 4.0, "brake", 0.6),
        ({"brake": 6.0}, 4.0, "coil", 0.4), ({"brake": 6.0}, 4.0, "brake coil", 1.0),
    ],
)  # fmt: skip
def test_useful_work_is_that_of_what_is_marked_so(torques, spring, marked, share):
    """Of torques on a shaft and of a spring that it winds up; all loads, and no spring, if nothing is marked."""
    loads = {name: {"joint": "A", "resisting_torque": size, "useful": name in marked} for name, size in torques.items()}
    springs = {"coil": {"joint": "A", "preload": spring, "useful": "coil" in marked}} if spring else {}
    model = shaft({"speed": 5.0, "range": [0.0, 1.0]}, loads=loads, springs=springs)
    result, run = trunnion.analyse(model, 12), prepare(model)
    torque = sum(torques.values()) + spring
    np.testing.assert_allclose(result["drive_effort"], torque, rtol=1e-12)
    np.testing.assert_allclose(result["useful_power"], 5.0 * torque * share, rtol=1e-12)
    np.testing.assert_allclose(result["efficiency_instant"], share, rtol=1e-12)
    assert float(result["efficiency"]) == pytest.approx(share, rel=1e-12)
    (measure,) = named(model, ["efficiency:cycle"], run.values)
    useful, driven = measure.curve(run.solve(np.zeros(1)))
    np.testing.assert_allclose(useful / driven, share, rtol=1e-12)


def test_power_residual_is_told_of_the_peak_power():
    """Of the drive, or of whatever has the most where that has none; of no power at all as it is."""
    arrays = {"power_residual": np.array([1e-6, -4e-6, 2e-6]), "drive_power": np.array([[3.0, -8.0, 5.0]]),
              "useful_power": np.array([1.0, 2.0, 0.5])}  # fmt: skip
    assert balance(arrays, 0.0) == pytest.approx(4e-6 / 8.0)
    assert balance(arrays | {"drive_power": np.zeros((1, 3))}, 0.0) == pytest.approx(4e-6 / 2.0)
    assert balance({name: 1e3 * one for name, one in arrays.items()}, 0.0) == pytest.approx(4e-6 / 8.0)
    nothing = {"drive_power": np.zeros((1, 3)), "useful_power": np.zeros(3)}
    assert balance(arrays | nothing, 0.0) == pytest.approx(4e-6)


def test_root_mean_square_of_an_effort():
    """Of a crank that lifts a weight the torque is m g r cos φ: its RMS m g r/√2."""
    crank = shaft({"speed": 2.0}, {"mass": 2.0, "centre": [0.3, 0], "inertia": 0.0}, gravity=[0, -9.81])
    (row,) = (row for row in summary_of(trunnion.analyse(crank, 12)) if row.aspect == "RMS")
    assert row.value == pytest.approx(2.0 * 9.81 * 0.3 / np.sqrt(2), rel=1e-9)


LIFTED, HELPED, HINDERED = 10.0, 4.0, 5.0  # J: constant forces, N, over a rise of 1 m


def crank(**loads):
    """The findings of a crank of 1 m, from level to upright; loads: vertical forces at its end, N; `weight` is useful;
    with `mass` a weight at its end that it lets down instead."""
    body = {"points": {"A": [0, 0], "P": [1, 0]}, "mass": loads.pop("mass", 0.0), "centre": [1, 0]}
    pushes = {name: {"link": "shaft", "at": "P", "force": [0.0, force], "useful": name == "weight"}
              for name, force in loads.items()}  # fmt: skip
    model = shaft({"speed": 1.0, "range": [0.0, pi / 2]}, body, gravity=[0.0, 1.0], loads=pushes)
    found = analyse(model, steps=8).trunnion.findings
    return [one for one in found if one.code == "efficiency.above_one"]


@pytest.mark.parametrize("loads", [{"hand": HELPED}, {"mass": HELPED}])
def test_an_efficiency_above_one_is_a_warning(loads):
    """Loads that are not useful and masses are sources beside the drive."""
    (one,) = crank(weight=-LIFTED, **loads)
    assert one.severity == "warning"
    assert one.figures["efficiency"] == pytest.approx(LIFTED / (LIFTED - HELPED), rel=1e-9)
    assert one.figures["drive"] == pytest.approx(LIFTED - HELPED, rel=1e-9)


@pytest.mark.parametrize("loads", [{"weight": -LIFTED}, {"weight": -LIFTED, "scrap": -HINDERED}, {"hand": HELPED}])
def test_nothing_is_said_of_an_efficiency_below_one(loads):
    assert not crank(**loads)


G, MASS = 9.81, 1500.0


def lift(space, friction, weight, gravity):
    """A slider on an inclined guide, driven up it by a motion that begins and ends at rest."""
    flat = [0.0] if space == "spatial" else []
    centre = [0.1, 0.3, *flat]
    element = {"at": [0, 0, *flat], "axis": [np.cos(0.6), np.sin(0.6), *flat]}
    load = {"weight": {"link": "cage", "at": "C", "force": [0, -MASS * G, *flat], "useful": True}}
    return Mechanism(
        space=space,
        gravity=[0, -gravity, *flat],
        links={
            "ground": {"points": {"S": element}},
            "cage": {"points": {"S": element, "C": centre}, "mass": MASS, "centre": centre, **weight},
        },
        joints=joined("ground =S= cage", S={"friction": friction, "guide": {"length": 0.8}}),
        drivers={"S": {"law": "cycloidal", "range": [0, 2], "duration": 4, "returns": False}},
        loads={} if gravity else load,
    )


@pytest.mark.parametrize("space", ["planar", "spatial"])
@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_a_weight_is_useful_as_a_load_is(space, friction):
    one = trunnion.analyse(lift(space, friction, {"useful": True}, G), steps=20)
    other = trunnion.analyse(lift(space, friction, {}, 0.0), steps=20)
    for name in ("efficiency", "useful_power", "efficiency_instant"):
        assert one[name].values == pytest.approx(other[name].values, rel=1e-9, nan_ok=True), name
    assert float(one.efficiency) == pytest.approx(1.0, rel=1e-9) if friction == 0 else 0.3 < float(one.efficiency) < 1


def test_locking_counts_it():
    """Backward the weight drives: the efficiency backward of an incline of 0.6 rad is 2 − 1/η, of useful weight too."""
    numbers = [
        {row["name"]: row["value"] for row in json.loads(trunnion.locking(model, steps=12).attrs["summary"])}
        for model in (lift("planar", 0.05, {"useful": True}, G), lift("planar", 0.05, {}, 0.0))
    ]
    assert 0 < numbers[0]["efficiency_reverse"] < 1
    assert numbers[0]["efficiency_reverse"] == pytest.approx(numbers[1]["efficiency_reverse"], rel=1e-6)


@pytest.mark.parametrize(("times", "rough"), [(20, False), (3000, True)])
def test_what_changes_too_finely_to_be_resolved_is_told(times, rough):
    """A load that changes 20 times over the cycle is resolved; of one that changes 3000 times the share is told."""
    loads = {"work": {"joint": "S", "resisting_force": f"1 kN * (2 + sin({times} * drive))", "useful": True}}
    result = analyse(Mechanism(**{**PRESS, "loads": loads}), 7)
    told = [one.figures["share"] for one in result.trunnion.findings if one.code == "cycle.rough"]
    assert bool(told) == rough
    assert all(share > 1e-6 for share in told)
