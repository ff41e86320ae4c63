"""Which spellings of units are read, and what is said of those that are not."""

from __future__ import annotations

import math
from itertools import product

import pytest

from trunnion.model import units
from trunnion.model.quantity import Quantity
from trunnion.model.units import KINDS, UnitError, unit
from trunnion.rig.reading.sensor_quantity import dimensions


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
    with pytest.raises(UnitError, match="not in common use"):
        Quantity.read("6 Grad", KINDS["angle"])
    with pytest.raises(UnitError, match="not in common use"):
        Quantity.read("6 deg ± 1 Grad", KINDS["angle"])


def test_units_read_without_pint_are_as_pint_reads_them(monkeypatch: pytest.MonkeyPatch) -> None:
    known = units._COMMON
    pairs = [f"{a}{between}{b}" for a, b in product(known, known) for between in (" ", "/", "^2 * ")]
    texts = [*known, *pairs, "Nm", "kNm", "N m/rad s", "m s^-2", "kg m^2/s^2", "m/s/s", "N m s/rad"]
    texts += ["1/s^2", "1 / mm", "1/N m", "mV/(N m)", "mV/(N * m)", "N m/(rad s)", "1/(N m)", "mV/(V N)"]
    texts += ["V/(rad/s)", "mV/(N m/s)"]
    short = {text: found for text in texts if (found := units._common(units.plain(text)))}
    assert len(short) > 0.9 * len(texts)
    assert {"N m", "Nm", "rad/s", "m s^-2", "1/s^2", "1 / mm", "bar", "mV/(N m)", "N m/(rad s)", "1/(N m)"} <= set(
        short
    )
    assert {"V/(rad/s)", "mV/(N m/s)"} <= set(short)
    monkeypatch.setattr(units, "_common", lambda spaced: None)
    for text, (factor, exponents, names) in short.items():
        by_pint = units.root.__wrapped__(text)
        assert (factor, exponents, sorted(names)) == (by_pint[0], by_pint[1], sorted(by_pint[2])), text
