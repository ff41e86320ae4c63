"""Speeds, accelerations, transmission angles, powers and dwells as measures, against closed forms and differences."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from measured import figures
from mechanisms import build, four_bar, slider_crank
from trunnion import Mechanism, MechanismError
from trunnion.algebra.dual import Dual, derivative
from trunnion.cycle.vocabulary import vocabulary
from trunnion.measures.curves import CURVES
from trunnion.measures.measures import Measure, named
from trunnion.model.measure_table import MEASURES
from trunnion.solve.forward import forward
from trunnion.solve.run import Run, prepare
from trunnion.solve.shifts import HOLE

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
R, L, W = 0.3, 1.0, 2.0  # crank and rod, m; drive speed, rad/s


@pytest.fixture(scope="module")
def centric() -> Run:
    """A slider-crank in line that turns counterclockwise."""
    return prepare(build({**slider_crank(R, L, 0.0), "drivers": {"A": {"speed": W}}}))


@pytest.fixture(scope="module")
def spatial() -> Run:
    return prepare(trunnion.read(EXAMPLES / "rssr.yaml"))


def course(run: Run, name: str, time: Any) -> Any:
    """A measure at some times, s."""
    measure = named(run.system.mechanism, [name], run.values)[0]
    back = run.solve(time) if not measure.of_motion else run.walk(time)
    return np.broadcast_to(measure.curve(back)[0], np.shape(time))


def test_every_kind_has_a_course() -> None:
    assert list(CURVES) == [kind for kind in MEASURES if kind != "expression"]


# ---- the slider-crank -----------------------------------------------------------------------------------------


def test_speeds_of_the_slider_crank(centric: Run) -> None:
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


def test_strokes_along_directions(centric: Run) -> None:
    """Twice the crank along the guide; across it none; of the crank pin in any direction."""
    asked = [
        Measure("slide", "stroke", "C"),
        Measure("along", "point", "piston.P", statistic="peak-to-peak", along=(3.0, 0.0)),
        Measure("across", "point", "piston.P", statistic="peak-to-peak", along=(0.0, 1.0)),
        Measure("pin", "point", "crank.B", statistic="peak-to-peak", along=(1.0, 2.0)),
    ]
    found = figures(centric, asked, 180)
    np.testing.assert_allclose(list(found.values()), [2 * R, 2 * R, 0.0, 2 * R], atol=1e-12)


def test_figures_of_the_speed(centric: Run) -> None:
    """The crank pin goes round at r ω: its components have that amplitude, its root mean square is r ω/√2."""
    of = {"kind": "velocity", "subject": "crank.B", "axis": "x"}
    asked = [
        Measure(one, **of, statistic=one)  # type: ignore[arg-type]
        for one in ("maximum", "minimum", "peak-to-peak", "mean", "rms", "largest", "place-of-maximum")
    ]
    found = figures(centric, asked, 180)
    v = R * W
    np.testing.assert_allclose(list(found.values())[:-1], [v, -v, 2 * v, 0.0, v / np.sqrt(2), v], atol=1e-11)
    assert found["place-of-maximum"] % (2 * np.pi) == pytest.approx(1.5 * np.pi, abs=1e-9)


def test_dwell_within_a_band(centric: Run) -> None:
    """r cos θ is above c for arccos(c/r)/π of the time; with its derivative by r."""
    band = Measure("dwell", "point", "crank.B", "x", statistic="dwell", within=(0.1, 1.0))
    steps = {90: 2e-6, 360: 1e-8}
    for count, close in steps.items():
        assert figures(centric, [band], count)["dwell"] == pytest.approx(np.arccos(0.1 / R) / np.pi, abs=close)
    changed = figures(centric, [band], 360, {"links.crank.points.B.x": Dual(R, 1.0)})["dwell"]
    expected = 0.1 / (R * np.pi * np.sqrt(R**2 - 0.01))
    assert float(np.ravel(derivative(changed))[0]) == pytest.approx(expected, rel=1e-6)
    part = Measure("part", "point", "crank.B", "x", statistic="dwell", within=(0.0, 1.0), over=(0.0, np.pi))
    assert figures(centric, [part], 360)["part"] == pytest.approx(0.5, abs=1e-8)
    assert band.figure_unit(centric.system, centric.values) == "1"


# ---- the four-bar ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_transmission_angle_by_the_law_of_cosines(side: float) -> None:
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


@pytest.mark.slow
def test_powers_and_energy_of_friction() -> None:
    """Power of driver and loads, power and energy lost, against the books of `analyse`."""
    mechanism = trunnion.read(EXAMPLES / "toleranced-slider-crank.yaml")
    run, result = prepare(mechanism), trunnion.analyse(mechanism, 24)
    time = result["time"].values
    np.testing.assert_allclose(course(run, "power:O", time), result["drive_power"].sel(driver="O"), rtol=1e-12)
    names = [str(joint) for joint in result["joint"].values]
    asked = [
        *(Measure(joint, "friction_energy", joint) for joint in names),
        Measure("driven", "power", "O", statistic="mean"),
    ]
    found, energies = figures(run, asked, 24), {}
    for joint in result["joint"].values:
        lost = course(run, f"friction_power:{joint}", time)
        np.testing.assert_allclose(lost, result["friction_power"].sel(joint=joint), rtol=1e-12)
        energy = found[str(joint)]
        mean = float(result["friction_power_mean"].sel(joint=joint))
        # A measure goes by fixed nodes, `analyse` by nodes that are added: they part where the guide changes its side.
        assert energy == pytest.approx(mean * run.cycle.duration, rel=5e-4 if joint == "S" else 1e-6)
        energies[joint] = energy
    # Over a whole cycle all that the driver gives is lost to friction: nothing else takes power here.
    driven = found["driven"] * run.cycle.duration
    assert sum(energies.values()) == pytest.approx(driven, rel=1e-12)
    parts = [
        figures(run, [Measure("part", "friction_energy", "O", over=over)], 720)["part"]
        for over in ((0.0, np.pi), (np.pi, 2 * np.pi))
    ]
    whole = figures(run, [Measure("energy", "friction_energy", "O")], 24)["energy"]
    assert sum(parts) == pytest.approx(whole, rel=1e-4)


# ---- in space -------------------------------------------------------------------------------------------------


def slope(run: Run, name: str, time: Any, step: float = 1e-5) -> Any:
    return (course(run, name, time + step) - course(run, name, time - step)) / (2 * step)


@pytest.mark.slow
def test_speeds_in_space_by_differences(spatial: Run) -> None:
    mechanism, time = spatial.system.mechanism, np.linspace(0.01, 0.15, 7)
    points = [f"{link}.{point}" for link, names in mechanism.points.items() for point in names]
    for point in points:
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
        moving = next(link for link in spatial.system.joints[joint][1] if link != mechanism.fixed_link)
        np.testing.assert_allclose(course(spatial, f"angular_velocity:{moving}", time), np.abs(rate), rtol=1e-12)
        size = course(spatial, f"angular_acceleration:{moving}", time)
        np.testing.assert_allclose(size, np.abs(second), rtol=1e-9, atol=1e-9)
    with pytest.raises(MechanismError):
        course(spatial, "transmission_angle:A", time)


# ---- in the verbs ---------------------------------------------------------------------------------------------


def measured_model() -> Mechanism:
    data = trunnion.read(EXAMPLES / "fourbar-with-play.yaml").data()
    data["measures"] = {
        "speed": {"velocity": "rocker.C", "limit": "1 m/s"},
        "mu": {"transmission_angle": "C", "as": "minimum"},
        "swing": {"stroke": "D"},
        "off": {"path_error": "rocker.C"},
        "rest": {"rotation": "D", "as": "dwell", "within": ["100 deg", "120 deg"]},
    }
    return Mechanism(**data).with_seats("free")


def test_the_models_measures_in_the_result_of_a_cycle(tmp_path: Path) -> None:
    mechanism = measured_model()
    result = trunnion.analyse(mechanism, 36)
    assert list(result["measure"].values) == ["speed", "mu", "swing", "rest"]
    assert result["measure_figure_unit"].values.tolist() == ["m/s", "rad", "rad", "1"]
    speed = np.sqrt((result["point_velocity"].sel(point="rocker.C") ** 2).sum("axis"))
    np.testing.assert_allclose(result["measure_value"].sel(measure="speed"), speed, rtol=1e-12)
    rotation = result["joint_rotation"].sel(joint="D")
    np.testing.assert_allclose(result["measure_value"].sel(measure="rest"), rotation, rtol=1e-12)
    measures = named(mechanism, ["mu", "swing", "rest"], prepare(mechanism).values)
    # of polynomials through so many positions
    expected = figures(prepare(mechanism), measures, 1440)
    np.testing.assert_allclose(result["measure_figure"].values[1:], list(expected.values()), rtol=1e-9)
    labels = [row["label"] for row in json.loads(result.attrs["summary"])]
    assert [one for one in labels if "speed" in one and "measure" in one] == [
        "measure speed, minimum",
        "measure speed, maximum",
    ]
    left = [one for one in json.loads(result.attrs["findings"]) if one["where"] == "measures.off"]
    assert [one["severity"] for one in left] == ["note"]
    trunnion.save(result, tmp_path / "cycle.csv")
    head, *rows = [line.split(",") for line in (tmp_path / "cycle.csv").read_text("utf-8").splitlines()]
    assert head[-4:] == ["status", "speed", "mu", "rest"]  # a stroke is of no position
    np.testing.assert_allclose([float(row[-3]) for row in rows], speed, rtol=1e-6)


def test_play_of_a_speed() -> None:
    """By derivatives of the whole motion, against differences with a pin moved in its hole."""
    mechanism = measured_model()
    data = mechanism.data()
    on_hole = {name: joint | {"seat_on": joint["links"][1]} for name, joint in data["joints"].items()}
    mechanism = Mechanism(**{**data, "joints": on_hole})
    result = trunnion.play(mechanism, ["speed", "rate:D"], steps=12)
    run = prepare(mechanism)
    for row, name in enumerate(("speed", "rate:D")):
        measure = named(mechanism, [name], run.values)[0]
        one = result["sensitivity"].isel(measure=row)
        for joint in result["joint"].values:
            for axis in "xy":
                ends = [
                    measure.curve(
                        forward(
                            run.system,
                            {**run.values, f"{HOLE}.{joint}.1.{axis}": sign * 1e-7},
                            run.chosen.assembly,
                            result["time"].values,
                        )
                    )[0]
                    for sign in (1, -1)
                ]
                expected = np.broadcast_to((ends[0] - ends[1]) / 2e-7, 12)
                found = one.sel(joint=joint, end="1", axis=axis).values
                np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5)


@pytest.mark.spread(2)
@pytest.mark.parametrize("example", ["toleranced-slider-crank", "toleranced-rssr", "fourbar-with-play", "sarrus"])
def test_everything_that_is_listed_can_be_asked_for(example: str) -> None:
    """Names mean the numbers they stand for; measures can be named, and have the units and values that are told."""
    mechanism = trunnion.read(EXAMPLES / f"{example}.yaml")
    found = vocabulary(mechanism, 24)
    values, run = mechanism.parameters(), prepare(mechanism)
    assert {one.path for one in found.numbers} == set(mechanism.parameter_kinds())
    for number in found.numbers:
        assert mechanism.path_of(number.name) == number.path
        assert number.value == pytest.approx(values[number.path])
    measures = named(mechanism, [one.name for one in found.measures], run.values)
    for measure, told in zip(measures, found.measures, strict=True):
        assert measure.figure_unit(run.system, run.values) == told.unit
        assert ("sweep" in told.verbs) == (
            measure.rule != "deviation" and not measure.of.against and not measure.of_attitude(run.system)
        )
    json.dumps(found.data(), allow_nan=False)
