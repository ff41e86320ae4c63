"""Quantities: what a text of a model file is worth, and what is wrong with one that is worth nothing."""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trunnion.algebra.dual import Dual
from trunnion.model.quantity import Quantity
from trunnion.model.units import ANY, KINDS, UnitError

LENGTH, ANGLE, NUMBER = KINDS["length"], KINDS["angle"], KINDS["number"]


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("60 mm", "length", 0.06),
        ("60mm", "length", 0.06),
        ("93.782 mm", "length", 0.093782),
        ("-8.6 mm", "length", -0.0086),
        ("−8.6 mm", "length", -0.0086),
        ("20 um", "length", 20e-6),
        ("20 µm", "length", 20e-6),
        ("20 μm", "length", 20e-6),
        ("1e1 mm", "length", 0.01),
        ("0", "length", 0.0),
        ("30 deg", "angle", math.pi / 6),
        ("30°", "angle", math.pi / 6),
        ("180 deg", "angle", math.pi),
        ("0.152 rad", "angle", 0.152),
        ("pi / 2", "angle", math.pi / 2),
        ("90 deg - 0.1 deg", "angle", math.radians(89.9)),
        ("1500 rpm", "angular speed", 1500 * 2 * math.pi / 60),
        ("2 rev/s", "angular speed", 4 * math.pi),
        ("10 rad/s", "angular speed", 10.0),
        ("10 1/s", "angular speed", 10.0),
        ("10 s^-1", "angular speed", 10.0),
        ("600 mm/min", "speed", 0.01),
        ("9.81 m/s^2", "acceleration", 9.81),
        ("9.81 m/s²", "acceleration", 9.81),
        ("9.81 m·s⁻²", "acceleration", 9.81),
        ("-1 kN", "force", -1000.0),
        ("10 N m", "moment", 10.0),
        ("10 N*m/rad", "moment", 10.0),
        ("10 N·mm", "moment", 0.01),
        ("48.80 kg m^2", "moment of inertia", 48.8),
        ("48.80 kg*m**2", "moment of inertia", 48.8),
        ("4.8 kg", "mass", 4.8),
        ("450 g", "mass", 0.45),
        ("5 %", "number", 0.05),
        ("5%", "number", 0.05),
        ("2 * (3 mm + 1 cm)", "length", 0.026),
        ("3 mm * 2^2", "length", 0.012),
        ("max(1 mm, 2 mm, 3 mm)", "length", 0.003),
        ("hypot(3 mm, 4 mm)", "length", 0.005),
        ("sqrt(16 mm^2)", "length", 0.004),
        ("atan2(1 mm, 1 mm)", "angle", math.pi / 4),
        ("2 m*cos(60 deg)", "length", 1.0),
    ],
)
def test_a_text_is_worth_its_value(text: str, kind: str, value: float) -> None:
    quantity = Quantity.read(text, KINDS[kind])
    assert quantity.evaluate() == pytest.approx(value, rel=1e-15, abs=1e-300)
    assert quantity.source == text


@pytest.mark.parametrize(
    ("text", "value", "tolerance"),
    [
        ("60 mm ± 0.05 mm", 0.06, (-5e-5, 5e-5)),
        ("60 mm ± 0.05", 0.06, (-5e-5, 5e-5)),
        ("60 ± 0.05 mm", 0.06, (-5e-5, 5e-5)),
        ("60 mm +/- 0.05 mm", 0.06, (-5e-5, 5e-5)),
        ("60 mm ± 50 um", 0.06, (-5e-5, 5e-5)),
        ("6 cm ± 0.05 mm", 0.06, (-5e-5, 5e-5)),
        ("60 mm +0.02/-0.01 mm", 0.06, (-1e-5, 2e-5)),
        ("60 mm +0.02 mm/-0.01 mm", 0.06, (-1e-5, 2e-5)),
        ("60 mm +0.02/-0.01", 0.06, (-1e-5, 2e-5)),
        ("60 mm −0.01/+0.02", 0.06, (-1e-5, 2e-5)),
        ("60 mm +0.02/0", 0.06, (0.0, 2e-5)),
        ("60 mm 0/-0.02", 0.06, (-2e-5, 0.0)),
        ("60 mm +0.02/+0.01", 0.06, (1e-5, 2e-5)),
        ("60 mm -0.02/-0.04", 0.06, (-4e-5, -2e-5)),
        ("0 mm ± 0.1 mm", 0.0, (-1e-4, 1e-4)),
        ("-3 mm ± 0.1", -0.003, (-1e-4, 1e-4)),
        ("60 mm - 10 mm ± 0.1 mm", 0.05, (-1e-4, 1e-4)),
    ],
)
def test_tolerances(text: str, value: float, tolerance: tuple[float, float]) -> None:
    quantity = Quantity.read(text, LENGTH)
    assert quantity.evaluate() == pytest.approx(value)
    assert quantity.tolerance == pytest.approx(tolerance)


@pytest.mark.parametrize(
    ("text", "kind", "what", "remedy"),
    [
        ("2", LENGTH, "'2' has no unit where a length is needed", "60 mm"),
        ("2 * 3", LENGTH, "has no unit", "60 mm"),
        ("4.8 kg", LENGTH, "'4.8 kg' is a mass where a length is needed", "60 mm"),
        ("30 deg", LENGTH, "an angle where a length", "60 mm"),
        ("30 mm", ANGLE, "a length where an angle", "30 deg"),
        ("2", ANGLE, "has no unit where an angle", "30 deg"),
        ("30 deg", NUMBER, "an angle where a number", "0.1"),
        ("10 Hz", KINDS["angular speed"], "'Hz' may count turns", "rpm or rad/s"),
        ("1500 1/min", KINDS["angular speed"], "'1/min' may count turns", "rpm or rad/s"),
        ("10 N", KINDS["moment"], "a force where a moment", "10 N m"),
        ("60 furlongz", LENGTH, "'furlongz' is not known", "2 * AB"),
        ("60 mmm", LENGTH, "'mmm' is not known", "did you mean 'mm'?"),
        ("60 N/mmm", KINDS["stiffness"], "'N/mmm' is not known", "did you mean 'mm'?"),
        ("20 degC", LENGTH, "not one of mechanics", "length, mass, time and angle"),
        ("3 A", LENGTH, "not one of mechanics", ""),
        ("2 dB", NUMBER, "is not known", ""),
        ("2,5 mm", LENGTH, "','", "decimal point"),
        ("2 mm + 3", LENGTH, "a length and a number are added", "3 mm"),
        ("2 mm + 3 kg", LENGTH, "a length and a mass are added", ""),
        ("sin(2 mm) * 1 m", LENGTH, "sin is given a length", "takes an angle"),
        ("asin(30 deg)", ANGLE, "asin is given an angle", "takes a number"),
        ("2 mm ^ 0.5", LENGTH, "not a whole number", "sqrt"),
        ("2 ^ (1 mm)", NUMBER, "an exponent is a length", "without unit"),
        ("1/0", NUMBER, "no finite value (inf)", "divisions"),
        ("sqrt(-1)", NUMBER, "no finite value (nan)", "roots"),
        ("(0 - 1)^0.5", NUMBER, "no finite value (nan)", "roots"),
        ("9^9^9^9", NUMBER, "no finite value", ""),
        ("1e999", NUMBER, "too large", "finite"),
        ("1e999999999999 mm", LENGTH, "too large", "finite"),
        ("", LENGTH, "cannot be read", ""),
        ("   ", LENGTH, "cannot be read", ""),
        ("hello world", LENGTH, "an operator is missing before 'world'", ""),
        ("2 (3 mm)", LENGTH, "missing before", "2 * "),
        ("(2 mm", LENGTH, "cannot be read", "parentheses"),
        ("sin 30", NUMBER, "an operator is missing", ""),
        ("sin", NUMBER, "no argument", "sin("),
        ("foo(2)", NUMBER, "'foo' is not a function", "cos"),
        ("atan2(2)", ANGLE, "takes 2 arguments, not 1", ""),
        ("2 ** ", NUMBER, "cannot be read", ""),
        ("__import__('os').system('x')", NUMBER, "not understood", ""),
        ("a.b", NUMBER, "'.b' is not understood", ""),
        ("x[0]", NUMBER, "not understood", ""),
        ("lambda: 0", NUMBER, "not understood", ""),
        ("1 if 2 else 3", NUMBER, "", ""),
        ("1 + " * 160 + " 1", NUMBER, "at most", "split"),
        ("+".join(["1"] * 100), NUMBER, "nested too deeply", "split"),
        ("(" * 240 + "1" + ")" * 240, NUMBER, "cannot be read", ""),
        ("-" * 450 + "1", NUMBER, "", ""),
        ("60 mm ± x", LENGTH, "the tolerance 'x'", "0.05 mm"),
        ("60 mm ±", LENGTH, "the tolerance ''", "0.05 mm"),
        ("60 mm ± -0.1 mm", LENGTH, "sign after ±", "± 0.05 mm"),
        ("60 mm ± 1 kg", LENGTH, "a mass, the value a length", "same unit"),
        ("60 mm ± 1 deg", LENGTH, "an angle, the value a length", "same unit"),
        ("60 ± 1", LENGTH, "has no unit", "60 mm"),
        ("AB ± 0.1", LENGTH, "has no unit", "± 0.05 mm"),
        (True, LENGTH, "a yes/no value", "60 mm"),
        (None, LENGTH, "is empty", "60 mm"),
        ([1], LENGTH, "a list", "60 mm"),
        (math.nan, LENGTH, "nan is not a finite number", "finite"),
        (math.inf, LENGTH, "inf is not a finite number", "finite"),
        (10**400, LENGTH, "not a finite number", "finite"),
    ],
)
def test_what_is_wrong_is_said(text: object, kind: object, what: str, remedy: str) -> None:
    with pytest.raises(UnitError) as error:
        Quantity.read(text, kind)  # type: ignore[arg-type]
    assert what in error.value.what
    assert remedy in error.value.remedy
    assert error.value.remedy


def test_expressions_know_their_names_whatever_python_thinks_of_them() -> None:
    quantity = Quantity.read("lambda * cos(γ) + in - AB2", ANY)
    assert quantity.names == ("lambda", "γ", "in", "AB2")
    assert quantity.evaluate({"lambda": 2.0, "γ": 0.0, "in": 1.0, "AB2": 0.5}) == 2.5


def test_an_arc_over_a_radius_is_an_angle_but_an_angle_no_number() -> None:
    metre = LENGTH.dimensions[0]
    Quantity.read("AB / BC", ANGLE).check({"AB": metre, "BC": metre})
    Quantity.read("AB * gamma", LENGTH).check({"AB": metre, "gamma": ANGLE.dimensions[0]})
    with pytest.raises(UnitError, match="is an angle where a number is needed"):
        Quantity.read("gamma", NUMBER).check({"gamma": ANGLE.dimensions[0]})


def test_a_plain_dimension_fits_anywhere() -> None:
    for kind in KINDS.values():
        Quantity.read("2 * AB", kind).check({"AB": None})


def test_arrays_and_duals_flow_through() -> None:
    quantity = Quantity.read("BE * cos(gamma)^2 + min(BE, 1 m)", LENGTH)
    lengths = np.linspace(1.5, 3.0, 7)[:, None]
    assert quantity.evaluate({"BE": lengths, "gamma": 0.3}) == pytest.approx(lengths * math.cos(0.3) ** 2 + 1)
    slope = quantity.evaluate({"BE": Dual(2.5, 1.0), "gamma": 0.3})
    assert slope.dual == pytest.approx(math.cos(0.3) ** 2)
    slope = quantity.evaluate({"BE": 2.5, "gamma": Dual(0.3, 1.0)})
    assert slope.dual == pytest.approx(-2.5 * math.sin(0.6))


UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "cm": 1e-2, "km": 1e3, "inch": 0.0254}


@given(st.floats(-1e9, 1e9, allow_subnormal=False), st.sampled_from(sorted(UNITS)))
def test_any_number_with_any_unit(number: float, unit: str) -> None:
    quantity = Quantity.read(f"{number!r} {unit}", LENGTH)
    assert quantity.evaluate() == pytest.approx(number * UNITS[unit], rel=4e-16, abs=1e-300)


@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(2**53), 2**53))
def test_a_number_is_kept_as_written(number: float) -> None:
    quantity = Quantity.read(number, LENGTH)
    assert quantity.source == number
    assert type(quantity.source) is type(number)
    assert quantity.evaluate() == number


def _python(tree: object, names: dict[str, float]) -> float:
    """The value of a random tree in plain Python."""
    if isinstance(tree, tuple):
        operator, *parts = tree
        values = [_python(part, names) for part in parts]
        return OPERATIONS[operator](*values)
    return names[tree] if isinstance(tree, str) else float(tree)  # type: ignore[arg-type]


def _text(tree: object) -> str:
    if isinstance(tree, tuple):
        operator, *parts = tree
        texts = [_text(part) for part in parts]
        return f"{operator}({', '.join(texts)})" if operator.isalpha() else f"({f' {operator} '.join(texts)})"
    return tree if isinstance(tree, str) else repr(tree)


OPERATIONS = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "sin": math.sin,
    "cos": math.cos,
    "abs": abs,
    "min": min,
    "max": max,
    "hypot": math.hypot,
}
TREES = st.recursive(
    st.sampled_from(["AB", "γ"]) | st.floats(0, 100).map(lambda x: round(x, 3)),
    lambda inner: (
        st.tuples(st.sampled_from(["+", "-", "*", "min", "max", "hypot"]), inner, inner)
        | st.tuples(st.sampled_from(["sin", "cos", "abs"]), inner)
    ),
    max_leaves=8,
)


@given(TREES, st.floats(-10, 10), st.floats(-10, 10))
def test_the_evaluator_agrees_with_python(tree: object, first: float, second: float) -> None:
    names = {"AB": first, "γ": second}
    quantity = Quantity.read(_text(tree), ANY)
    assert quantity.evaluate(names) == pytest.approx(_python(tree, names), rel=1e-12, abs=1e-9)


@pytest.mark.slow
@given(st.text(max_size=60) | st.text("0123456789.eE+-*/^() mkgNrads°µ±%AB,", max_size=60))
def test_no_text_does_anything_but_fail_cleanly(text: str) -> None:
    with suppress(UnitError):
        assert Quantity.read(text, LENGTH).source == text
