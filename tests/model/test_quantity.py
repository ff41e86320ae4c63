"""What a text of a model file is worth, which spellings of units are read, and what is said of others."""

import math
import time
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trunnion.algebra.dual import Dual
from trunnion.model.quantity import Quantity
from trunnion.model.units import ANY, BASES, KINDS, UnitError, root, unit
from trunnion.rig.reading.units import dimensions

LENGTH, ANGLE, NUMBER = KINDS["length"], KINDS["angle"], KINDS["number"]


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("60 mm", "length", 0.06), ("60mm", "length", 0.06), ("93.782 mm", "length", 0.093782),
        ("-8.6 mm", "length", -0.0086), ("−8.6 mm", "length", -0.0086), ("20 um", "length", 20e-6),
        ("20 µm", "length", 20e-6), ("20 μm", "length", 20e-6), ("1e1 mm", "length", 0.01), ("0", "length", 0.0),
        ("30 deg", "angle", math.pi / 6), ("30°", "angle", math.pi / 6), ("180 deg", "angle", math.pi),
        ("0.152 rad", "angle", 0.152), ("pi / 2", "angle", math.pi / 2),
        ("90 deg - 0.1 deg", "angle", math.radians(89.9)), ("1500 rpm", "angular speed", 1500 * 2 * math.pi / 60),
        ("10 1/s", "angular speed", 10.0), ("600 mm/min", "speed", 0.01), ("9.81 m·s⁻²", "acceleration", 9.81),
        ("10 N*m/rad", "moment", 10.0), ("48.80 kg*m**2", "moment of inertia", 48.8), ("5%", "number", 0.05),
        ("2 * (3 mm + 1 cm)", "length", 0.026),
        ("3 mm * 2^2", "length", 0.012), ("max(1 mm, 2 mm, 3 mm)", "length", 0.003),
        ("hypot(3 mm, 4 mm)", "length", 0.005), ("sqrt(16 mm^2)", "length", 0.004),
        ("atan2(1 mm, 1 mm)", "angle", math.pi / 4), ("2 m*cos(60 deg)", "length", 1.0),
    ],
)  # fmt: skip
def test_a_text_is_worth_its_value(text, kind, value):
    quantity = Quantity.read(text, KINDS[kind])
    assert quantity.evaluate() == pytest.approx(value, rel=1e-15, abs=1e-300)
    assert quantity.source == text


@pytest.mark.parametrize(
    ("text", "value", "tolerance"),
    [
        ("60 mm ± 0.05 mm", 0.06, (-5e-5, 5e-5)), ("60 mm ± 0.05", 0.06, (-5e-5, 5e-5)),
        ("60 ± 0.05 mm", 0.06, (-5e-5, 5e-5)), ("60 mm +/- 0.05 mm", 0.06, (-5e-5, 5e-5)),
        ("60 mm ± 50 um", 0.06, (-5e-5, 5e-5)), ("6 cm ± 0.05 mm", 0.06, (-5e-5, 5e-5)),
        ("60 mm +0.02/-0.01 mm", 0.06, (-1e-5, 2e-5)), ("60 mm +0.02 mm/-0.01 mm", 0.06, (-1e-5, 2e-5)),
        ("60 mm +0.02/-0.01", 0.06, (-1e-5, 2e-5)), ("60 mm −0.01/+0.02", 0.06, (-1e-5, 2e-5)),
        ("60 mm +0.02/0", 0.06, (0.0, 2e-5)), ("60 mm 0/-0.02", 0.06, (-2e-5, 0.0)),
        ("60 mm +0.02/+0.01", 0.06, (1e-5, 2e-5)), ("60 mm -0.02/-0.04", 0.06, (-4e-5, -2e-5)),
        ("0 mm ± 0.1 mm", 0.0, (-1e-4, 1e-4)), ("-3 mm ± 0.1", -0.003, (-1e-4, 1e-4)),
        ("60 mm - 10 mm ± 0.1 mm", 0.05, (-1e-4, 1e-4)),
    ],
)  # fmt: skip
def test_tolerances(text, value, tolerance):
    quantity = Quantity.read(text, LENGTH)
    assert quantity.evaluate() == pytest.approx(value)
    assert quantity.tolerance == pytest.approx(tolerance)


@pytest.mark.parametrize(
    ("text", "kind", "what", "remedy"),
    [
        ("2", LENGTH, "'2' has no unit where a length is needed", "60 mm"),
        ("4.8 kg", LENGTH, "'4.8 kg' is a mass where a length is needed", "60 mm"),
        ("30 deg", LENGTH, "an angle where a length", "60 mm"), ("30 deg", NUMBER, "an angle where a number", "0.1"),
        ("10 Hz", KINDS["angular speed"], "'Hz' may count turns", "rpm or rad/s"),
        ("60 furlongz", LENGTH, "'furlongz' is not known", "2 * AB"),
        ("60 mmm", LENGTH, "'mmm' is not known", "did you mean 'mm'?"),
        ("60 N/mmm", KINDS["stiffness"], "'N/mmm' is not known", "did you mean 'mm'?"),
        ("20 degC", LENGTH, "not one of mechanics", "length, mass, time and angle"),
        ("2 dB", NUMBER, "is not known", ""), ("2,5 mm", LENGTH, "','", "decimal point"),
        ("2 mm + 3", LENGTH, "a length and a number are added", "3 mm"),
        ("sin(2 mm) * 1 m", LENGTH, "sin is given a length", "takes an angle"),
        ("2 mm ^ 0.5", LENGTH, "not a whole number", "sqrt"),
        ("2 ^ (1 mm)", NUMBER, "an exponent is a length", "without unit"),
        ("9^9^9^9", NUMBER, "no finite value", ""), ("1/0", NUMBER, "no finite value (inf)", "divisions"),
        ("sqrt(-1)", NUMBER, "no finite value (nan)", "roots"),
        ("1e999999999999 mm", LENGTH, "too large", "finite"), ("", LENGTH, "cannot be read", ""),
        ("hello world", LENGTH, "an operator is missing before 'world'", ""),
        ("2 (3 mm)", LENGTH, "missing before", "2 * "), ("(2 mm", LENGTH, "cannot be read", "parentheses"),
        ("sin", NUMBER, "no argument", "sin("), ("foo(2)", NUMBER, "'foo' is not a function", "cos"),
        ("atan2(2)", ANGLE, "takes 2 arguments, not 1", ""),
        ("__import__('os').system('x')", NUMBER, "not understood", ""), ("lambda: 0", NUMBER, "not understood", ""),
        ("1 if 2 else 3", NUMBER, "", ""), ("1 + " * 160 + " 1", NUMBER, "at most", "split"),
        ("+".join(["1"] * 100), NUMBER, "nested too deeply", "split"),
        ("(" * 240 + "1" + ")" * 240, NUMBER, "cannot be read", ""), ("-" * 450 + "1", NUMBER, "", ""),
        ("60 mm ± x", LENGTH, "the tolerance 'x'", "0.05 mm"), ("60 mm ±", LENGTH, "the tolerance ''", "0.05 mm"),
        ("60 mm ± -0.1 mm", LENGTH, "sign after ±", "± 0.05 mm"),
        ("60 mm ± 1 kg", LENGTH, "a mass, the value a length", "same unit"),
        ("AB ± 0.1", LENGTH, "has no unit", "± 0.05 mm"), (True, LENGTH, "a yes/no value", "60 mm"),
        (math.nan, LENGTH, "nan is not a finite number", "finite"), (10**400, LENGTH, "not a finite number", "finite"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(text, kind, what, remedy):
    with pytest.raises(UnitError) as error:
        Quantity.read(text, kind)
    assert what in error.value.what
    assert remedy in error.value.remedy
    assert error.value.remedy


def test_expressions_know_their_names_whatever_python_thinks_of_them():
    quantity = Quantity.read("lambda * cos(γ) + in - AB2", ANY)
    assert quantity.names == ("lambda", "γ", "in", "AB2")
    assert quantity.evaluate({"lambda": 2.0, "γ": 0.0, "in": 1.0, "AB2": 0.5}) == 2.5


def test_an_arc_over_a_radius_is_an_angle_but_an_angle_no_number():
    metre = LENGTH.dimensions[0]
    Quantity.read("AB / BC", ANGLE).check({"AB": metre, "BC": metre})
    Quantity.read("AB * gamma", LENGTH).check({"AB": metre, "gamma": ANGLE.dimensions[0]})
    with pytest.raises(UnitError, match="is an angle where a number is needed"):
        Quantity.read("gamma", NUMBER).check({"gamma": ANGLE.dimensions[0]})


def test_arrays_and_duals_flow_through():
    quantity = Quantity.read("BE * cos(gamma)^2 + min(BE, 1 m)", LENGTH)
    lengths = np.linspace(1.5, 3.0, 7)[:, None]
    assert quantity.evaluate({"BE": lengths, "gamma": 0.3}) == pytest.approx(lengths * math.cos(0.3) ** 2 + 1)
    slope = quantity.evaluate({"BE": Dual(2.5, 1.0), "gamma": 0.3})
    assert slope.dual == pytest.approx(math.cos(0.3) ** 2)
    slope = quantity.evaluate({"BE": 2.5, "gamma": Dual(0.3, 1.0)})
    assert slope.dual == pytest.approx(-2.5 * math.sin(0.6))


@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(2**53), 2**53))
def test_a_number_is_kept_as_written(number):
    quantity = Quantity.read(number, LENGTH)
    assert quantity.source == number
    assert type(quantity.source) is type(number)
    assert quantity.evaluate() == number


def _python(tree, names):
    """The value of a random tree in plain Python."""
    if isinstance(tree, tuple):
        operator, *parts = tree
        values = [_python(part, names) for part in parts]
        return OPERATIONS[operator](*values)
    return names[tree] if isinstance(tree, str) else float(tree)


def _text(tree):
    if isinstance(tree, tuple):
        operator, *parts = tree
        texts = [_text(part) for part in parts]
        return f"{operator}({', '.join(texts)})" if operator.isalpha() else f"({f' {operator} '.join(texts)})"
    return tree if isinstance(tree, str) else repr(tree)


OPERATIONS = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "sin": math.sin, "cos": math.cos,
    "abs": abs, "min": min, "max": max, "hypot": math.hypot,
}  # fmt: skip
TREES = st.recursive(
    st.sampled_from(["AB", "γ"]) | st.floats(0, 100).map(lambda x: round(x, 3)),
    lambda inner: (
        st.tuples(st.sampled_from(["+", "-", "*", "min", "max", "hypot"]), inner, inner)
        | st.tuples(st.sampled_from(["sin", "cos", "abs"]), inner)
    ),
    max_leaves=8,
)


@given(TREES, st.floats(-10, 10), st.floats(-10, 10))
def test_the_evaluator_agrees_with_python(tree, first, second):
    names = {"AB": first, "γ": second}
    quantity = Quantity.read(_text(tree), ANY)
    assert quantity.evaluate(names) == pytest.approx(_python(tree, names), rel=1e-12, abs=1e-9)


@pytest.mark.slow
@given(st.text(max_size=60) | st.text("0123456789.eE+-*/^() mkgNrads°µ±%AB,", max_size=60))
def test_no_text_does_anything_but_fail_cleanly(text):
    with suppress(UnitError):
        assert Quantity.read(text, LENGTH).source == text


SPELLINGS = {
    "daN": 10.0, "kNm": 1e3, "daNm": 10.0, "cNm": 0.01, "Nmm": 1e-3, "N/mm^2": 1e6, "MPa": 1e6, "m/sec": 1.0,
    "Sek.": 1.0, "sec.": 1.0, "U/min": math.pi / 30, "Umdr./min": math.pi / 30, "cc/rev": 1e-6 / 2 / math.pi,
}  # fmt: skip


def test_spellings_in_use():
    assert {text: float(unit(text)[0]) for text in SPELLINGS} == pytest.approx(SPELLINGS, rel=1e-12)
    assert {text: dimensions(text)[0] for text in SPELLINGS} == pytest.approx(SPELLINGS, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("Grad", "write deg for degrees"), ("grad", "write deg for degrees"), ("krad", ""), ("Mrad", "mrad"),
        ("mdeg", "deg"), ("mgon", "gon"), ("Grev", "rev"), ("kturn", "turn"), ("krpm", "rpm"), ("Mm", "'mm'"),
        ("MM", "'mm'"), ("Min", "'min'"), ("KN", "kN"), ("kn", "kN"), ("mPa", "MPa"), ("Mpa", "MPa"), ("Kg", "kg"),
        ("u/min", "rpm"), ("r/min", "rpm"), ("min-1", "rpm"), ("RPM", "rpm"), ("PS", "kW"), ("mil", "thou"),
        ("ton", "t for 1000 kg"), ("cd", ""), ("ha", ""), ("pA", "Pa"), ("a", ""), ("b", ""), ("P", "Pa"),
        ("N/Mm", "'mm'"), ("Nm/Grad", "deg"), ("m⁄s", ""), ("m\\s", ""),
        ("hh:mm:ss", "write s"), ("dB", ""), ("light_year", ""), ("NM", "N m"),
    ],
)  # fmt: skip
def test_others_are_findings(text, remedy):
    for read in (unit, dimensions):
        with pytest.raises(UnitError) as caught:
            read(text)
        assert remedy in caught.value.remedy, caught.value.remedy
        assert caught.value.remedy
        assert text in caught.value.what


PI = 3.141592653589793
# Factors to SI of NIST SP 811 (2008), appendix B.8, and of the SI brochure, with exponents of m, kg, s, rad, A, K.
FACTORS = {
    "m": (1, "m"), "micron": (1e-6, "m"), "inches": (2.54e-2, "m"), "foot": (0.3048, "m"), "yd": (0.9144, "m"),
    "mile": (1609.344, "m"), "thou": (2.54e-5, "m"), "kilometers": (1e3, "m"), "nm": (1e-9, "m"),
    "g": (1e-3, "kg"), "t": (1e3, "kg"), "lb": (0.45359237, "kg"), "oz": (2.8349523125e-2, "kg"),
    "slug": (14.59390293720636, "kg"), "milligrams": (1e-6, "kg"), "mins": (60, "s"), "hours": (3600, "s"),
    "days": (86400, "s"), "msec": (1e-3, "s"), "usec": (1e-6, "s"), "µs": (1e-6, "s"),
    "deg": (PI / 180, "rad"), "gon": (PI / 200, "rad"), "arcmin": (PI / 10800, "rad"), "turns": (2 * PI, "rad"),
    "rpm": (PI / 30, "rad s^-1"), "rps": (2 * PI, "rad s^-1"),
    "kN": (1e3, "m kg s^-2"), "lbf": (4.4482216152605, "m kg s^-2"), "ozf": (0.27801385095378125, "m kg s^-2"),
    "kip": (4448.2216152605, "m kg s^-2"), "kgf": (9.80665, "m kg s^-2"), "dyn": (1e-5, "m kg s^-2"),
    "GPa": (1e9, "m^-1 kg s^-2"), "mbar": (100, "m^-1 kg s^-2"), "psi": (6894.757293168361, "m^-1 kg s^-2"),
    "ksi": (6894757.293168361, "m^-1 kg s^-2"), "atm": (101325, "m^-1 kg s^-2"),
    "kJ": (1e3, "m^2 kg s^-2"), "kWh": (3.6e6, "m^2 kg s^-2"), "hp": (745.6998715822702, "m^2 kg s^-3"),
    "mph": (0.44704, "m s^-1"), "kph": (1 / 3.6, "m s^-1"), "cSt": (1e-6, "m^2 s^-1"), "mL": (1e-6, "m^3"),
    "cc": (1e-6, "m^3"), "kHz": (1e3, "s^-1"), "mV": (1e-3, "m^2 kg s^-3 A^-1"), "pC": (1e-12, "s A"),
    "nF": (1e-9, "m^-2 kg^-1 s^4 A^2"), "kohm": (1e3, "m^2 kg s^-3 A^-2"), "mT": (1e-3, "kg s^-2 A^-1"),
    "mK": (1e-3, "K"), "°C": (1, "K"), "%": (0.01, ""), "‰": (1e-3, ""), "ppm": (1e-6, ""), "µε": (1e-6, ""),
}  # fmt: skip


def exponents(text):
    pairs = [one.partition("^") for one in text.split()]
    return {base: int(power or 1) for base, _, power in pairs}


@pytest.mark.parametrize("text", FACTORS)
def test_factors_to_si(text):
    factor, bases, _ = root(text)
    assert float(factor) == pytest.approx(FACTORS[text][0], rel=1e-15)
    assert bases == exponents(FACTORS[text][1])


names = st.sampled_from(list(FACTORS))
powers = st.sampled_from([("", 1), ("^2", 2), ("**2", 2), ("^-1", -1), ("^(-2)", -2), ("^1.5", 1.5), ("^(1/2)", 0.5)])
signs = st.sampled_from([("*", 1), (" ", 1), ("·", 1), (" * ", 1), ("/", -1), (" / ", -1)])


@given(st.lists(st.tuples(signs, names, powers), min_size=1, max_size=4), st.booleans())
def test_products_are_read_from_left_to_right(parts, per):
    text, factor, sums = "1/1" if per else "1", 1.0, dict.fromkeys(BASES, 0.0)
    for (sign, side), name, (power, exponent) in parts:
        text += f"{sign}{name}{power}"
        factor *= FACTORS[name][0] ** (side * exponent)
        for base, number in exponents(FACTORS[name][1]).items():
            sums[base] += side * exponent * number
    for written in (text, f"({text})"):
        size, bases, _ = root(written)
        assert float(size) == pytest.approx(factor, rel=1e-12)
        assert bases == {base: number for base, number in sums.items() if number}


@pytest.mark.parametrize("text", ["m//s", "m-s", "m+s", "2 m", "/m", "m/", "m()", "(m", "m)", "m^", "m^2^2", "m^1000"])
def test_what_is_no_product(text):
    with pytest.raises(UnitError, match="is not known") as caught:
        root(text)
    assert caught.value.remedy == "write a unit as N m, kg/m^3 or s^-1"


@pytest.mark.parametrize(
    ("text", "kind", "remedy"),
    [
        ("1/2 in", "length", "write 0.5 in"), ("1-1/2 in", "length", "write 1.5 in"),
        ("10 kp", "force", "write kgf, or N"),
        ("10 N.m", "moment", "write 10 N m"), ("2 kg.m^2", "moment of inertia", "write 2 kg m^2"),
    ],
)  # fmt: skip
def test_the_spelling_that_is_meant(text, kind, remedy):
    with pytest.raises(UnitError) as caught:
        Quantity.read(text, KINDS[kind])
    assert caught.value.remedy == remedy


@pytest.mark.parametrize("unit", ["9**9**9**9", "m^9^9^9", "((((9^9)^9)^9)^9)^9 m", "m^(9^9^9)", "9" * 5000, "2**1e9"])
def test_powers_that_no_unit_has(unit):
    begin = time.process_time()
    with pytest.raises(UnitError):
        root(unit)
    assert time.process_time() - begin < 10
