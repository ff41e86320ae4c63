"""Which spellings of units are read, and what is said of those that are not."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.mechanisms import four_bar

from trunnion import Mechanism, MechanismError
from trunnion.model.quantity import Quantity
from trunnion.model.units import BASES, KINDS, UnitError, root, unit
from trunnion.rig.reading.units import dimensions


@pytest.mark.parametrize(
    ("text", "factor"),
    [
        ("deg", math.pi / 180), ("°", math.pi / 180), ("gon", math.pi / 200), ("mrad", 1e-3), ("µrad", 1e-6),
        ("urad", 1e-6), ("arcsec", math.pi / 648000), ("rev", 2 * math.pi), ("mm", 1e-3), ("μm", 1e-6), ("um", 1e-6),
        ("daN", 10.0), ("kNm", 1e3), ("daNm", 10.0), ("cNm", 0.01), ("Nmm", 1e-3), ("N/mm^2", 1e6), ("MPa", 1e6),
        ("m/sec", 1.0), ("Sek.", 1.0), ("Sek", 1.0), ("sec.", 1.0),
        ("U/min", math.pi / 30), ("Umdr./min", math.pi / 30), ("cc/rev", 1e-6 / 2 / math.pi),
        ("km/h", 1 / 3.6), ("millimetres", 1e-3), ("kgf/cm^2", 98066.5), ("µin", 2.54e-8),
    ],
)  # fmt: skip
def test_spellings_in_use(text: str, factor: float) -> None:
    assert float(unit(text)[0]) == pytest.approx(factor, rel=1e-12)
    assert dimensions(text)[0] == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("Grad", "write deg for degrees"), ("grad", "write deg for degrees"), ("krad", ""), ("Mrad", "mrad"),
        ("mdeg", "deg"), ("mgon", "gon"), ("Grev", "rev"), ("kturn", "turn"), ("krpm", "rpm"), ("Mm", "'mm'"),
        ("MM", "'mm'"), ("Min", "'min'"), ("KN", "kN"), ("kn", "kN"), ("mPa", "MPa"), ("Mpa", "MPa"), ("Kg", "kg"),
        ("u/min", "rpm"), ("r/min", "rpm"), ("min-1", "rpm"), ("RPM", "rpm"), ("PS", "kW"), ("mil", "thou"),
        ("ton", "t for 1000 kg"), ("cd", ""), ("ha", ""), ("pA", "Pa"), ("a", "A for ampere"), ("b", ""), ("P", "Pa"),
        ("Nms", "N m s"), ("Ns", "N s"), ("N/Mm", "'mm'"), ("Nm/Grad", "deg"), ("m⁄s", ""), ("m\\s", ""),
        ("hh:mm:ss", "write s"), ("dB", ""), ("g_0", "m/s^2"), ("light_year", ""), ("KNm", "kNm"), ("NM", "N m"),
    ],
)  # fmt: skip
def test_others_are_findings(text: str, remedy: str) -> None:
    for read in (unit, dimensions):
        with pytest.raises(UnitError) as caught:
            read(text)
        assert remedy in caught.value.remedy, caught.value.remedy
        assert caught.value.remedy
        assert text in caught.value.what


@pytest.mark.parametrize("text", ["1500 min-1", "1500 1/min", "1500 min^-1", "1500 min⁻¹", "1500/min", "1500 u/min"])
def test_a_speed_in_the_words_of_catalogues(text: str) -> None:
    with pytest.raises(UnitError) as caught:
        Quantity.read(text, KINDS["angular speed"])
    assert "rpm" in caught.value.remedy
    assert Quantity.read("1500 U/min", KINDS["angular speed"]).evaluate() == pytest.approx(50 * math.pi)


def test_degrees_in_german_are_no_giga_radians() -> None:
    with pytest.raises(UnitError, match="is not known"):
        Quantity.read("6 Grad", KINDS["angle"])
    with pytest.raises(UnitError, match="is not known"):
        Quantity.read("6 deg ± 1 Grad", KINDS["angle"])


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


def exponents(text: str) -> dict[str, int]:
    pairs = [one.partition("^") for one in text.split()]
    return {base: int(power or 1) for base, _, power in pairs}


@pytest.mark.parametrize("text", FACTORS)
def test_factors_to_si(text: str) -> None:
    factor, bases, _ = root(text)
    assert float(factor) == pytest.approx(FACTORS[text][0], rel=1e-15)
    assert bases == exponents(FACTORS[text][1])


names = st.sampled_from(list(FACTORS))
powers = st.sampled_from([("", 1), ("^2", 2), ("**2", 2), ("^-1", -1), ("^(-2)", -2), ("^1.5", 1.5), ("^(1/2)", 0.5)])
signs = st.sampled_from([("*", 1), (" ", 1), ("·", 1), (" * ", 1), ("/", -1), (" / ", -1)])


@given(st.lists(st.tuples(signs, names, powers), min_size=1, max_size=4), st.booleans())
def test_products_are_read_from_left_to_right(
    parts: list[tuple[tuple[str, int], str, tuple[str, float]]], per: bool
) -> None:
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


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("N*m", "N m"), ("lbf·in", "in lbf"), ("m/s**2", "m/s/s"), ("mV/(N m)", "mV/N/m"), ("V/(rad/s)", "V s/rad"),
        ("(N m)^2", "N^2 m^2"), ("N.m", "N m"), ("m²", "m^2"), ("N m s⁻¹", "W"), ("1 / (N m)", "1/N/m"),
    ],
)  # fmt: skip
def test_forms_of_products(text: str, same: str) -> None:
    assert root(text)[:2] == root(same)[:2]


@pytest.mark.parametrize("text", ["m//s", "m-s", "m+s", "2 m", "/m", "m/", "m()", "(m", "m)", "m^", "m^2^2", "m^1000"])
def test_what_is_no_product(text: str) -> None:
    with pytest.raises(UnitError, match="is not known") as caught:
        root(text)
    assert caught.value.remedy == "write a unit as N m, kg/m^3 or s^-1"


@pytest.mark.parametrize(
    ("text", "kind", "remedy"),
    [
        ("1/2 in", "length", "write 0.5 in"), ("1-1/2 in", "length", "write 1.5 in"),
        ("100 lb", "force", "write 100 lbf"), ("5 kg", "force", "write 5 kgf"), ("10 kp", "force", "write kgf, or N"),
    ],
)  # fmt: skip
def test_the_spelling_that_is_meant(text: str, kind: str, remedy: str) -> None:
    with pytest.raises(UnitError) as caught:
        Quantity.read(text, KINDS[kind])
    assert caught.value.remedy == remedy


@pytest.mark.parametrize(
    ("text", "meant"),
    [("10 lb-in", "10 lbf in"), ("10 ft-lb", "10 ft lbf"), ("10 N-m", "10 N m"), ("1 kN-m", "1 kN m")],
)
def test_a_torque_with_a_hyphen(text: str, meant: str) -> None:
    with pytest.raises(MechanismError) as caught:
        Mechanism(**{**four_bar(), "loads": {"out": {"joint": "D", "resisting_torque": text}}})
    (finding,) = caught.value.findings
    assert (finding.where, finding.remedy) == ("loads.out.resisting_torque", f"write {meant}")
