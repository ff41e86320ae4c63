"""What is no more than rounding is 0 in every figure, has no place and makes no finding, however large all is."""

from itertools import cycle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import trunnion
from brief import brief
from mechanisms import DURANGO, in_units, model, slider_crank, transformed
from mechanisms_parts import bare, joined
from mechanisms_space import rssr
from trunnion import Mechanism
from trunnion.results.dataset import Scales, without_noise

SIZES = [(1.0, 1.0), (1e-6, 1e-6), (1e6, 1e6), (1e-6, 1e6), (1e6, 1e-6)]


def sized(data, length, force):
    """A model with all its lengths and forces so many times as large, at the same angular speeds."""
    return in_units(data, length, force / length)


def balanced(space="planar"):
    """A massless mechanism whose loads cancel but for rounding, rocked back and forth by its driver."""
    moments = {"a": 0.3, "b": -0.1, "c": -0.2}
    if space == "spatial":
        data, link = rssr(friction=0.1).data, "rocker"
        moments = {name: [0.0, 0.0, moment] for name, moment in moments.items()}
    else:
        data, link = transformed(model(slider_crank(offset=0.0), friction=0.1), 0.3), "rod"
    loads = {name: {"link": link, "moment": moment} for name, moment in moments.items()}
    data["drivers"] = {"A": {"law": "harmonic", "mean": 1.0, "amplitude": 0.4, "period": 1.0}}
    return {**bare(data), "gravity": [0.0] * len(data["gravity"]), "loads": loads}


def parallel():
    """A parallelogram, of which neither the coupler turns nor the distance of its pins changes."""
    return {
        "gravity": [0, -9.81],
        "links": {
            "ground": {"points": {"A": [0, 0], "D": [0.1, 0.07]}},
            "crank": {"points": {"A": [0, 0], "B": [0.03, 0]}},
            "coupler": {"points": {"B": [0, 0], "C": [0.1, 0.07]}, "mass": 1.0},
            "rocker": {"points": {"D": [0, 0], "C": [0.03, 0]}},
        },
        "joints": joined("ground -A- crank -B- coupler -C- rocker, ground -D- rocker"),
        "joint_defaults": {"pin": {"radius": 0.005}, "friction": 0.1},
        "drivers": {"A": {"speed": 2.0, "range": [1.0, 3.0]}},
        "assembly": {"C": [0.1162, 0.0952]},
        "measures": {
            "tilt": {"angle": "coupler", "as": "peak-to-peak"},
            "turn": {"angular_velocity": "coupler", "as": "maximum"},
        },
    }  # fmt: skip


@pytest.mark.spread(2)
@pytest.mark.parametrize(("space", "size"), [*zip(cycle(("spatial", "planar")), SIZES, strict=False)])
def test_forces_that_cancel_are_0_everywhere_and_no_finding(space, size):
    result = trunnion.analyse(Mechanism(**sized(balanced(space), *size)), 24)
    for one in result.trunnion.summary:
        if one.unit in ("N", "N m", "W"):
            assert one.value == 0, one
            assert one.place in ("", "everywhere"), one
    codes = [one.code for one in result.trunnion.findings]
    assert not [code for code in codes if code.startswith(("friction.", "effort."))]


@pytest.mark.parametrize("space", ["planar", "spatial"])
def test_forces_that_cancel_leave_rounding(space):
    """Else the test above would show nothing."""
    assert np.any(brief(Mechanism(**balanced(space)), 24)["drive_effort"].values != 0)


@pytest.mark.parametrize(("length", "force"), SIZES)
def test_a_measure_that_does_not_move_is_0(length, force):
    result = trunnion.analyse(Mechanism(**sized(parallel(), length, force)), 24)
    figures = {one.name: one.value for one in result.trunnion.summary}
    assert figures["tilt"] == figures["turn"] == 0
    assert without_noise(result)["link_angle_velocity"].sel(link="coupler").values.tolist() == [0.0] * 24


@pytest.mark.parametrize(("length", "force"), SIZES)
def test_what_is_constant_has_no_place(length, force):
    """A gear pair whose torque, friction and margin are the same all the way round."""
    data = {
        "gravity": [0, 0],
        "links": {"ground": {"points": {"A": [0, 0], "B": [0.06, 0]}}, "one": {"points": {"A": [0, 0]}},
                  "two": {"points": {"B": [0, 0]}}},
        "joints": joined("ground -A- one, ground -B- two"),
        "gears": {"G": {"joints": ["A", "B"], "ratio": -1.0}},
        "joint_defaults": {"pin": {"radius": 0.02}, "friction": 0.5},
        "drivers": {"A": {"speed": 1.0}},
        "loads": {"pump": {"link": "two", "moment": 5.0, "useful": True}},
    }  # fmt: skip
    mechanism = Mechanism(**sized(data, length, force))
    placed = {one.name: one.place for one in trunnion.analyse(mechanism, 31).trunnion.summary if one.place}
    assert {"A.effort_min", "B.reaction_max", "locking_margin", "B.critical_coefficient"} <= placed.keys()
    assert set(placed.values()) == {"everywhere"}


@pytest.mark.parametrize(("length", "force"), SIZES)
def test_largest_errors_are_where_they_are_of_any_size(length, force):
    """A pin that lies on one side of a play of a ten thousandth."""

    def largest(length, force):
        data = model(slider_crank(offset=0.0), friction=0.1)
        data["joints"]["B"] |= {"pin": {"radius": 0.005, "clearance": 1e-5}, "seat": {"xi": 0.5}}
        summary = trunnion.analyse(Mechanism(**sized(data, length, force)), 12).trunnion.summary
        return {
            item.name: (item.value, item.place) for item in summary if "error_max" in item.name or "change" in item.name
        }

    expected, units = largest(1.0, 1.0), {"point_error_max": length, "A.effort_change_max": force * length}
    assert len(expected) == 3
    for name, (value, place) in largest(length, force).items():
        assert place == expected[name][1]
        assert value == pytest.approx(expected[name][0] * units.get(name, length), rel=1e-9)


def test_joints_in_one_point_have_loads_and_losses():
    """The pins of a Cardan joint lie in one point, whose places are nothing but rounding."""
    axis, across = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]
    out = [float(np.cos(0.35)), float(np.sin(0.35)), 0.0]
    middle = [0.0, 0.0, 0.0]
    data = {
        "space": "spatial", "gravity": middle, "over_constraint": "minimum-norm",
        "links": {
            "ground": {"points": {"A": {"at": middle, "axis": axis, "x": across},
                                  "C": {"at": middle, "axis": out, "x": [0, 0, 1]}}},
            "input": {"points": {"A": {"at": middle, "axis": axis, "x": across}, "K": {"at": middle, "axis": across}}},
            "output": {"points": {"C": {"at": middle, "axis": axis, "x": [0, 0, 1]},
                                  "K": {"at": middle, "axis": [0, 0, 1]}}},
        },
        "joints": joined("ground -A- input, ground -C:cylindrical- output, input -K:universal- output"),
        "joint_defaults": {"pin": {"radius": 0.006, "bearing": 0.04}, "friction": 0.15},
        "drivers": {"A": {"speed": 10.0}}, "loads": {"brake": {"joint": "C", "resisting_torque": 10, "useful": True}},
        "assembly": {"C": 0},
    }  # fmt: skip
    result = trunnion.analyse(Mechanism(**data), 90)
    figures = {each.name: each.value for each in result.trunnion.summary}
    useful = 10 * 10  # W, of a brake that turns as fast as the driver on average
    assert figures["friction_power_mean"] == pytest.approx(useful / figures["efficiency"] - useful, rel=1e-6)
    assert figures["K.end_load_max"] == pytest.approx(figures["K.reaction_moment_max"] / 0.04, rel=0.01)


def test_a_sweep_tells_its_scales():
    swept = trunnion.sweep(Mechanism(**balanced()), {"joint_defaults.friction.coefficient": [0.1, 0.2]}, steps=12)
    assert np.all(without_noise(swept)["drive_effort_max"].values == 0)


@given(st.floats(1e-9, 1e9), st.floats(1e-6, 1e6), st.floats(1e-9, 1e9))
def test_a_floor_follows_the_dimension_of_its_unit(length, rate, force):
    floor, unit = Scales(length, rate, force).floor, Scales(1.0, 1.0, 1.0).floor("1")
    made = {"m": length, "mm": 1e3 * length, "1/s": rate, "rad/s": rate, "m/s^2": length * rate**2, "N": force,
            "N m": force * length, "W": force * length * rate, "kg m^2": force * length / rate**2,
            "rad": 1.0, "1": 1.0, "": 1.0}  # fmt: skip
    for name, size in made.items():
        if name != "1/s":
            assert floor(name) == pytest.approx(unit * size, rel=1e-9)
    assert np.isnan(floor("of its RMS"))
    assert Scales(length, 1e160, force).floor("m/s^2") == 0.0  # the rate squared is no number


def test_a_speed_near_the_end_of_the_floats_has_an_answer():
    """What has no finite force is not a number or infinite; nothing is divided by a scale that is 0."""
    data = trunnion.read(DURANGO).data()
    data["drivers"]["A"] = {"speed": 1e301}
    assert np.all(np.isfinite(trunnion.analyse(trunnion.Mechanism(**data), 6)["point_position"]))
