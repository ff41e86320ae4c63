"""Measures that are expressions of others: their courses, figures, derivatives, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trunnion
from mechanisms import four_bar
from trunnion import Mechanism, MechanismError
from trunnion.measures.evaluation import NumpyKernel
from trunnion.measures.measures import named
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare
from trunnion.studies.tolerance.kernel import kernel_of

LINKS = {"links": {**four_bar()["links"]}, "dimensions": {"ab": "0.3 m"}}
LINKS["links"] = {
    **LINKS["links"],
    "crank": {"points": {"A": [0, 0], "B": ["ab", 0]}, "mass": 1.0, "centre": ["ab/2", 0], "inertia": 0.1},
}


def model(more: dict[str, Any] | None = None, **measures: Any) -> Mechanism:
    """A crank and rocker without friction, and its measures."""
    return Mechanism(**{**four_bar(), **LINKS, **(more or {}), "measures": measures})


def test_a_lead_is_the_difference_of_angles_without_jumps() -> None:
    found = trunnion.analyse(model(input={"rotation": "A"}, lead="input - D.rotation"), steps=48)
    angles = (np.unwrap(found.joint_rotation.sel(joint=joint).values) for joint in "AD")
    lead = np.subtract(*angles)
    values = found.measure_value.sel(measure="lead").values
    assert values - values[0] == pytest.approx(lead - lead[0], abs=1e-12)


def test_figures_of_an_expression_do_not_depend_on_the_steps() -> None:
    """Half the difference of input and output over a range of it: least and largest of the same course, finely."""
    own = {"input": "A.rotation", "half": {"expression": "(input - D.rotation) / 2", "as": "maximum",
                                           "over": ["60 deg", "200 deg"]}}  # fmt: skip
    few, many = (trunnion.analyse(model(**own), steps=steps) for steps in (7, 7200))
    figures = [float(found.measure_figure.sel(measure="half")) for found in (few, many)]
    assert figures[0] == pytest.approx(figures[1], abs=1e-12)
    turned = many.joint_rotation.sel(joint="A").values
    inside = (turned >= np.radians(60)) & (turned <= np.radians(200))
    course = (turned - np.unwrap(many.joint_rotation.sel(joint="D").values))[inside] / 2
    assert figures[0] == pytest.approx(np.max(course), abs=1e-6)


def test_error_of_a_universal_joint_against_even_rotation() -> None:
    """θ₂ − θ₁ of a Cardan joint bent by β swings between ±arctan((1 − cos β)/(2 √cos β)).

    Source: F. Duditza, Kardangelenkgetriebe und ihre Anwendungen, 1973.
    """
    bare = trunnion.read("examples/universal-joint.yaml").data()
    found = trunnion.analyse(Mechanism(**{**bare, "measures": EVEN}), steps=4)
    bend = float(np.radians(30.0))
    swing = 2 * np.arctan((1 - np.cos(bend)) / (2 * np.sqrt(np.cos(bend))))
    assert float(found.measure_figure.sel(measure="error")) == pytest.approx(swing, rel=1e-9)


def test_leverage_is_the_ratio_of_speeds_without_friction() -> None:
    """Power in is power out: effort over the load's torque is the output's speed over the input's."""
    still = {"links": {name: {"points": link["points"]} for name, link in four_bar()["links"].items()}}
    load = {"loads": {"brake": {"joint": "D", "resisting_torque": "3 N m"}}}
    leverage = {"leverage": "A.effort / (3 N m)", "speed": {"rate": "D"}, "ratio": "speed / (4 rad/s)"}
    found = trunnion.analyse(model({**still, **load}, **leverage), steps=60)
    values = found.measure_value
    ratio = np.abs(values.sel(measure="ratio").values)
    assert values.sel(measure="leverage").values == pytest.approx(ratio, abs=1e-10)


def test_derivatives_are_those_of_differences() -> None:
    own = {"lead": "B.rotation - 2 * D.rotation", "torque": {"effort": "A"}, "mixed": "lead * torque / ab"}
    mechanism = model(**own)
    run = prepare(mechanism)
    measures = named(mechanism, ["lead", "mixed"], run.values)
    from trunnion.algebra.dual import Dual

    kernel, time = NumpyKernel(run, measures, FrictionMethod()), np.linspace(0.1, 1.4, 7)

    def at(ab: Any) -> Any:
        return kernel.courses(mechanism.parameters({"dimensions.ab": ab}), time)[0]

    exact, above, below = at(Dual(0.3, 1.0)), at(0.3 + 1e-6), at(0.3 - 1e-6)
    for measure in measures:
        slope = (above[measure.name][0] - below[measure.name][0]) / 2e-6
        assert exact[measure.name][0].dual == pytest.approx(slope, rel=1e-6, abs=1e-6)


def test_both_engines_agree() -> None:
    mechanism = model(lead="A.rotation - D.rotation", twice="2 * lead", ratio="A.effort / (1 N m) + sqrt(ab / (1 m))")
    run = prepare(mechanism)
    measures, method = named(mechanism, ["lead", "twice", "ratio"], run.values), FrictionMethod()
    values = mechanism.parameters({"dimensions.ab": np.array([[0.29], [0.3], [0.31]])})
    time = np.broadcast_to(np.linspace(0.0, 1.5, 9), (3, 9))
    one, other = (kernel_of(engine, run, measures, method).courses(values, time)[0] for engine in ("numpy", "compiled"))
    for measure in measures:
        assert one[measure.name][0] == pytest.approx(other[measure.name][0], abs=1e-9)


def test_a_sweep_and_a_tolerance_know_them() -> None:
    own = {"lead": {"expression": "A.rotation - D.rotation", "as": "maximum", "over": ["60 deg", "200 deg"]}}
    toleranced = model({"tolerances": {"ab": {"limits": "±1 mm"}}}, **own)
    swept = trunnion.sweep(toleranced, over={"ab": np.array([0.299, 0.301])}, measures=["lead"])
    ends = [
        float(trunnion.analyse(toleranced.with_values({"ab": ab}), steps=4).measure_figure[0]) for ab in (0.299, 0.301)
    ]
    assert swept["lead"].values == pytest.approx(ends, abs=1e-11)
    found = trunnion.tolerance(toleranced, methods=("linear",), steps=36).isel(measure=0)
    assert 2 * float(found.worst_case_upper) == pytest.approx(abs(ends[1] - ends[0]), rel=1e-3)


def test_an_expression_that_is_its_own_circle_or_means_nothing_is_a_finding() -> None:
    for text, says in [
        ("input - nothing", "nothing"), ("2 * lead", "itself"), ("input +", "cannot be read"), ("ab / 2", "never"),
        ("input - ab", "added"), ("high - low", "one number"), ("X.rotation", "joint 'X'"), ("rocker.Q.x", "point"),
        ("swing + input", "place or over a range"), ("__import__('os')", ""), ("input.rotation.rotation.x", ""),
        ("", ""),
    ]:  # fmt: skip
        own = {
            "input": "A.rotation", "lead": text, "high": {"stroke": "D"}, "low": {"stroke": "D"},
            "swing": {"expression": "input", "as": "maximum"},
        }  # fmt: skip
        with pytest.raises(MechanismError) as error:
            model(**own)
        assert all(one.where.startswith("measures.lead") for one in error.value.findings), text
        assert says in str(error.value), text


def test_two_that_speak_of_each_other_are_a_circle() -> None:
    with pytest.raises(MechanismError, match="itself"):
        model(one="2 * other", other="one / 2")


EVEN = {"error": {"expression": "output.rotation - input.rotation", "as": "peak-to-peak"}}


def test_the_inclination_of_a_rod_in_space() -> None:
    """Camber: asin of the rise of a rod over its length, at its largest, against the table of points finely."""
    data = trunnion.read("examples/rssr.yaml").data()
    camber = {"expression": "asin((rocker.C.z - crank.B.z) / b)", "as": "maximum"}
    found = trunnion.analyse(Mechanism(**{**data, "measures": {"camber": camber}}), steps=3600)
    ends = (found.point_position.sel(point=point, axis="z").values for point in ("rocker.C", "crank.B"))
    course = np.arcsin(np.subtract(*ends) / 0.12)
    assert float(found.measure_figure[0]) == pytest.approx(float(np.max(course)), abs=1e-7)
