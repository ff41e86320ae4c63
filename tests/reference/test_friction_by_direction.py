"""Friction by direction, of rollers, at rest, at bearing ends and of bristles, against closed forms and scans."""

import copy
import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import trunnion
from brief import brief
from mechanisms import build, four_bar, positions_of, slider_crank
from mechanisms_parts import example, joined, slide
from trunnion import Mechanism
from trunnion.results.tables.cycle import positions
from trunnion.solve.bristles import _chained
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare

FORWARD, BACKWARD = 0.1, 0.35
BY_DIRECTION = {"coefficient": FORWARD, "backward": BACKWARD}
G = 9.81


def with_friction(data, joint, friction):
    """The data with another friction of one joint."""
    changed = copy.deepcopy(data)
    changed["joints"][joint]["friction"] = friction
    return Mechanism(**changed)


@pytest.mark.spread(1)
@pytest.mark.parametrize(
    ("name", "joint", "engine"),
    [("durango-fourbar", "D", "numpy"), ("offset-slider-crank", "S", "compiled"), ("rssr", "D", "numpy")],
)
def test_each_way_is_a_run_with_its_coefficient(name, joint, engine):
    """Forces, locking margin and losses are those of the coefficient of the direction at hand."""
    data = trunnion.read(f"examples/{name}.yaml").data()
    runs = [
        trunnion.analyse(with_friction(data, joint, friction), steps=60, engine=engine)
        for friction in (BY_DIRECTION, FORWARD, BACKWARD)
    ]
    rate = sum(runs[0][f"joint_{motion}_velocity"].sel(joint=joint).values for motion in ("rotation", "slide"))
    ahead = rate > 0
    slips = np.abs(rate) > 1e-6 * np.max(np.abs(rate))
    assert 10 < np.count_nonzero(ahead & slips) < 50
    for variable in ("drive_effort", "reaction_force", "friction_power", "locking_margin", "status"):
        both, forward, backward = (run[variable].values[..., slips] for run in runs)
        assert both == pytest.approx(np.where(ahead[slips], forward, backward), rel=1e-9, abs=1e-9), variable
    different = np.abs(runs[1]["drive_effort"] - runs[2]["drive_effort"]).max()
    assert different > 1e-3 * np.abs(runs[0]["drive_effort"]).max()


def test_at_rest_each_bound_has_its_own():
    """A block of 2 kg that turns round: between −μ₋ m g and μ₊ m g."""
    data = block(0.0, BY_DIRECTION)
    data["drivers"] = {"S": {"law": "harmonic", "mean": 0.1, "amplitude": 0.1, "period": 1.0}}
    found = brief(Mechanism(**data), steps=8)
    still = int(np.argmin(np.abs(found["joint_slide_velocity"].values[0])))
    inertia = 2.0 * found["joint_slide_acceleration"].values[0, still]
    low, high = (found[f"drive_effort_{end}"].values[0, still] - inertia for end in ("lower", "upper"))
    assert (low, high) == pytest.approx((-BACKWARD * 2 * G, FORWARD * 2 * G), rel=1e-9)


def block(slope, friction, joint="S"):
    """A block of 2 kg on a slope, rad, up along x; a long guide carries no moment."""
    point = {"points": {joint: slide(0, 0)}}
    return {
        "gravity": [-G * np.sin(slope), -G * np.cos(slope)],
        "links": {"ground": point, "block": {**point, "mass": 2.0}},
        "joints": joined(f"ground ={joint}= block", **{joint: {"guide": {"length": 0.5}, "friction": friction}}),
    }


THROWN = {"S": (2.0, 0.1, 0.35), "R": (1.5, 0.2, 0.8)}  # speed, m/s, and both coefficients


@pytest.mark.parametrize("joints", ["S", "R", pytest.param("SR", marks=pytest.mark.slow)])
def test_blocks_thrown_up_a_slope(joints):
    """Up with μ₊ against it, down with μ₋, or it stays where tan of the slope is below μ₋: times and way by the closed
    form, of several blocks each for itself."""
    slope = np.radians(30)
    data = {**block(slope, None), "links": {"ground": {"points": {}}}, "joints": {}, "drivers": {}}
    for name in joints:
        speed, forward, backward = THROWN[name]
        alone = block(slope, {"coefficient": forward, "backward": backward}, name)
        data["links"]["ground"]["points"] |= alone["links"]["ground"]["points"]
        data["links"][f"block-{name}"] = alone["links"]["block"]
        data["joints"][name] = {**alone["joints"][name], "links": ["ground", f"block-{name}"]}
        initial = {"coordinate": 0, "speed": speed}
        data["drivers"][name] = {"range": [-9, 9], "speed": 0.1, "free": True, "initial": initial}
    found = trunnion.simulate(Mechanism(**data), duration=1.2, steps=120)
    for name in joints:
        speed, forward, backward = THROWN[name]
        up = G * (np.sin(slope) + forward * np.cos(slope))
        down = max(G * (np.sin(slope) - backward * np.cos(slope)), 0.0)
        time, top = found["time"].values, speed / up
        back = 0.5 * speed**2 / up - 0.5 * down * (time - top) ** 2
        way = np.where(time <= top, speed * time - 0.5 * up * time**2, back)
        assert found["joint_slide"].sel(joint=name).values == pytest.approx(way, abs=1e-7), name


def test_a_loaded_roller():
    """Torque arm · W of a wheel under the weight W, which needs no radius of a pin."""
    wheel = {
        "gravity": [0, -G],
        "links": {"ground": {"points": {"A": [0, 0]}}, "wheel": {"points": {"A": [0, 0]}, "mass": 50.0}},
        "joints": joined("ground -A- wheel", A={"friction": {"law": "rolling", "arm": 5e-4}}),
        "drivers": {"A": {"speed": 1.0}},
    }
    found = brief(Mechanism(**wheel), steps=4)
    assert found["drive_effort"].values == pytest.approx(np.full((1, 4), 5e-4 * 50 * G), rel=1e-12)


@pytest.mark.slow
def test_tolerances_know_the_backward_coefficient():
    """Its exact sensitivity against a central difference."""
    data = trunnion.read("examples/durango-fourbar.yaml").data()
    data["measures"] = {"least": {"effort": "A", "as": "minimum"}}

    def least(backward, **more):
        return with_friction({**data, **more}, "D", {"coefficient": 0.1, "backward": backward})

    tolerances = {"joints.D.friction.backward": 0.05}
    found = float(trunnion.tolerance(least(0.3, tolerances=tolerances))["sensitivity"].values.ravel()[0])
    ends = [float(trunnion.analyse(least(0.3 + step), steps=4)["measure_figure"][0]) for step in (-1e-5, 1e-5)]
    assert found == pytest.approx((ends[1] - ends[0]) / 2e-5, rel=1e-6)
    assert abs(found) > 1


PEZZUTI = {"joint_defaults.friction.model": "pezzuti"}
FINE = 2001  # shares of one contact
CASES = {
    "one contact, steep": ("pezzuti-cardan", {"bearing": "30 mm", "misalignment": "45 deg"}, "pin-2", True),
    "turn and slide of [P], one of them at rest": ("pezzuti-cardan", PEZZUTI, "pin-2", True),
    "guide of a trammel, whose load has a kink": ("elliptic-trammel", {}, "X", True),
    "pin of a compressor, ends are the bounds": ("slider-crank", {}, "Q", False),
    "load that resists the joint that rests": ("indexing-press", {}, "F", False),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_the_bounds_are_the_extremes_over_the_whole_interval(case):
    name, values, joint, inside = CASES[case]
    mechanism = example(name).with_values(values)
    result, run = brief(mechanism, 72), prepare(mechanism)
    lower, own, upper = (result[f"drive_effort{end}"].values for end in ("_lower", "", "_upper"))
    driver = int(np.argmax(np.nanmax(upper - lower, axis=1))) if joint != "F" else 1
    shares = np.linspace(-1.0, 1.0, FINE)
    if run.system.resting(joint) == 2:
        shares = np.linspace(-1.0, 1.0, 41)
        grid = tuple(part.ravel() for part in np.meshgrid(shares, shares))
    else:
        grid = (shares,)
    beyond = []
    for at in np.flatnonzero(upper[driver] - lower[driver] > 0):
        time = np.full(grid[0].shape, result["time"].values[at])
        found = run.at(time, {}, FrictionMethod(), {joint: grid}).efforts[str(result["driver"].values[driver])]
        scan = np.broadcast_to(found, grid[0].shape)
        if np.ptp(scan) < 1e-9 * abs(own[driver, at]):
            continue  # it moves here
        corners = scan[np.all(np.abs(np.array(grid)) == 1.0, axis=0)]
        beyond.append(max(corners.min() - scan.min(), scan.max() - corners.max()) / np.ptp(scan))
        step = np.abs(np.diff(scan)).max() if len(grid) == 1 else 0.02 * np.ptp(scan)  # what a scan may miss
        noise = 1e-9 * np.ptp(scan)
        assert scan.min() - step <= lower[driver, at] <= scan.min() + noise
        assert scan.max() - noise <= upper[driver, at] <= scan.max() + step
    assert (max(beyond) > 1e-4) == inside


def test_a_guide_in_the_plane():
    """A slider 0.5 m long that carries 100 N, 0.6 m beyond its middle: 100 N·(0.6/0.5 + 1/2) on the nearer end."""
    data = {**block(0.0, 0.0), "gravity": [0, 0], "drivers": {"S": {"speed": 1.0, "range": [0, 0.2]}}}
    data["links"]["block"]["points"]["E"] = [0.6, 0]
    data["loads"] = {"weight": {"link": "block", "at": "E", "force": [0, -100]}}
    data["measures"] = {"end": {"end_load": "S", "as": "maximum"}}
    assert float(trunnion.analyse(Mechanism(**data), steps=4).measure_figure[0]) == pytest.approx(170.0, rel=1e-12)


@pytest.mark.slow
def test_a_bearing_in_space_by_its_reaction():
    """|F⊥/2 ∓ M⊥ × u/L|, of the force and moment in the table of the result."""
    model = trunnion.read("examples/rssr.yaml").data()
    model["measures"] = {"end": {"end_load": "D"}}
    found = trunnion.analyse(Mechanism(**model), steps=12)
    force, moment = (found[name].sel(joint="D").values for name in ("reaction_force", "reaction_moment"))
    axis = np.array([0, -np.sin(np.pi / 3), np.cos(np.pi / 3)])
    across, bending = (vector - np.outer(axis, axis @ vector) for vector in (force, moment))
    g = np.cross(bending.T, axis).T / 0.03
    sizes = [np.linalg.norm(across / 2 + sign * g, axis=0) for sign in (-1, 1)]
    assert found.measure_value.sel(measure="end").values == pytest.approx(np.max(sizes, axis=0), rel=1e-12)


def sizes(found, joint):
    """The load on every end of a joint, (end, position), N."""
    return np.linalg.norm(found["end_load"].sel(joint=joint), axis=1)


def test_the_table_has_both_ends_and_the_pressure():
    """A mass 0.3 m beyond the middle of a bearing of 0.1 m: m g (1/2 ± a/L); the end that bears more, over half of the
    projected area, is the pressure."""
    axis = {"points": {"A": {"at": [0, 0, 0], "axis": [0, 0, 1]}}}
    shaft = Mechanism(
        space="spatial",
        gravity=[0, -G, 0],
        links={"ground": axis, "shaft": {**axis, "mass": 2.0, "centre": [0, 0, 0.3]}},
        joints=joined("ground -A- shaft", A={"pin": {"radius": 0.01, "bearing": 0.1}}),
        drivers={"A": {"speed": 1.0}},
    )
    found = trunnion.analyse(shaft, steps=4)
    both = 2 * G * np.array([3.5, 2.5])
    assert np.sort(sizes(found, "A")[:, 0])[::-1] == pytest.approx(both, rel=1e-12)
    assert found["pin_pressure"].values == pytest.approx(np.full((1, 4), both[0] / (0.02 * 0.05)), rel=1e-12)
    summary = {row["name"]: row for row in json.loads(found.attrs["summary"])}
    assert summary["A.end_load_max"]["value"] == pytest.approx(both[0], rel=1e-12)
    assert summary["A.pin_pressure_max"]["value"] == pytest.approx(both[0] / (0.02 * 0.05), rel=1e-12)


def test_the_pressure_of_a_pin_in_the_plane():
    """F/(d b) of the reaction; of pins whose length is not stated there is none."""
    data = trunnion.read("examples/durango-fourbar.yaml").data()
    data["joints"]["C"]["pin"] = {"radius": "0.1 m", "length": "50 mm"}
    found = trunnion.analyse(Mechanism(**data), steps=12)
    force = np.linalg.norm(found["reaction_force"].sel(joint="C"), axis=0)
    assert found["pin_pressure"].sel(joint="C").values == pytest.approx(force / (0.2 * 0.05), rel=1e-12)
    assert np.all(np.isnan(found["pin_pressure"].sel(joint="B")))
    columns = [column.name for column in positions(found)]
    assert "C.pin_pressure" in columns
    assert not any(name.startswith(("B.pin", "C.end")) for name in columns)


def pins_of_the_first_cross(found):
    """Directions of the two pins of joint B of the double Cardan shaft, (axis, position), by its geometry."""
    turn = found["joint_rotation"].sel(joint="A").values
    first = np.array([-np.sin(turn), np.cos(turn), 0 * turn])
    second = np.cross([0.2, 0, np.sqrt(0.6**2 - 0.2**2)], first.T).T
    return first, second / np.linalg.norm(second, axis=0)


def test_a_massless_cross_by_its_normal():
    """Without mass and friction it passes on M along its normal n; the input has T = M n·e, each end M/L."""
    data = trunnion.read("examples/double-cardan.yaml").data()
    data.pop("gravity")
    for link in ("input", "middle", "output"):
        for key in ("mass", "inertia", "centre"):
            data["links"][link].pop(key)
    found = brief(Mechanism(**data).with_friction("off"), steps=24)
    first, second = pins_of_the_first_cross(found)
    moment = found["drive_effort"].values[0] / np.cross(first.T, second.T)[:, 2]
    assert sizes(found, "B") == pytest.approx(np.tile(np.abs(moment) / 0.07, (4, 1)), rel=1e-9)
    assert np.ptp(moment) > 5.0


@pytest.mark.slow
def test_friction_of_a_cross_counts_these_loads():
    """μ r Σ|Q| ω of each pin: the friction of one bears on the other."""
    found = trunnion.analyse(trunnion.read("examples/double-cardan.yaml"), steps=40, engine="numpy")
    spin = [found["link_angular_velocity"].sel(link=link).values for link in ("input", "middle")]
    rates = [np.abs(np.sum((spin[1] - spin[0]) * pin, axis=0)) for pin in pins_of_the_first_cross(found)]
    load = sizes(found, "B")
    lost = 0.05 * 0.008 * (load[:2].sum(axis=0) * rates[0] + load[2:].sum(axis=0) * rates[1])
    assert found["friction_power"].sel(joint="B").values == pytest.approx(lost, rel=1e-7)


@pytest.mark.spread(1)
@pytest.mark.parametrize(
    ("name", "joint", "engine"), [("double-cardan", "A", "numpy"), ("offset-slider-crank", "S", "compiled")]
)
def test_friction_counts_these_loads(name, joint, engine):
    """μ r Σ|Q| ω of a bearing, μ Σ|Q| v of a guide."""
    model = trunnion.read(f"examples/{name}.yaml")
    found, numbers = trunnion.analyse(model, steps=40, engine=engine), model.parameters()
    motion, lever = ("slide", 1.0) if joint == "S" else ("rotation", numbers[f"joints.{joint}.pin.radius"])
    slip = lever * np.abs(found[f"joint_{motion}_velocity"].sel(joint=joint).values)
    lost = numbers[f"joints.{joint}.friction.coefficient"] * np.nansum(sizes(found, joint), axis=0) * slip
    assert found["friction_power"].sel(joint=joint).values == pytest.approx(lost, rel=1e-7, abs=1e-9)


DAHL = {"law": "dahl", "coefficient": 0.12, "stiffness": 4e3}
LUGRE = {
    "law": "lugre", "coefficient": 0.1, "static": 0.16, "stribeck_speed": 2e-3, "stiffness": 2e4, "damping": 0.3,
    "viscous": 0.2,
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("data", "joint", "law"), [(four_bar(), "D", DAHL), (slider_crank(), "P", LUGRE)])
def test_state_against_a_stiff_integrator(data, joint, law):
    """In a rocker's pin and a slider's guide, both of which turn back twice a turn, once the start is forgotten."""
    run = prepare(build(data, friction=law))
    duration, lever = run.cycle.duration, run.values.get(f"joints.{joint}.pin.radius", 1.0)
    fine = np.linspace(0, duration, 4001)
    speeds = np.ravel(lever * run.solve(fine).walk.speed(joint))
    peak = law.get("static", law["coefficient"]) - law["coefficient"]

    def rate(time, z):
        v = float(np.interp(time % duration, fine, speeds))
        curve = law["coefficient"] + peak * np.exp(-((v / law.get("stribeck_speed", 1.0)) ** 2))
        return [v - law["stiffness"] * abs(v) / curve * z[0]]

    time = np.linspace(0, duration, 90, endpoint=False)  # of the second turn from rest
    expected = solve_ivp(
        rate, (0, 2 * duration), [0.0], "Radau", duration + time, rtol=1e-8, atol=1e-13, max_step=duration / 400
    ).y[0]
    np.testing.assert_allclose(run._past[joint].at(time), expected, rtol=0, atol=2e-4 * np.abs(expected).max())


def test_state_is_periodic_and_settled_whatever_the_steps():
    run = prepare(build(four_bar(), friction=LUGRE))
    history, duration = run._past["D"], run.cycle.duration
    time = np.linspace(0, 1, 37) * duration
    np.testing.assert_allclose(history.at(time + 3 * duration), history.at(time), rtol=1e-9, atol=1e-15)
    few, many = (positions_of(four_bar(), steps, friction=LUGRE) for steps in (18, 36))
    np.testing.assert_allclose(many["drive_effort"].values[:, ::2], few["drive_effort"].values, rtol=1e-12)


def test_dahl_from_rest():
    """Over a range the bristles start at rest: F = f N (1 − exp(−κ x/f)), exactly."""
    data = {**block(0.0, DAHL), "drivers": {"S": {"speed": 1e-4, "range": [0.0, 2e-4]}}}
    result = brief(Mechanism(**data), 41)
    expected = 0.12 * 2.0 * G * (1 - np.exp(-4e3 * result["joint_slide"].sel(joint="S").values / 0.12))
    np.testing.assert_allclose(-result["friction_force"].sel(joint="S").values, expected, rtol=1e-9, atol=1e-12)


def test_lugre_slides_steadily_by_stribecks_curve():
    """A fast drive leaves no trace of the bristles between reversals: the pin A always turns one way."""
    steady = {key: number for key, number in LUGRE.items() if key not in ("stiffness", "damping")} | {"law": "stribeck"}
    bristles, curve = positions_of(four_bar(), 24, friction=LUGRE), positions_of(four_bar(), 24, friction=steady)
    ratios = [
        one["friction_torque"].sel(joint="A").values / np.hypot(*one["reaction_force"].sel(joint="A").values)
        for one in (bristles, curve)
    ]
    np.testing.assert_allclose(*ratios, rtol=1e-3)


def test_maps_of_intervals_are_chained_and_closed():
    """z ↦ z/2 + 1, then z ↦ 0.8 z + 2: over both z ↦ 0.4 z + 2.8, which comes back to z₀ = 2.8/0.6; from rest 0."""
    keep, gain = np.array([0.5, 0.8]), np.array([1.0, 2.0])
    start = 2.8 / 0.6
    np.testing.assert_allclose(_chained(keep, gain, True), [start, start / 2 + 1, start], rtol=1e-15)
    np.testing.assert_allclose(_chained(keep, gain, False), [0.0, 1.0, 2.8], rtol=1e-15)
