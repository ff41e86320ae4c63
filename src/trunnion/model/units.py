"""Kinds of quantity (length, moment, …) and the units a model file may write them in.

A dimension is the exponents of (length, mass, time, angle). Angle counts as one, although SI calls it a pure
number, so that 30 deg is not taken for a length nor 30 mm for an angle; beside other dimensions it drops out
(N m/rad is N m). pint knows the units; those that nearly every model is written in stand here as well, since pint
takes a third of a second to load.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Literal

from trunnion.model.unit_spellings import READ, plain, remedy_for, strange_sign, words

if TYPE_CHECKING:
    import pint

__all__ = [
    "ANGLE",
    "ANY",
    "KINDS",
    "NUMBER",
    "Dimension",
    "Kind",
    "TableUnits",
    "UnitError",
    "dimension_text",
    "fits",
    "root",
    "si_unit",
    "unit",
]

Dimension = tuple[Fraction, Fraction, Fraction, Fraction]
TableUnits = Literal["si", "model"]  # that tables are written in


class UnitError(ValueError):
    """A unit that cannot be used; `what` and `remedy` as in a finding."""

    def __init__(self, what: str, remedy: str = "") -> None:
        super().__init__(what)
        self.what = what
        self.remedy = remedy


def _dimension(length: int = 0, mass: int = 0, time: int = 0, angle: int = 0) -> Dimension:
    return Fraction(length), Fraction(mass), Fraction(time), Fraction(angle)


NUMBER = _dimension()
ANGLE = _dimension(angle=1)


@dataclass(frozen=True)
class Kind:
    """What a quantity measures.

    unit: the SI unit its plain numbers are in; example: how one is written; dimensions: those it may have
    (a driver's speed is a speed or an angular speed, by its joint), any if empty.
    """

    name: str
    unit: str
    example: str
    dimensions: tuple[Dimension, ...] = field(repr=False, hash=False)  # fractions are slow to hash

    def __or__(self, other: Kind) -> Kind:
        """A quantity that may be either, until its place says which."""
        return Kind(
            f"{self.name} or {other.name}",
            f"{self.unit} or {other.unit}",
            self.example,
            self.dimensions + other.dimensions,
        )

    def accepts(self, dimension: Dimension | None) -> bool:
        """Whether a value of this dimension (None: a plain number, unknown) can stand here."""
        return dimension is None or not self.dimensions or any(fits(dimension, one) for one in self.dimensions)


KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind("number", "1", "0.1", (NUMBER,)),
        Kind("length", "m", "60 mm", (_dimension(length=1),)),
        Kind("angle", "rad", "30 deg", (ANGLE,)),
        Kind("mass", "kg", "1.2 kg", (_dimension(mass=1),)),
        Kind("time", "s", "0.2 s", (_dimension(time=1),)),
        Kind("moment of inertia", "kg m^2", "4e-4 kg m^2", (_dimension(length=2, mass=1),)),
        Kind("force", "N", "1 kN", (_dimension(length=1, mass=1, time=-2),)),
        Kind("moment", "N m", "10 N m", (_dimension(length=2, mass=1, time=-2),)),
        Kind("angular speed", "rad/s", "1500 rpm", (_dimension(time=-1, angle=1),)),
        Kind("speed", "m/s", "50 mm/s", (_dimension(length=1, time=-1),)),
        Kind("acceleration", "m/s^2", "9.81 m/s^2", (_dimension(length=1, time=-2),)),
        Kind("stiffness", "N/m", "2 N/mm", (_dimension(mass=1, time=-2),)),
        Kind("torsional stiffness", "N m/rad", "3 N m/rad", (_dimension(length=2, mass=1, time=-2, angle=-1),)),
        Kind("damping", "N s/m", "50 N s/m", (_dimension(mass=1, time=-1),)),
        Kind("pressure", "Pa", "210 GPa", (_dimension(length=-1, mass=1, time=-2),)),
        Kind("torsional damping", "N m s/rad", "0.1 N m s/rad", (_dimension(length=2, mass=1, time=-1, angle=-1),)),
    )
}
ANY = Kind("quantity", "SI", "60 mm", ())


def fits(dimension: Dimension, other: Dimension) -> bool:
    """Whether a value of `dimension` can stand for `other`: equal, angles and pure numbers being one beside others.

    A pure number can be an angle (an arc over a radius), an angle cannot be a pure number.
    """
    return dimension[:3] == other[:3] and (any(other[:3]) or other[3] != 0 or dimension[3] == 0)


def si_unit(dimension: Dimension | None) -> str:
    """SI unit of a dimension; empty for a plain number, whose unit only its use tells."""
    if dimension is None:
        return ""
    known = next((kind.unit for kind in KINDS.values() if dimension in kind.dimensions), None)
    return known or dimension_text(dimension).removeprefix("in ")


def dimension_text(dimension: Dimension) -> str:
    """A dimension in words: `a length`, `an angle`, else its SI unit."""
    for kind in KINDS.values():
        if dimension in kind.dimensions:
            return f"{'an' if kind.name[0] in 'aeiou' else 'a'} {kind.name}"
    symbols = zip(("m", "kg", "s", "rad"), dimension, strict=True)
    parts = [name if power == 1 else f"{name}^{power}" for name, power in symbols if power]
    return f"in {' '.join(parts)}"


@cache
def _registry() -> pint.UnitRegistry[Fraction]:
    """pint with exact rational factors: 93.782 mm is the float nearest 0.093782."""
    import pint

    registry: pint.UnitRegistry[Fraction] = pint.UnitRegistry(non_int_type=Fraction)
    registry.define("@alias turn = rev")
    return registry


_PI = Fraction("3.1415926535897932384626433832795028841971693993751")  # as pint has it
_M, _RAD, _S = {"meter": Fraction(1)}, {"radian": Fraction(1)}, {"second": Fraction(1)}
_NEWTON = {"gram": Fraction(1), "meter": Fraction(1), "second": Fraction(-2)}
_JOULE = {"gram": Fraction(1), "meter": Fraction(2), "second": Fraction(-2)}
_WATT = {"gram": Fraction(1), "meter": Fraction(2), "second": Fraction(-3)}
_PASCAL = {"gram": Fraction(1), "meter": Fraction(-1), "second": Fraction(-2)}
_VOLT = {"gram": Fraction(1), "meter": Fraction(2), "second": Fraction(-3), "ampere": Fraction(-1)}
# of the units in most models: name and root as pint has them, factor to SI; a test holds them against pint
_COMMON: dict[str, tuple[str, Fraction, dict[str, Fraction]]] = {
    "mm": ("millimeter", Fraction(1, 1000), _M),
    "cm": ("centimeter", Fraction(1, 100), _M),
    "m": ("meter", Fraction(1), _M),
    "um": ("micrometer", Fraction(1, 10**6), _M),
    "µm": ("micrometer", Fraction(1, 10**6), _M),
    "deg": ("degree", _PI / 180, _RAD),
    "turn": ("turn", 2 * _PI, _RAD),
    "rad": ("radian", Fraction(1), _RAD),
    "rpm": ("revolutions_per_minute", _PI / 30, {"radian": Fraction(1), "second": Fraction(-1)}),
    "kg": ("kilogram", Fraction(1), {"gram": Fraction(1)}),
    "g": ("gram", Fraction(1, 1000), {"gram": Fraction(1)}),
    "s": ("second", Fraction(1), _S),
    "ms": ("millisecond", Fraction(1, 1000), _S),
    "N": ("newton", Fraction(1), _NEWTON),
    "mN": ("millinewton", Fraction(1, 1000), _NEWTON),
    "kN": ("kilonewton", Fraction(1000), _NEWTON),
    "W": ("watt", Fraction(1), _WATT),
    "J": ("joule", Fraction(1), _JOULE),
    "Pa": ("pascal", Fraction(1), _PASCAL),
    "MPa": ("megapascal", Fraction(10**6), _PASCAL),
    "GPa": ("gigapascal", Fraction(10**9), _PASCAL),
    "bar": ("bar", Fraction(10**5), _PASCAL),
    # of the settings of a test rig
    "V": ("volt", Fraction(1), _VOLT),
    "mV": ("millivolt", Fraction(1, 1000), _VOLT),
    "Hz": ("hertz", Fraction(1), {"second": Fraction(-1)}),
    "kHz": ("kilohertz", Fraction(1000), {"second": Fraction(-1)}),
    "%": ("percent", Fraction(1, 100), {}),
}
_FACTOR = re.compile(r"([^\W\d]+|%)(?:\^(-?[1-9]))?")
_PRODUCT_OF_COMMON = re.compile(rf"(?:1 ?/ ?)?{_FACTOR.pattern}(?: ?[ */] ?{_FACTOR.pattern})*")


def _common(spaced: str) -> tuple[Fraction, dict[str, Fraction], tuple[str, ...]] | None:
    """`root` of a product of the units in `_COMMON`, each once, without pint; None of any other."""
    spaced = spaced[1:-1] if re.fullmatch(r"\([^()]*\)", spaced) else spaced
    if found := re.fullmatch(r"([^()]*/) ?\(([^()^]*)\)", spaced):  # mV/(N m) is mV/N/m, V/(rad/s) is V/rad*s
        spaced = found[1] + re.sub(r" ?([ */]) ?", lambda sign: "*" if sign[1] == "/" else "/", found[2].strip())
    if not _PRODUCT_OF_COMMON.fullmatch(spaced):
        return None
    total, exponents, names = Fraction(1), dict[str, Fraction](), list[str]()
    for one in _FACTOR.finditer(spaced):
        if one[1] not in _COMMON:
            return None
        name, factor, base = _COMMON[one[1]]
        power = int(one[2] or 1) * (-1 if spaced[: one.start()].rstrip().endswith("/") else 1)
        total *= factor**power
        names.append(name)
        for symbol, exponent in base.items():
            exponents[symbol] = exponents.get(symbol, Fraction(0)) + power * exponent
    if len(set(names)) < len(names):
        return None
    return total, {one: exponent for one, exponent in exponents.items() if exponent}, tuple(names)


MOST_POWER = 1000  # of all powers in a unit, one on the other
# one power, not itself raised to another
_POWER = re.compile(r"(?:\*\*|\^)\s*\(?\s*[+-]?\s*(\d{1,2})(?:[./]\d{1,2})?\s*\)?(?!\s*(?:\*\*|\^)|[\d.])")
_LONG = re.compile(r"\d{20}|[⁰¹²³⁴⁵⁶⁷⁸⁹]{3}|.{200}")
_PRODUCT = "write a product of a number and a dimension as 2 * AB"


def _known_to_pint(word: str) -> str:
    """The name that pint has for a word; empty if it has none."""
    try:
        return " ".join(str(name).replace("_", " ") for name in _registry().parse_units(word)._units)
    except Exception:  # see `root`
        return ""


def _check_spelling(text: str, spaced: str) -> None:
    """UnitError for a word that is no unit in common use, whatever pint would make of it."""
    strange = strange_sign(spaced)
    word = next((one for one in words(spaced) if one not in READ), None)
    if word is None and not strange:
        return
    meant = remedy_for(text, word or "")
    if word is None or not (name := _known_to_pint(word)):
        raise UnitError(f"the unit '{text}' is not known", meant)
    told = "" if word == text else f", of which '{word}'"
    same = "is" if name == word else f"would be {name}, which is"
    raise UnitError(f"the unit '{text}'{told} {same} not in common use", meant)


def _check_powers(text: str, spaced: str) -> None:
    """UnitError for powers and numbers that no unit has: pint works them out to the last digit."""
    product = 1
    for power in _POWER.findall(spaced):
        product *= max(1, int(power))
    if re.search(r"\*\*|\^", _POWER.sub("", spaced)) or product > MOST_POWER or _LONG.search(spaced):
        raise UnitError(f"the unit '{text[:60]}' is not known", "write powers as m^2 or s^-1")


@cache
def root(text: str) -> tuple[Fraction, dict[str, Fraction], tuple[str, ...]]:
    """Factor to SI, exponents by base unit of pint, and the units named, of any unit in use; UnitError if none."""
    spaced = plain(text)
    if known := _common(spaced):
        return known
    registry = _registry()
    _check_spelling(text, spaced)
    _check_powers(text, spaced)
    try:
        parsed = registry.parse_units(spaced)
        factor, base = registry.get_root_units(parsed)
    except Exception as error:  # pint raises its own, tokenizer and arithmetic errors on text that is no unit
        raise UnitError(f"the unit '{text}' is not known", remedy_for(text, "")) from error
    exponents = {str(name): Fraction(str(power)) for name, power in base._units.items()}
    to_si = Fraction(str(factor)) / Fraction(1000) ** int(exponents.get("gram", 0))
    return to_si, exponents, tuple(str(name) for name in parsed._units)


@cache
def unit(text: str) -> tuple[Fraction, Dimension]:
    """Factor to SI and dimension of a unit such as `N m`, `kg m^2`, `rpm`; UnitError if it is none of mechanics."""
    try:
        factor, exponents, names = root(text)
    except UnitError as error:  # in a model the word may be a dimension's name
        near = error.remedy.startswith("did you mean")
        raise UnitError(error.what, f"{error.remedy} ({_PRODUCT})" if near else error.remedy or _PRODUCT) from None
    order = ("meter", "gram", "second", "radian")
    if set(exponents) - set(order):
        raise UnitError(f"the unit '{text}' is not one of mechanics", "use units of length, mass, time and angle")
    length, mass, time, angle = (exponents.get(name, Fraction(0)) for name in order)
    dimension = (length, mass, time, angle)
    per_time = dimension == _dimension(time=-1) and factor != 1
    if per_time or any(name.endswith("hertz") for name in names):
        raise UnitError(f"the unit '{text}' may count turns or radians", "write an angular speed in rpm or rad/s")
    return factor, dimension
