"""A sweep is so many analyses: every point equals one, measures too, and what has no answer has no figures."""

import itertools
import json
import math

import numpy as np
import pytest

import trunnion
from manual.conftest import Run, program  # noqa: F401
from mechanisms_parts import EXAMPLES, example
from trunnion import Mechanism, MechanismError, Status
from trunnion.solve.friction_method import FrictionMethod
from trunnion.studies.sweep import Points
from trunnion.studies.sweep_grid import FIGURES
from trunnion.studies.sweep_grid import grid as grid_of

CARDAN = EXAMPLES / "pezzuti-cardan.yaml"
STEPS = 24


def expected(result):
    """The figures of one cycle, from the definitions and the Dataset of `analyse`."""
    status = result["status"].values
    kept = np.flatnonzero(status == Status.SOLVED)
    kept = kept if kept.size else np.flatnonzero(status == Status.ZERO_SLIP)
    effort = result["drive_effort"].values
    size = np.sqrt((result["reaction_force"].values ** 2).sum(axis=1))
    told = {one.name: one.value for one in result.trunnion.summary}

    def most(part, key, own):
        """What the summary has, between positions and beside jumps too: no less than at positions but for rounding."""
        found = np.array(
            [told.get(f"{name}.{key}", value) for name, value in zip(result[part].values, own, strict=True)]
        )
        slack = 1e-9 * np.max(np.abs(own))
        assert np.all(found <= own + slack if key == "effort_min" else found >= own - slack)
        return found

    return {
        **{key: float(result[key]) for key in ("efficiency", "efficiency_error", "drive_power_mean")},
        "useful_power_mean": float(result["useful_power_mean"]),
        "drive_effort_min": most("driver", "effort_min", effort[:, kept].min(axis=1)),
        "drive_effort_max": most("driver", "effort_max", effort[:, kept].max(axis=1)),
        "drive_effort_rms": result["drive_effort_rms"].values,
        "reaction_max": most("joint", "reaction_max", size[:, kept].max(axis=1)),
        "locking_margin": float(result["locking_margin"].min()),
        "without_answer": 0,
        "status": int(status.max()),
    }


@pytest.mark.spread(2)
@pytest.mark.parametrize(
    ("model", "name", "text"),
    [
        ("durango-fourbar", "AB", "2.1 m"),
        ("slider-crank", "O.speed", "1234.5 rpm"),
        ("pezzuti-cardan", "misalignment", "17 deg"),
        ("rssr", "joint_defaults.friction.coefficient", "0.07"),
        ("five-bar-robot", "arm", "260 mm"),  # two drivers
        ("inverted-slider-crank", "post", "1.02 * 1 m"),  # a range, driven by a slide
    ],
)
def test_a_point_equals_the_analysis_to_the_bit(model, name, text):
    mechanism = example(model)
    if model == "inverted-slider-crank":
        text = f"1.02 * ({mechanism.dimensions['post'].source})"
    one = trunnion.analyse(mechanism.with_values({name: text}), STEPS)
    swept = trunnion.sweep(mechanism, {name: [text]}, STEPS, margin=True)
    assert set(swept.data_vars) == {name for name, one in FIGURES.items() if one.part != "errors"}
    for key, value in expected(one).items():
        assert np.array_equal(swept[key].values[..., 0], value, equal_nan=True), key
    lost = float(one["friction_power_mean"].sum())
    assert swept["friction_power_mean"].values[..., 0] == pytest.approx(lost, rel=1e-12, abs=1e-12)
    for end in ("min", "max", "rms"):
        assert swept[f"drive_effort_{end}"].attrs["units"] == one["drive_effort"].attrs["units"]


def test_two_names_are_a_grid():
    """Dimensions in the order of the names, last; every point is that of the two values."""
    mechanism = example("durango-fourbar")
    lengths, coefficients = ["1.6 m", "2 m", "2.2 m"], [0.1, 0.3]
    seen = []
    grid = trunnion.sweep(
        mechanism, {"AB": lengths, "B.friction.coefficient": coefficients}, STEPS, progress=seen.append, margin=True
    )
    assert seen == [1, 2, 3, 4, 5, 6]
    assert grid["efficiency"].dims == ("AB", "B.friction.coefficient")
    assert grid["reaction_max"].dims == ("joint", "AB", "B.friction.coefficient")
    picked = grid["efficiency"].sel({"AB": 2.0, "B.friction.coefficient": 0.3})
    assert float(picked) == float(grid["efficiency"][1, 1]), "points are picked by their values"
    for (i, length), (k, coefficient) in itertools.product(enumerate(lengths), enumerate(coefficients)):
        one = trunnion.analyse(mechanism.with_values({"AB": length, "B.friction.coefficient": coefficient}), STEPS)
        for key, value in expected(one).items():
            found = grid[key].values[..., i, k]
            apart = 1e-10 if key == "efficiency_error" else 0.0  # itself an estimate, of last coefficients
            np.testing.assert_allclose(found, value, rtol=1e-9, atol=apart, err_msg=f"{key} {length} {coefficient}")


@pytest.mark.parametrize("steps", [9, 48])  # each point by itself, and in one pass
def test_a_locking_margin_does_not_depend_on_steps(steps):
    """The least over the cycle, as `analyse` has it of a mechanism with the point's number."""
    mechanism, arms = example("elliptic-trammel"), ["80 mm", "95 mm"]
    swept = trunnion.sweep(mechanism, {"a": arms}, steps, margin=True)
    for arm, margin in zip(arms, swept["locking_margin"].values, strict=True):
        summary = trunnion.analyse(mechanism.with_values({"a": arm}), 360).trunnion.summary
        assert [margin] == pytest.approx([row.value for row in summary if row.name == "locking_margin"], rel=1e-6)


# of every kind: dyads, class III, Newton in space, closed form in space; with points that lock or cannot be assembled
TOGETHER = {
    "durango-fourbar": {"AB": ["1.6 m", "2.6 m", "2.2 m"], "joint_defaults.friction.coefficient": [0.0, 0.3, 2.0]},
    "slider-crank": {"r": ["40 mm", "50 mm"], "O.speed": [50, 100], "P.friction.coefficient": [0, 0.1]},
    "jansen": {"dimensions.a": ["37 cm", "38 cm"]},
    "toggle-press": {"L": ["200 mm", "203 mm"]},
    "rssr": {"a": ["30 mm", "31 mm"], "A.speed": [10, 20]},
    "pezzuti-cardan": {"misalignment": ["5 deg", "25 deg"], "bearing": ["15 mm", "40 mm"]},
    "five-bar-robot": {"arm": ["250 mm", "260 mm"]},
}


@pytest.mark.slow
@pytest.mark.parametrize("model", TOGETHER)
def test_points_solved_together_equal_points_solved_alone(model, monkeypatch):
    """Statuses exactly, figures but for the rounding of the friction iteration."""
    mechanism, over = example(model), TOGETHER[model]
    points = Points(mechanism, grid_of(mechanism, over), STEPS, FrictionMethod())
    assert points._similar
    assert any(found is not None for found in points._together(list(np.ndindex(points.shape))))
    both = trunnion.sweep(mechanism, over, STEPS)
    monkeypatch.setattr(Points, "_similar", False)
    alone = trunnion.sweep(mechanism, over, STEPS)
    assert np.array_equal(both["status"], alone["status"])
    assert set(both.data_vars) == set(alone.data_vars)
    power = float(alone["drive_effort_rms"].max()) * 1e-9
    for name, values in alone.data_vars.items():
        np.testing.assert_allclose(both[name].values, values.values, rtol=1e-9, atol=power, err_msg=str(name))


def test_errors_of_points_solved_together():
    """Errors without seats go through one pass as well: beside the ideal mechanism, point by point as `analyse`."""
    data = example("slider-crank").data()
    data["errors"] = {"r": "0.05 mm"}
    mechanism = Mechanism(**data)
    swept = trunnion.sweep(mechanism, {"r": ["40 mm", "50 mm"], "errors.dimensions.r": ["0 mm", "0.1 mm"]}, STEPS)
    assert np.all(swept["transmission_error_max"].values[..., 0] == 0)
    one = trunnion.analyse(mechanism.with_values({"r": "50 mm", "errors.dimensions.r": "0.1 mm"}), STEPS)
    for key in ("efficiency", "efficiency_ideal"):
        np.testing.assert_allclose(swept[key].values[1, 1], float(one[key]), rtol=1e-12)
    (error,) = (row.value for row in one.trunnion.summary if row.name == "S.slide_error_max")
    kept = one["status"].values == Status.SOLVED
    assert error >= np.abs(one["joint_slide_error"].sel(joint="S").values[kept]).max()
    np.testing.assert_allclose(float(swept["transmission_error_max"].sel(joint="S")[1, 1]), error, rtol=1e-9)


# what cannot be answered, what cannot be asked
def test_points_that_cannot_be_assembled_have_no_figures():
    swept = trunnion.sweep(example("durango-fourbar"), {"AB": ["2.1 m", "2.6 m", "2.2 m"]}, 72, margin=True)
    assert swept["status"].values.tolist()[1] == Status.NOT_ASSEMBLED
    assert int(swept["without_answer"][1]) == 5
    assert np.isfinite(swept["drive_effort_max"].values[0]).tolist() == [True, False, True]
    assert np.isnan(swept["locking_margin"][1])
    said = [row for row in json.loads(swept.attrs["findings"]) if row["severity"] == "error"]
    assert len(said) == 1
    assert "1 of 3 points" in said[0]["what"]
    assert "AB = 2.6 m (5 positions" in said[0]["what"]


BAD = {
    "nothing": ({}, "0 names"), "seven names": ({f"n{i}": [1] for i in range(7)}, "7 names"),
    "unknown name": ({"AX": [1, 2]}, "known: 'AB', 'BC'"),
    "several numbers": ({"coefficient": [0.1, 0.2]}, "say which"),
    "not one number": ({"joints.B.pin": [0.1]}, "is no number, but has one"),
    "the same twice": ({"AB": [2], "dimensions.AB": [2]}, "same number"),
    "wrong unit": ({"A.speed": ["1 kg", "2 kg"]}, "angular speed"),
    "one end without unit": ({"AB": (1, "2000 mm", 3)}, "1 has no unit"), "no values": ({"AB": []}, "no values"),
    "a text": ({"AB": "2 m"}, "no list"), "no count": ({"AB": (1, 2)}, "from, to and count"),
    "zero count": ({"AB": (1, 2, 0)}, "a count of 2 or more"),
    "too many together": ({"AB": (1, 2, 1000), "BC": (5, 6, 1000)}, "1,000 × 1,000 points"),
    "not finite": ({"AB": [math.nan]}, "finite"), "impossible": ({"crank.mass": [1.0, -1.0]}, "links.crank.mass"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_swept_is_said(case):
    over, word = BAD[case]
    with pytest.raises(MechanismError) as caught:
        trunnion.sweep(example("durango-fourbar"), over, 4)
    assert word in str(caught.value)


def test_what_is_wrong_at_a_point_says_at_which():
    """Two values that are sound each by itself and impossible together."""
    inertia = {"cross.inertia.xx": [6.0e-6, 4.5e-6], "cross.inertia.zz": [2.0e-6, 5.0e-6]}
    mechanism = trunnion.read(CARDAN).with_friction("off")
    with pytest.raises(MechanismError, match=r"\(at cross\.inertia\.xx = 4\.5e-06 .*, cross\.inertia\.zz = 5e-06 .*\)"):
        trunnion.sweep(mechanism, inertia, 4)


def model(name, measures):
    data = example(name).data()
    return Mechanism(**{**data, "measures": {**data.get("measures", {}), **measures}})


def test_a_point_without_an_answer_has_no_figure():
    mechanism = model("durango-fourbar", {"torque": {"effort": "A", "as": "rms"}})
    result = trunnion.sweep(mechanism, {"AB": ["2 m", "9 m"]}, 24, measures=["torque"])
    assert np.isfinite(result["torque"].values).tolist() == [True, False]


def test_what_cannot_be_swept_says_why():
    mechanism = model("durango-fourbar", {
        "angle": {"rotation": "D"}, "error": {"transmission_error": "D"}, "status": {"stroke": "D"},
    })  # fmt: skip
    with pytest.raises(MechanismError) as caught:
        trunnion.sweep(mechanism, {"AB": [2, 2.1]}, 24, measures=["angle", "error", "status"])
    assert [one.where for one in caught.value.findings] == ["measures.angle", "measures.error", "measures.status"]
    texts = [one.what for one in caught.value.findings]
    assert "every position and none of the cycle" in texts[0]
    assert "a deviation from the nominal mechanism" in texts[1]
    assert "name of a figure of the sweep" in texts[2]


def test_plain_numbers_are_si():
    mechanism = example("slider-crank")
    swept = trunnion.sweep(mechanism, {"O.speed": (50, 100, 3)}, 4)
    assert swept["O.speed"].values.tolist() == [50.0, 75.0, 100.0]
    assert swept["O.speed"].attrs["units"] == "rad/s"
    also = trunnion.sweep(mechanism, {"O.speed": np.array([50, 75, 100])}, 4)
    assert also["O.speed"].equals(swept["O.speed"])
    assert trunnion.sweep(mechanism, {"r": [0.05]}, 4)["r"].attrs["units"] == "m"


def test_a_table_that_closes_at_some_points_alone():
    """Its first point comes again where the period is longer than the points."""
    data = example("durango-fourbar").data()
    points = [["0 s", "150 N m"], ["0.3 s", "200 N m"], ["0.6 s", "150 N m"]]
    data["tables"] = {"f": {"over": "time", "points": points, "period": "0.6 s"}}
    data["loads"]["brake"] = {"link": "rocker", "moment": "-f"}
    mechanism, path, periods = Mechanism(**data), "tables.f.period", ["0.6 s", "0.62 s", "0.7 s"]
    together = trunnion.sweep(mechanism, {path: periods}, steps=90)["drive_effort_rms"].values.ravel()
    each = [trunnion.analyse(mechanism.with_values({path: period}), steps=90) for period in periods]
    np.testing.assert_allclose(together, [float(result["drive_effort_rms"][0]) for result in each], rtol=1e-9)
    assert together[1] != together[0]
