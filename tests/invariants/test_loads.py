"""Loads that vary and follow, tables, springs and dampers: closed forms, energy, virtual work, and refusals."""

import copy

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms import findings, four_bar, slide, slider_crank
from mechanisms_parts import bare, joined
from trunnion import Mechanism, MechanismError
from trunnion.algebra.dual import Dual, derivative
from trunnion.algebra.spline import look_up
from trunnion.solve.run import prepare

STEPS = 48
TURN = 2 * np.pi
FULL_TURN = np.arange(STEPS) * (TURN / STEPS)


def run(data, steps=STEPS):
    """The variables of every position, without what is asked of the cycle."""
    return brief(Mechanism(**data), steps)


def analysed(data, steps=STEPS):
    """With findings and figures of the cycle."""
    return trunnion.analyse(Mechanism(**data), steps)


def effort(result):
    return np.asarray(result["drive_effort"].values[0])


def balanced(result):
    """The powers cancel to rounding, and there are some."""
    powers = [np.abs(result[name].values).max() for name in ("drive_power", "useful_power", "spring_power")
              if name in result]  # fmt: skip
    assert max(powers) > 0
    assert np.abs(result["power_residual"].values).max() < 1e-12 * max(powers)


def refused(**data):
    with pytest.raises(MechanismError) as caught:
        Mechanism(**data)
    return str(caught.value)


# expressions of the motion
@pytest.mark.spread(1)
@pytest.mark.parametrize("friction", [None, 0.1])
def test_expression_equals_the_constant_force_of_each_position(friction):
    data = slider_crank()
    data |= {"gravity": [0, -9.81], "dimensions": {"F": 600}}
    data["joint_defaults"] = {"pin": {"radius": 0.02}, "guide": {"length": 0.4}, "friction": friction or 0}
    data["loads"] = {
        "gas": {
            "link": "piston",
            "at": "H",
            "force": ["-1 N * F * (1 + cos(drive))", "3 N s * speed / 1 rad"],
            "moment": "2 N m * sin(2 * drive) + 1 N m/s * time",
        }
    }
    result = run(data)
    balanced(result)
    speed = data["drivers"]["A"]["speed"]
    for k in range(0, STEPS, 9):
        time = float(result["time"].values[k])
        q = speed * time
        constant = copy.deepcopy(data)
        del constant["dimensions"]
        load = {"force": [-600 * (1 + np.cos(q)), 3 * speed], "moment": 2 * np.sin(2 * q) + time}
        constant["loads"]["gas"] |= load
        same = run(constant)
        for name in ("drive_effort", "reaction_force", "useful_power"):
            np.testing.assert_allclose(result[name].values[..., k], same[name].values[..., k], rtol=1e-12, atol=1e-9)


def test_expressions_of_loads_take_samples_and_duals():
    data = bare(slider_crank()) | {"dimensions": {"F": "600 N ± 20 N"}}
    data["loads"] = {"gas": {"link": "piston", "at": "P", "force": ["-F * (1 + cos(drive))", 0]}}
    mechanism = Mechanism(**data)
    prepared = prepare(mechanism)
    time = prepared.cycle.times(9)
    assert "loads.gas.force.x" not in mechanism.parameters()
    one = prepared.solve(time).efforts["A"]
    samples = prepared.solve(time, mechanism.parameters({"F": np.array([[600.0], [1200.0]])})).efforts["A"]
    np.testing.assert_allclose(samples, np.stack([one, 2 * one]), atol=1e-9)
    slope = derivative(prepared.solve(time, mechanism.parameters({"F": Dual(600.0, 1.0)})).efforts["A"])
    np.testing.assert_allclose(slope, one / 600, atol=1e-12)
    # an override makes a number of the expression, and so does `with_values`
    fixed = prepared.solve(time, mechanism.parameters({"gas.force.x": -600.0})).efforts["A"]
    again = prepare(mechanism.with_values({"gas.force.x": "-600 N"})).solve(time).efforts["A"]
    np.testing.assert_allclose(fixed, again)
    np.testing.assert_allclose(one, fixed * (1 + np.cos(data["drivers"]["A"]["speed"] * time)), atol=1e-9)


# following forces, one-way resistance
def test_following_force_equals_the_force_turned_by_hand():
    data = four_bar()
    data["loads"] = {"push": {"link": "coupler", "at": "E", "force": [12.0, -30.0], "frame": "link"}}
    result = run(data)
    balanced(result)
    angle = result["link_angle"].sel(link="coupler").values
    for k in range(0, STEPS, 7):
        c, s = np.cos(angle[k]), np.sin(angle[k])
        data["loads"]["push"] = {"link": "coupler", "at": "E", "force": [12 * c + 30 * s, 12 * s - 30 * c]}
        np.testing.assert_allclose(effort(result)[k], effort(run(data))[k], rtol=1e-11)


@pytest.mark.parametrize("only", ["positive", "negative"])
def test_resistance_of_one_direction(only):
    data = bare(slider_crank())
    data["loads"] = {"cut": {"joint": "C", "resisting_force": 100.0, "only": only}}
    result = run(data, 49)
    balanced(result)
    speed = result["joint_slide_velocity"].sel(joint="C").values
    acts = speed > 0 if only == "positive" else speed < 0
    np.testing.assert_allclose(result["useful_power"].values, np.where(acts, 100 * np.abs(speed), 0), atol=1e-9)


def test_resistance_that_varies_and_one_that_drives():
    data = bare(slider_crank())
    data["loads"] = {"cut": {"joint": "C", "resisting_force": "100 N * (1 + cos(drive))"}}
    result = run(data)
    speed = np.abs(result["joint_slide_velocity"].sel(joint="C").values)
    np.testing.assert_allclose(result["useful_power"].values, 100 * (1 + np.cos(FULL_TURN)) * speed, atol=1e-9)
    data["loads"]["cut"]["resisting_force"] = "100 N * cos(drive)"
    assert any(row["code"] == "load.drives" for row in findings(analysed(data)))
    for touching in ("abs(sin(2 * drive + 0.5))", "(1 + sin(3 * drive)) ^ 3"):
        data["loads"]["cut"]["resisting_force"] = f"100 N * {touching}"
        assert not any(row["code"] == "load.drives" for row in findings(analysed(data)))
    data["loads"]["cut"]["resisting_force"] = "-3 N"
    assert "loads.cut.resisting_force: is -3 N, which is negative" in refused(**data)


# tables
KNOTS = [0.0, 0.4, 1.1, 2.5, 4.0, TURN]
VALUES = [3.0, -1.0, 2.0, 7.0, 1.0, 3.0]


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("periodic", [False, True])
def test_table_at_and_between_its_knots(smooth, periodic):
    np.testing.assert_allclose(look_up(KNOTS, VALUES, np.array(KNOTS), smooth, periodic), VALUES, atol=1e-12)
    place = np.linspace(0.05, TURN - 0.1, 37)
    found = look_up(KNOTS, VALUES, place, smooth, periodic)
    from scipy.interpolate import CubicSpline

    expected = CubicSpline(KNOTS, VALUES, bc_type="periodic" if periodic else "natural")(place)
    np.testing.assert_allclose(found, expected if smooth else np.interp(place, KNOTS, VALUES), rtol=1e-12)
    outside = look_up(KNOTS, VALUES, place + TURN, smooth, periodic)
    np.testing.assert_allclose(outside, found if periodic else np.where(place + TURN > TURN, np.nan, 0), rtol=1e-9)
    # samples of the values, and duals of place and value
    samples = look_up(KNOTS, [np.array([[v], [2 * v]]) for v in VALUES], place, smooth, periodic)
    np.testing.assert_allclose(samples, np.stack([found, 2 * found]), rtol=1e-9, atol=1e-12)
    dual = look_up(KNOTS, [Dual(v, v) for v in VALUES], place, smooth, periodic)
    np.testing.assert_allclose(derivative(dual), found, rtol=1e-9, atol=1e-12)
    by_place = derivative(look_up(KNOTS, VALUES, Dual(place, np.ones_like(place)), smooth, periodic))
    h = 1e-6
    ends = [look_up(KNOTS, VALUES, place + sign * h, smooth, periodic) for sign in (-1, 1)]
    np.testing.assert_allclose(by_place, (ends[1] - ends[0]) / (2 * h), atol=1e-6)


def table_of(interpolation="linear", periodic=True):
    points = [[f"{np.degrees(a)} deg", f"{v} bar"] for a, v in zip(KNOTS, VALUES, strict=True)]
    return {"over": "drive", "points": points, "interpolation": interpolation, "periodic": periodic}


@pytest.mark.parametrize("interpolation", ["linear", "spline"])
def test_load_by_a_table(interpolation):
    """An indicator diagram: pressure over the crank angle, times the area of the piston."""
    data = bare(slider_crank()) | {"tables": {"p": table_of(interpolation)}, "dimensions": {"area": "20 cm^2"}}
    data["drivers"] = {"A": {"speed": 5.0, "start": 2.0}}  # the drive runs beyond a turn
    data["loads"] = {"gas": {"link": "piston", "at": "P", "force": ["-p * area", 0]}}
    result = run(data)
    balanced(result)
    drive = 2.0 + 5.0 * result["time"].values
    pressure = 1e5 * look_up(KNOTS, VALUES, drive, interpolation == "spline", True)
    data["loads"]["gas"]["force"] = [-1, 0]
    one = run(data)
    np.testing.assert_allclose(effort(result), effort(one) * pressure * 20e-4, rtol=1e-9, atol=1e-9)
    mechanism = Mechanism(**data)
    assert mechanism.parameters()["tables.p.points.1.value"] == pytest.approx(-1e5)
    assert mechanism.parameter_kinds()["tables.p.points.1.at"].name == "angle"


def test_outside_its_table_a_load_has_no_value():
    data = bare(slider_crank()) | {"tables": {"f": {"over": "time", "points": [[0, "1 N"], ["0.5 s", "3 N"]]}}}
    data["loads"] = {"push": {"link": "piston", "at": "P", "force": ["f", 0]}}
    result = analysed(data)
    out = result["time"].values > 0.5
    np.testing.assert_array_equal(result["status"].values == trunnion.Status.LOAD_UNDEFINED, out)
    assert np.all(np.isnan(effort(result)) == out)
    assert np.all(np.isfinite(result["point_velocity"].values))
    row = next(row for row in findings(result) if row["where"] == "loads.push")
    assert row["code"] == "load.undefined"
    assert "periodic" in row["remedy"]


# springs
def spring_four_bar(**spring):
    data = bare(four_bar())
    data["links"]["ground"]["points"]["S"] = [0.2, 1.1]
    data["springs"] = {"S": {"between": ["ground.S", "coupler.E"], **spring}}
    return data


def test_effort_of_a_spring_is_the_slope_of_its_energy():
    """Massless, no friction: the drive torque is dV/dθ, V = F₀ e + k e²/2 with e = L − L₀."""
    k, free, preload = 900.0, 0.3, 20.0
    data = spring_four_bar(stiffness=k, free_length=free, preload=preload)
    result = run(data)
    balanced(result)

    def energy(shift):
        moved = copy.deepcopy(data)
        moved["drivers"]["A"]["start"] = shift
        e = run(moved)["spring_elongation"].values[0]
        return np.asarray(preload * e + k * e * e / 2)

    h = 1e-3
    slope = (8 * (energy(h) - energy(-h)) - (energy(2 * h) - energy(-2 * h))) / (12 * h)
    np.testing.assert_allclose(effort(result), slope, atol=1e-8 * np.abs(slope).max())
    place = result["point_position"].sel(point="coupler.E").values.T - [0.2, 1.1]
    length = np.hypot(*place.T) if place.shape[1] == 2 else np.hypot(*place)
    np.testing.assert_allclose(result["spring_elongation"].values[0], length - free, rtol=1e-12)
    np.testing.assert_allclose(result["spring_force"].values[0], preload + k * (length - free), rtol=1e-10)
    # what it takes it gives back: no net work over the turn
    power = result["spring_power"].values[0]
    assert abs(power.mean()) < 1e-6 * np.abs(power).max()
    assert abs(run(data, 400)["drive_power"].values.mean()) < 1e-12 * np.abs(power).max()
    assert np.all(result["damping_power"].values == 0)
    assert np.all(result["useful_power"].values == 0)


def test_damper_takes_what_the_drive_gives():
    result = run(spring_four_bar(damping=35.0), 400)
    balanced(result)
    lost = result["damping_power"].values[0]
    assert np.all(lost >= 0)
    assert lost.max() > 0
    np.testing.assert_allclose(result["spring_power"].values[0], -lost, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(result["drive_power"].values[0], lost, rtol=1e-9, atol=1e-9)
    # the integral ∮ c L̇² dt with L̇ from the lengths alone
    length, time = result["spring_elongation"].values[0], result["time"].values
    step = time[1] - time[0]
    wave = np.fft.fftfreq(len(length), step) * TURN
    rate = np.fft.ifft(1j * wave * np.fft.fft(length)).real
    np.testing.assert_allclose(35.0 * np.mean(rate**2), lost.mean(), rtol=1e-9)


def test_torsional_spring_in_another_joint():
    """Virtual work: effort · ω_A = k φ · ω_C, φ the rotation of C from the free angle; no net work over a turn."""
    data = bare(four_bar())
    data["springs"] = {"S": {"joint": "C", "stiffness": 3.0, "free_angle": 1.0, "preload": "2 N m"}}
    result = analysed(data, 360)
    balanced(result)
    turned = result["joint_rotation"].sel(joint="C").values - 1.0
    phi = (turned + np.pi) % TURN - np.pi
    np.testing.assert_allclose(result["spring_elongation"].values[0], phi, atol=1e-12)
    rate = result["joint_rotation_velocity"].sel(joint="C").values
    np.testing.assert_allclose(effort(result) * 4.0, (2 + 3 * phi) * rate, atol=1e-10)
    assert abs(result["spring_power"].values.mean()) < 1e-10
    assert not [row for row in findings(result) if row["where"] == "springs.S"]
    data["springs"]["S"] |= {"joint": "B", "free_angle": 0.0}  # B turns round and round
    assert next(row["code"] for row in findings(analysed(data)) if row["where"] == "springs.S") == "spring.jump"


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_duals_of_spring_numbers_equal_central_differences(friction):
    data = spring_four_bar(stiffness=900.0, free_length=0.3, damping=20.0, preload=5.0)
    data["springs"]["T"] = {"joint": "C", "stiffness": 3.0, "free_angle": 1.0, "damping": 0.2}
    data["joint_defaults"] = {"pin": {"radius": 0.02}, "friction": friction}
    mechanism = Mechanism(**data)
    prepared = prepare(mechanism)
    time = prepared.cycle.times(11)[1:]
    method = trunnion.FrictionMethod("newton", 1e-12)
    for path in [path for path in mechanism.parameters() if path.startswith("springs.")] + ["ground.points.S.x"]:
        value = mechanism.parameters()[mechanism.parameter_set.resolve(path)]
        step = 1e-4 * max(abs(value), 0.1)

        def solved(number, path=path):
            return prepared.solve(time, mechanism.parameters({path: number}), method).efforts["A"]

        differences = (solved(value + step) - solved(value - step)) / (2 * step)
        scale = np.abs(differences).max()
        np.testing.assert_allclose(derivative(solved(Dual(value, 1.0))), differences, atol=2e-7 * scale, err_msg=path)


def test_where_the_ends_of_a_spring_meet_it_has_no_value():
    data = bare(four_bar())
    data["links"]["ground"]["points"]["S"] = [0.3, 0.0]
    data["springs"] = {"S": {"between": ["ground.S", "crank.B"], "stiffness": 10.0, "free_length": 0.1}}
    result = analysed(data, 8)
    np.testing.assert_array_equal(result["status"].values == trunnion.Status.LOAD_UNDEFINED, np.arange(8) == 0)
    assert "has no value at 0°" in next(row["what"] for row in findings(result) if row["where"] == "springs.S")
    assert np.isnan(effort(result)[0])
    assert np.all(np.isfinite(effort(result)[1:]))


# refusals
STIFF = {"stiffness": 5.0, "free_length": 0.1}
STILL = {"drivers": {}, "loads": {"push": {"link": "coupler", "at": "E", "force": ["1 N * drive/1 rad", 0]}}}
TWO = {"points": [[0, "1 N"], [1, "2 N"]]}
ROUND = {"points": [[0, "1 N"], [1, "2 N"], [2, "3 N"]], "periodic": True}
REFUSED = [
    # a spring between the ground and the coupler, and in the joint C
    ("spring", {**STIFF, "stiffness": -5.0}, "springs.S.stiffness: is -5 N/m, which is negative"),
    ("spring", {**STIFF, "stiffness": "5 N m"}, "is a moment where a stiffness is needed"),
    ("spring", {**STIFF, "stiffness": "5 N"}, "is a force where a stiffness or torsional stiffness is needed"),
    ("spring", {"damping": "5 N/m"}, "is a stiffness where a damping or torsional damping is needed"),
    ("spring", {"stiffness": 5.0}, "a stiffness without a free_length"),
    ("spring", {"stiffness": 5.0, "free_angle": 1.0}, "has no free_angle"),
    ("spring", {"damping": 5.0, "free_length": 0.1}, "has no effect without stiffness"),
    ("spring", {}, "states nothing — state at least one of stiffness"),
    ("spring", {**STIFF, "joint": "A"}, "states between and joint"),
    ("spring", {"between": ["ground.S", "coupler.F"], "preload": 1.0}, "there is no point 'coupler.F'"),
    ("spring", {"between": ["coupler.B", "coupler.E"], "preload": 1.0}, "both ends are on the link 'coupler'"),
    ("spring", {**STIFF, "stiffness": "2 N/mm * cos(drive)"}, "drive, speed, time and tables are for loads"),
    ("torsion", {"stiffness": "2 N/mm", "free_angle": 0.0}, "is a stiffness where a torsional stiffness is needed"),
    ("torsion", {"stiffness": 2.0, "free_length": 0.1}, "has no free_length"),
    ("torsion", {"stiffness": 2.0, "free_angle": "900 deg"}, "is 2.5 turns"),
    ("spring", {"only": "pull", "damping": 5.0}, "springs.S.only: has no effect without stiffness"),
    ("spring", {**STIFF, "only": "twist"}, "springs.S.only: 'twist' is not one of 'pull' or 'push'"),
    ("spring", {**STIFF, "only": "pull", "preload": "-3 N"}, "preload: is -3 N, which pushes"),
    ("spring", {**STIFF, "only": "push", "preload": "3 N"}, "preload: is 3 N, which pulls"),
    ("torsion", {"only": "pull", "stiffness": 5.0, "free_angle": 0.1}, "a spring in a joint that turns cannot only"),
    # a force of the motion
    ("force", "600 N * crank", "refers to 'crank', which is not one of the dimensions"),
    ("force", "600 N / drive * 1 m", "where a force is needed"),
    ("force", "600 N * (1 + time)", "added"),
    ("force", "600 N * cos(time)", "cos is given a time"),
    ("force", "600 N * cos(drive) ± 5 N", "varies with the motion"),
    ("force", "600 N * between(drive, 0 deg)", "between takes 3 arguments"),
    ("force", "600 N * between(drive, 0 deg, 3 mm)", "combined in between"),
    # tables
    ("table", {"points": [[0, "1 N"]]}, "at least 2 are needed"),
    ("table", {"points": [[0, "1 N"], ["10 mm", "2 N"]]}, "tables.t.points.1.at: '10 mm' is a length where an angle"),
    ("table", {"points": [[0, "1 N"], [0, "2 N"]]}, "does not come after"),
    ("table", {"points": [[0, "1 N"], [1, "2 mm"]]}, "is a length, the values before are a force"),
    ("table", ROUND, "begins at 1 and ends at 3"),
    ("table", {**TWO, "periodic": True}, "needs three points"),
    ("table", {**TWO, "interpolation": "cubic"}, "is not one of"),
    ("table", {"points": [[0, "1 N"], [1, "2 N * drive"]]}, "are for loads"),
    ("model", {"tables": {"time": TWO}}, "tables.time: 'time' is a reserved name"),
    ("model", {"tables": {"t": TWO}, "dimensions": {"t": 1.0}}, "is a dimension"),
    ("model", {"tables": {"my table": TWO}}, "cannot be used in an expression"),
    ("model", {"dimensions": {"drive": 1.0}}, "dimensions.drive: 'drive' is a reserved name of expressions"),
    ("model", {"dimensions": {"L": "2 m * cos(drive)"}}, "drive, speed, time and tables are for loads"),
    ("model", STILL, "the model has no driver"),
    ("load", {"link": "coupler", "at": "E", "force": [1, 0], "only": "positive"}, "load.only: is stated beside link"),
    ("load", {"joint": "D", "resisting_torque": 1.0, "frame": "link"}, "load.frame: is stated beside joint"),
]


def test_what_is_so_anyway_may_be_stated():
    load = {"joint": "D", "resisting_torque": 1.0}
    stated, plain = (Mechanism(**(four_bar() | {"loads": {"load": load | more}})) for more in ({"frame": "global"}, {}))
    assert stated.parameters() == plain.parameters()


@pytest.mark.parametrize(("kind", "stated", "words"), REFUSED)
def test_what_makes_no_sense_is_refused(kind, stated, words):
    if kind == "spring":
        data = spring_four_bar(**stated)
    elif kind == "torsion":
        data = bare(four_bar()) | {"springs": {"S": {"joint": "C", **stated}}}
    elif kind == "force":
        data = four_bar() | {"loads": {"push": {"link": "coupler", "at": "E", "force": [stated, 0]}}}
    elif kind == "load":
        data = four_bar() | {"loads": {"load": stated}}
    else:
        data = four_bar() | ({"tables": {"t": stated}} if kind == "table" else stated)
    assert words in refused(**data)


FREE = 0.62  # m: within the lengths that the spring goes through


@pytest.mark.spread(2)
@pytest.mark.parametrize("preload", [0.0, 15.0])
@pytest.mark.parametrize("damping", [0.0, 20.0])
def test_a_rope_and_a_bumper_are_halves_of_the_spring(damping, preload):
    """Where one acts it is the spring of both ways, where it does not there is nothing; so with the drive torque."""
    stated = {"stiffness": 900.0, "free_length": FREE, "damping": damping}
    for only, sign in (("pull", 1.0), ("push", -1.0)):
        whole, half = (analysed(spring_four_bar(**stated, preload=sign * preload, **way), 180)
                       for way in ({}, {"only": only}))  # fmt: skip
        acts = sign * whole["spring_elongation"].values[0] > 0
        assert 10 < np.count_nonzero(acts) < 170
        for name in ("spring_force", "spring_power", "damping_power", "drive_effort"):
            np.testing.assert_allclose(half[name][0], np.where(acts, whole[name][0], 0.0), rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(half["spring_elongation"], whole["spring_elongation"])
        assert np.abs(half["power_residual"].values).max() < 1e-12 * np.abs(half["drive_power"].values).max()


def cart(**more):
    """A cart that is driven along the ground, from 0 to 0.25 m."""
    return {
        "links": {"ground": {"points": {"X": slide(0, 0)}}, "cart": {"points": {"X": slide(0, 0)}}},
        "joints": joined("ground =X= cart"),
        "drivers": {"X": {"speed": 0.1, "range": [0.0, 0.25]}},
        **more,
    }


def test_a_spring_without_free_length_needs_no_direction():
    """Its ends meet at 0°: it pulls by k times the way between them, and turns the crank by k r² sin θ everywhere."""
    data = spring_four_bar()
    data["springs"]["S"] = {"between": ["ground.S", "crank.B"], "stiffness": 10.0, "free_length": 0}
    x, y = data["links"]["ground"]["points"]["S"] = list(data["links"]["crank"]["points"]["B"])
    result = analysed(data, 12)
    turn = np.arange(12) * np.pi / 6
    assert result["drive_effort"].values[0] == pytest.approx(10.0 * (x * x + y * y) * np.sin(turn), abs=1e-12)


def test_torsional_spring_in_the_driven_joint():
    """Closed form: the drive turns against k (θ − θ₀) + c ω, whole turns counted."""
    data = bare(four_bar())
    data["springs"] = {
        "S": {"joint": "A", "stiffness": "3 N m/rad", "free_angle": "20 deg", "damping": "0.1 N m s/rad"}
    }
    data["drivers"]["A"] = {"speed": 4.0, "range": ["-30 deg", "500 deg"]}
    result = run(data)
    angle = np.radians(np.linspace(-30, 500, STEPS))
    np.testing.assert_allclose(effort(result), 3 * (angle - np.radians(20)) + 0.1 * 4.0, rtol=1e-12)
    np.testing.assert_allclose(result["damping_power"].values[0], 0.1 * 16.0)
    balanced(result)


def test_a_slide_has_springs_bumpers_and_loads_by_its_way():
    """2 N/mm beyond −10 mm with 50 N s/m at 0.1 m/s; a bumper over the first 50 mm; 2 N/mm by the drive itself."""
    way = np.linspace(0.0, 0.25, 6)
    springs = {"S": {"joint": "X", "stiffness": "2 N/mm", "free_length": "-10 mm", "damping": "50 N s/m"}}
    np.testing.assert_allclose(effort(run(cart(springs=springs), 6)), 2000 * (way + 0.01) + 50 * 0.1, rtol=1e-12)
    springs = {"S": {"joint": "X", "stiffness": 2000.0, "free_length": 0.05, "only": "push"}}
    np.testing.assert_allclose(effort(run(cart(springs=springs), 6)), np.minimum(2000 * (way - 0.05), 0), atol=1e-12)
    loads = {"back": {"link": "cart", "at": "X", "force": ["-2 N/mm * drive", 0]}}
    np.testing.assert_allclose(effort(run(cart(loads=loads), 6)), 2000 * way, rtol=1e-12, atol=1e-12)
    loads["back"]["force"] = ["-2 N * cos(drive)", 0]
    assert "cos is given a length" in refused(**cart(loads=loads))
