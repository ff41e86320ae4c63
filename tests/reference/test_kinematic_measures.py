"""Speeds, angles, dwells, expressions and starting times as measures, against closed forms and differences."""

import numpy as np
import pytest
from scipy.optimize import brentq

import trunnion
from measured import figures
from mechanisms import build, four_bar, slider_crank
from mechanisms_parts import example
from mechanisms_space import rssr
from timed import LINEAR, wheel
from trunnion import Mechanism, MechanismError
from trunnion.algebra.dual import Dual, derivative
from trunnion.measures.evaluation import NumpyKernel
from trunnion.measures.measures import Measure, named
from trunnion.solve.forward import forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare
from trunnion.solve.shifts import HOLE
from trunnion.studies.tolerance.kernel import CompiledCourses, kernel_of

R, L, W = 0.3, 1.0, 2.0  # crank and rod, m; drive speed, rad/s


@pytest.fixture(scope="module")
def centric():
    """A slider-crank in line that turns counterclockwise."""
    return prepare(build({**slider_crank(R, L, 0.0), "drivers": {"A": {"speed": W}}}))


@pytest.fixture(scope="module")
def spatial():
    return prepare(example("rssr"))


def course(run, name, time):
    """A measure at some times, s."""
    measure = named(run.system.mechanism, [name], run.values)[0]
    back = run.solve(time) if not measure.of_motion else run.walk(time)
    return np.broadcast_to(measure.curve(back)[0], np.shape(time))


def test_speeds_of_the_slider_crank(centric):
    """x = r cos θ + √(l² − r² sin² θ), differentiated twice by θ."""
    angle = np.linspace(0.1, 6.1, 13)
    s, c = np.sin(angle), np.cos(angle)
    rod = np.sqrt(L**2 - (R * s) ** 2)
    slope = -R * s - R**2 * s * c / rod
    bend = -R * c - R**2 * (c * c - s * s) / rod - R**4 * (s * c) ** 2 / rod**3
    time, turn = angle / W, -R * c / rod * W  # ψ̇ of the rod: sin ψ = −(r/l) sin θ
    np.testing.assert_allclose(course(centric, "velocity:piston.P.x", time), W * slope, rtol=1e-12)
    np.testing.assert_allclose(course(centric, "velocity:piston.P", time), np.abs(W * slope), rtol=1e-12)
    np.testing.assert_allclose(course(centric, "rate:C", time), W * slope, rtol=1e-12)
    np.testing.assert_allclose(course(centric, "acceleration:piston.P.x", time), W**2 * bend, rtol=1e-11)
    np.testing.assert_allclose(course(centric, "joint_acceleration:C", time), W**2 * bend, rtol=1e-11)
    np.testing.assert_allclose(course(centric, "angular_velocity:rod", time), turn, rtol=1e-12)
    np.testing.assert_allclose(course(centric, "pressure_angle:C", time), np.arcsin(-R * s / L), atol=1e-13)
    second = W**2 * R * s * (1 / rod - R**2 * c * c / rod**3)
    np.testing.assert_allclose(course(centric, "angular_acceleration:rod", time), second, rtol=1e-11)
    np.testing.assert_allclose(course(centric, "joint_acceleration:B", time), second, rtol=1e-11)  # the crank has none


def test_strokes_along_directions(centric):
    """Twice the crank along the guide; across it none; of the crank pin in any direction."""
    asked = [
        Measure("slide", "stroke", "C"),
        Measure("along", "point", "piston.P", statistic="peak-to-peak", along=(3.0, 0.0)),
        Measure("across", "point", "piston.P", statistic="peak-to-peak", along=(0.0, 1.0)),
        Measure("pin", "point", "crank.B", statistic="peak-to-peak", along=(1.0, 2.0)),
    ]
    found = figures(centric, asked, 180)
    np.testing.assert_allclose(list(found.values()), [2 * R, 2 * R, 0.0, 2 * R], atol=1e-12)


def test_figures_of_the_speed(centric):
    """The crank pin goes round at r ω: its components have that amplitude, its root mean square is r ω/√2."""
    of = {"kind": "velocity", "subject": "crank.B", "axis": "x"}
    asked = [
        Measure(one, **of, statistic=one)
        for one in ("maximum", "minimum", "peak-to-peak", "mean", "rms", "largest", "place-of-maximum")
    ]
    found = figures(centric, asked, 180)
    v = R * W
    np.testing.assert_allclose(list(found.values())[:-1], [v, -v, 2 * v, 0.0, v / np.sqrt(2), v], atol=1e-11)
    assert found["place-of-maximum"] % (2 * np.pi) == pytest.approx(1.5 * np.pi, abs=1e-9)


def test_dwell_within_a_band(centric):
    """r cos θ is above c for arccos(c/r)/π of the time; with its derivative by r."""
    band = Measure("dwell", "point", "crank.B", "x", statistic="dwell", within=(0.1, 1.0))
    assert figures(centric, [band], 360)["dwell"] == pytest.approx(np.arccos(0.1 / R) / np.pi, abs=1e-8)
    changed = figures(centric, [band], 360, {"links.crank.points.B.x": Dual(R, 1.0)})["dwell"]
    expected = 0.1 / (R * np.pi * np.sqrt(R**2 - 0.01))
    assert float(np.ravel(derivative(changed))[0]) == pytest.approx(expected, rel=1e-6)
    part = Measure("part", "point", "crank.B", "x", statistic="dwell", within=(0.0, 1.0), over=(0.0, np.pi))
    assert figures(centric, [part], 360)["part"] == pytest.approx(0.5, abs=1e-8)
    assert band.figure_unit(centric.system, centric.values) == "1"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_transmission_angle_by_the_law_of_cosines(side):
    """cos μ = (b² + c² − d²)/(2 b c), d² = a² + g² − 2 a g cos θ, folded; least where the crank is in line."""
    a, b, c, g = 0.3, 0.9, 0.7, 1.0
    run = prepare(build(four_bar(a, b, c, g, side)))
    time = np.linspace(0, run.cycle.duration, 25)
    angle = 4.0 * time
    cosine = (b * b + c * c - a * a - g * g + 2 * a * g * np.cos(angle)) / (2 * b * c)
    for joint in "BCD":
        np.testing.assert_allclose(
            course(run, f"transmission_angle:{joint}", time), np.arccos(np.abs(cosine)), atol=1e-12
        )
    least = figures(run, [Measure("mu", "transmission_angle", "C", statistic="minimum")], 180)["mu"]
    ends = [(b * b + c * c - (g + sign * a) ** 2) / (2 * b * c) for sign in (1, -1)]
    assert least == pytest.approx(min(np.arccos(abs(one)) for one in ends), abs=1e-9)
    with pytest.raises(MechanismError) as raised:
        course(run, "transmission_angle:A", time)
    assert raised.value.findings[0].where == "joints.A"


def slope(run, name, time, step=1e-5):
    return (course(run, name, time + step) - course(run, name, time - step)) / (2 * step)


@pytest.mark.slow
def test_speeds_in_space_by_differences(spatial):
    mechanism, time = spatial.system.mechanism, np.linspace(0.01, 0.15, 7)
    for point in [f"{link}.{point}" for link, names in mechanism.points.items() for point in names]:
        found = [course(spatial, f"velocity:{point}.{axis}", time) for axis in "xyz"]
        for axis, one in zip("xyz", found, strict=True):
            np.testing.assert_allclose(one, slope(spatial, f"{point}.{axis}", time), rtol=1e-6, atol=1e-7)
            second = course(spatial, f"acceleration:{point}.{axis}", time)
            np.testing.assert_allclose(second, slope(spatial, f"velocity:{point}.{axis}", time), rtol=1e-6, atol=1e-5)
        size = np.sqrt(sum(one**2 for one in found))
        np.testing.assert_allclose(course(spatial, f"velocity:{point}", time), size, atol=1e-12)
        skew = Measure("skew", "velocity", point, along=(1.0, -2.0, 2.0)).curve(spatial.walk(time))[0]
        np.testing.assert_allclose(skew, (found[0] - 2 * found[1] + 2 * found[2]) / 3, atol=1e-12)
    for joint in ("A", "D"):
        rate, second = course(spatial, f"rate:{joint}", time), course(spatial, f"joint_acceleration:{joint}", time)
        np.testing.assert_allclose(rate, slope(spatial, f"rotation:{joint}", time), rtol=1e-6)
        np.testing.assert_allclose(second, slope(spatial, f"rate:{joint}", time), rtol=1e-6, atol=1e-5)
        moving = next(link for link in spatial.system.joints[joint].links if link != mechanism.fixed_link)
        np.testing.assert_allclose(course(spatial, f"angular_velocity:{moving}", time), np.abs(rate), rtol=1e-12)
        size = course(spatial, f"angular_acceleration:{moving}", time)
        np.testing.assert_allclose(size, np.abs(second), rtol=1e-9, atol=1e-9)
    with pytest.raises(MechanismError):
        course(spatial, "transmission_angle:A", time)


PARTS = {  # variable of `analyse` and where
    "effort:A": ("drive_effort", {"driver": "A"}), "power:A": ("drive_power", {"driver": "A"}),
    "reaction:P.y": ("reaction_force", {"joint": "P", "axis": "y"}), "rotation:P": ("joint_rotation", {"joint": "P"}),
    "rate:P": ("joint_rotation_velocity", {"joint": "P"}), "slide:C": ("joint_slide", {"joint": "C"}),
    "joint_acceleration:C": ("joint_slide_acceleration", {"joint": "C"}), "angle:rod": ("link_angle", {"link": "rod"}),
    "friction_power:C": ("friction_power", {"joint": "C"}), "efficiency:instant": ("efficiency_instant", {}),
    **{f"{kind}:{name}": (kind, {"spring": name}) for kind in ("spring_force", "spring_elongation")
       for name in ("line", "coil")},
}  # fmt: skip


def test_measures_are_the_numbers_of_the_analysis():
    """At every position, and over the cycle: efficiency, root mean square, energy lost, and those the model states."""
    data = slider_crank(R, L, 0.1)
    data["loads"]["press"] = {"joint": "C", "resisting_force": "30 N", "useful": True}
    data["springs"] = {
        "line": {"between": ["ground.A", "rod.P"], "stiffness": "1 kN/m", "free_length": "0.2 m", "damping": "3 N s/m"},
        "coil": {"joint": "P", "stiffness": "2 N m/rad", "free_angle": "10 deg"},
    }
    data["measures"] = {"speed": {"velocity": "piston.P"}, "swing": {"stroke": "C"}}
    mechanism = build(data, friction=0.1)
    run, result = prepare(mechanism), trunnion.analyse(mechanism, 24)
    time = result["time"].values
    for name, (variable, where) in PARTS.items():
        expected = result[variable].sel(where).values
        np.testing.assert_allclose(course(run, name, time), expected, rtol=1e-9, atol=1e-12, err_msg=name)
    force = result["reaction_force"].sel(joint="P")
    np.testing.assert_allclose(course(run, "reaction:P", time), np.hypot(*force.values), rtol=1e-9)
    np.testing.assert_allclose(course(run, "power:press", time), -result["useful_power"].values, rtol=1e-9, atol=1e-12)
    speed = np.hypot(*result["point_velocity"].sel(point="piston.P").values)
    np.testing.assert_allclose(result["measure_value"].sel(measure="speed"), speed, rtol=1e-12)
    stroke = np.sqrt((L + R) ** 2 - 0.01) - np.sqrt((L - R) ** 2 - 0.01)
    assert float(result["measure_figure"].sel(measure="swing")) == pytest.approx(stroke, rel=1e-12)
    names = ["efficiency:cycle", "rms:effort:A", "friction_energy:B"]
    found = figures(run, named(mechanism, names, run.values), 24)
    assert found["efficiency:cycle"] == pytest.approx(float(result["efficiency"]), rel=1e-6)
    assert found["rms:effort:A"] == pytest.approx(float(result["drive_effort_rms"][0]), rel=1e-6)
    lost = float(result["friction_power_mean"].sel(joint="B")) * run.cycle.duration
    assert found["friction_energy:B"] == pytest.approx(lost, rel=1e-6)


@pytest.mark.slow
def test_forces_in_space_are_those_of_the_analysis():
    """Effort, reaction and its size, power lost, of an RSSR with friction."""
    run = prepare(Mechanism(**rssr(friction=0.1).data))
    result = trunnion.analyse(run.system.mechanism, 24)
    time, force = result["time"].values, result["reaction_force"].sel(joint="D").values
    expected = {
        "effort:A": result["drive_effort"].values[0],
        "reaction:D.z": force[2],
        "reaction:D": np.linalg.norm(force, axis=0),
        "friction_power:D": result["friction_power"].sel(joint="D").values,
    }
    for name, values in expected.items():
        np.testing.assert_allclose(course(run, name, time), values, rtol=1e-9, err_msg=name)


def test_play_of_a_speed():
    """By derivatives of the whole motion, against differences with a pin moved in its hole."""
    data = example("fourbar-with-play").data()
    data["measures"] = {"speed": {"velocity": "rocker.C", "limit": "1 m/s"}}
    data = Mechanism(**data).with_seats("free").data()
    on_hole = {name: joint | {"seat_on": joint["links"][1]} for name, joint in data["joints"].items()}
    mechanism = Mechanism(**{**data, "joints": on_hole})
    result = trunnion.play(mechanism, ["speed", "rate:D"], steps=12)
    run, time = prepare(mechanism), result["time"].values
    for row, name in enumerate(("speed", "rate:D")):
        measure = named(mechanism, [name], run.values)[0]
        slopes = result["sensitivity"].isel(measure=row)
        for joint in result["joint"].values:
            for axis in "xy":
                path = f"{HOLE}.{joint}.1.{axis}"
                moved = ({**run.values, path: off} for off in (1e-7, -1e-7))
                ends = [measure.curve(forward(run.system, one, run.chosen.assembly, time))[0] for one in moved]
                expected = np.broadcast_to((ends[0] - ends[1]) / 2e-7, 12)
                found = slopes.sel(joint=joint, end="1", axis=axis).values
                np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5)


def model(more=None, **measures):
    """A crank and rocker without friction, and its measures."""
    data = four_bar() | {"dimensions": {"ab": "0.3 m"}, "measures": measures, **(more or {})}
    crank = {"points": {"A": [0, 0], "B": ["ab", 0]}, "mass": 1.0, "centre": ["ab/2", 0], "inertia": 0.1}
    return Mechanism(**data | {"links": data["links"] | {"crank": crank}})


def test_a_lead_is_the_difference_of_angles_without_jumps():
    found = trunnion.analyse(model(input={"rotation": "A"}, lead="input - D.rotation"), steps=48)
    angles = (np.unwrap(found.joint_rotation.sel(joint=joint).values) for joint in "AD")
    lead = np.subtract(*angles)
    values = found.measure_value.sel(measure="lead").values
    assert values - values[0] == pytest.approx(lead - lead[0], abs=1e-12)


def test_error_of_a_universal_joint_against_even_rotation():
    """θ₂ − θ₁ of a Cardan joint bent by β swings between ±arctan((1 − cos β)/(2 √cos β)).

    Source: F. Duditza, Kardangelenkgetriebe und ihre Anwendungen, 1973.
    """
    bare = trunnion.read("examples/universal-joint.yaml").data()
    error = {"expression": "output.rotation - input.rotation", "as": "peak-to-peak"}
    found = trunnion.analyse(Mechanism(**{**bare, "measures": {"error": error}}), steps=4)
    bend = float(np.radians(30.0))
    swing = 2 * np.arctan((1 - np.cos(bend)) / (2 * np.sqrt(np.cos(bend))))
    assert float(found.measure_figure.sel(measure="error")) == pytest.approx(swing, rel=1e-9)


def test_derivatives_are_those_of_differences():
    own = {"lead": "B.rotation - 2 * D.rotation", "torque": {"effort": "A"}, "mixed": "lead * torque / ab"}
    mechanism = model(**own)
    run = prepare(mechanism)
    measures = named(mechanism, ["lead", "mixed"], run.values)
    kernel, time = NumpyKernel(run, measures, FrictionMethod()), np.linspace(0.1, 1.4, 7)

    def at(ab):
        return kernel.courses(mechanism.parameters({"dimensions.ab": ab}), time)[0]

    exact, above, below = at(Dual(0.3, 1.0)), at(0.3 + 1e-6), at(0.3 - 1e-6)
    for measure in measures:
        slope = (above[measure.name][0] - below[measure.name][0]) / 2e-6
        assert exact[measure.name][0].dual == pytest.approx(slope, rel=1e-6, abs=1e-6)


def test_both_engines_agree():
    mechanism = model(lead="A.rotation - D.rotation", twice="2 * lead", ratio="A.effort / (1 N m) + sqrt(ab / (1 m))")
    run = prepare(mechanism)
    measures, method = named(mechanism, ["lead", "twice", "ratio"], run.values), FrictionMethod()
    values = mechanism.parameters({"dimensions.ab": np.array([[0.29], [0.3], [0.31]])})
    time = np.broadcast_to(np.linspace(0.0, 1.5, 9), (3, 9))
    kernel = kernel_of(run, measures, method)
    compiled = CompiledCourses(run, measures, method)
    one, other = (each.courses(values, time)[0] for each in (kernel, compiled))
    for measure in measures:
        assert one[measure.name][0] == pytest.approx(other[measure.name][0], abs=1e-9)


def test_a_sweep_and_a_tolerance_know_them():
    own = {"lead": {"expression": "A.rotation - D.rotation", "as": "maximum", "over": ["60 deg", "200 deg"]}}
    toleranced = model({"tolerances": {"ab": {"limits": "±1 mm"}}}, **own)
    swept = trunnion.sweep(toleranced, over={"ab": np.array([0.299, 0.301])}, measures=["lead"])
    ends = [
        float(trunnion.analyse(toleranced.with_values({"ab": ab}), steps=4).measure_figure[0]) for ab in (0.299, 0.301)
    ]
    assert swept["lead"].values == pytest.approx(ends, abs=1e-11)
    found = trunnion.tolerance(toleranced, methods=("linear",), steps=36).isel(measure=0)
    assert 2 * float(found.worst_case_upper) == pytest.approx(abs(ends[1] - ends[0]), rel=1e-3)


def test_an_expression_that_is_its_own_circle_or_means_nothing_is_a_finding():
    for text, says in [
        ("2 * lead", "itself"), ("input - ab", "added"), ("high - low", "at every position"), ("__import__('os')", ""),
        ("swing + input", "without place, range"),
    ]:  # fmt: skip
        swing = {"expression": "input", "as": "maximum"}
        with pytest.raises(MechanismError) as error:
            model(input="A.rotation", lead=text, high={"stroke": "D"}, low={"stroke": "D"}, swing=swing)
        assert all(one.where.startswith("measures.lead") for one in error.value.findings), text
        assert says in str(error.value), text


DURATION = 12.0
MEASURE = {"starting_time": "A", "duration": DURATION}


def starting_time(inertia):
    """Of J ω̇ = 4 (1 − ω/150) − 0.6, where the mean of a turn is 95 % of that of the last in DURATION."""
    tau, turn = inertia * 150 / 4, 2 * np.pi

    def gone(time):
        return 127.5 * float(time - tau * (1 - np.exp(-time / tau)))

    def takes(time):
        return time - float(brentq(lambda t: gone(t) - gone(time) + turn, 0.0, time, xtol=1e-14))

    limit = takes(DURATION) / 0.95
    return float(brentq(lambda t: takes(t) - limit, 2.0 * tau, DURATION, xtol=1e-13))


@pytest.mark.slow
def test_first_order_of_the_starting_time():
    """The sensitivity to the inertia, by differences of the closed form; samples scatter about it."""
    sections = {"tolerances": {"links.wheel.inertia": 0.001}, "measures": {"start": MEASURE}}
    mechanism = Mechanism(**{**wheel(LINEAR).data(), **sections})
    found = trunnion.tolerance(mechanism, methods=("linear", "monte-carlo"), samples=100, jobs=1)
    slope = (starting_time(0.0505) - starting_time(0.0495)) / 0.001
    figure, sensitivity = float(found["nominal"].item()), float(np.ravel(found["sensitivity"])[0])
    assert figure == pytest.approx(starting_time(0.05), rel=1e-7)
    assert sensitivity == pytest.approx(slope, rel=1e-4)
    deviation = float(np.ravel(found["deviation"])[0])
    assert deviation == pytest.approx(float(np.ravel(found["rss"])[0]) / 3, rel=0.3)
    assert float(found["yield_all"]) == 1.0


@pytest.mark.slow
def test_samples_that_do_not_start_are_outside_every_limit():
    """Torques about the drag: half of them do not start."""
    data = wheel({**LINEAR, "stall_effort": 0.6}).data()
    data["tolerances"] = {"drivers.A.motor.stall_effort": {"limits": "±0.3 N m", "distribution": "uniform"}}
    peak = {"peak_effort": "A", "duration": 1.0, "at_most": 5}
    data["measures"] = {"peak": peak, "start": {**MEASURE, "at_most": 100}}
    found = trunnion.tolerance(Mechanism(**data), methods=("monte-carlo",), samples=60, jobs=1)
    shares = found["yield"].values
    assert shares[0] == 1.0
    assert shares[1] < 0.7
