"""Kinds of quantity (length, moment, …), the units that files may write them in, and those that numbers are shown in.

A dimension is the exponents of (length, mass, time, angle). Angle counts as one, although SI calls it a pure
number, so that 30 deg is not taken for a length nor 30 mm for an angle; beside other dimensions it drops out
(N m/rad is N m). Only the spellings of the table of units are read, those in common use: a library that puts every
prefix before every unit takes `Grad` for a giga-radian and `Min` for a million inches.

Shown is SI with prefixes, or feet, inches and pounds if the model states those: all sentences, tables and pictures ask
one formatter (`results.quantities`), which asks here within `shown_as`. Files keep their units.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from types import MappingProxyType
from typing import Any, Final, Literal

from trunnion.model.names import nearest

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
    (a driver's speed is a speed or an angular speed, by its joint), any if empty; either: the kinds of which it is one.
    """

    name: str
    unit: str
    example: str
    dimensions: tuple[Dimension, ...] = field(repr=False, hash=False)  # fractions are slow to hash
    either: tuple[Kind, ...] = field(default=(), repr=False, hash=False)

    @property
    def with_article(self) -> str:
        """Its name as a message has it: a length, an angle."""
        return f"{'an' if self.name[0] in 'aeiou' else 'a'} {self.name}"

    def __or__(self, other: Kind) -> Kind:
        """A quantity that may be either, until its place says which."""
        name, unit = f"{self.name} or {other.name}", f"{self.unit} or {other.unit}"
        return Kind(name, unit, self.example, self.dimensions + other.dimensions, (self, other))

    def of(self, turns: bool) -> Kind:
        """Which of two it is, of what turns or of what slides."""
        return next((kind for kind in self.either if (kind.name in TURNING) == turns), self)

    def accepts(self, dimension: Dimension | None) -> bool:
        """Whether a value of this dimension (None: a plain number, unknown) can stand here."""
        return dimension is None or not self.dimensions or any(fits(dimension, other) for other in self.dimensions)


TURNING = ("angle", "angular speed", "moment", "moment of inertia", "torsional stiffness", "torsional damping")
KINDS: dict[str, Kind] = {
    name: Kind(name, si, example, (_dimension(*powers),))  # powers: of length, mass, time and angle
    for name, si, example, *powers in (
        ("number", "1", "0.1"),
        ("length", "m", "60 mm", 1),
        ("angle", "rad", "30 deg", 0, 0, 0, 1),
        ("mass", "kg", "1.2 kg", 0, 1),
        ("time", "s", "0.2 s", 0, 0, 1),
        ("moment of inertia", "kg m^2", "4e-4 kg m^2", 2, 1),
        ("force", "N", "1 kN", 1, 1, -2),
        ("moment", "N m", "10 N m", 2, 1, -2),
        ("angular speed", "rad/s", "1500 rpm", 0, 0, -1, 1),
        ("speed", "m/s", "50 mm/s", 1, 0, -1),
        ("acceleration", "m/s^2", "9.81 m/s^2", 1, 0, -2),
        ("stiffness", "N/m", "2 N/mm", 0, 1, -2),
        ("torsional stiffness", "N m/rad", "3 N m/rad", 2, 1, -2, -1),
        ("damping", "N s/m", "50 N s/m", 0, 1, -1),
        ("density", "kg/m^3", "7850 kg/m^3", -3, 1),
        ("pressure", "Pa", "210 GPa", -1, 1, -2),
        ("torsional damping", "N m s/rad", "0.1 N m s/rad", 2, 1, -1, -1),
    )
}
ANY = Kind("quantity", "SI", "60 mm", ())


def fits(dimension: Dimension, other: Dimension) -> bool:
    """Whether a value of `dimension` can stand for `other`: equal, angles and pure numbers being one beside others.

    A pure number can be an angle (an arc over a radius), an angle cannot be a pure number.
    """
    return dimension[:3] == other[:3] and (any(other[:3]) or other[3] != 0 or dimension[3] == 0)


def si_unit(dimension: Dimension) -> str:
    """SI unit of a dimension."""
    unit_of_kind = next((kind.unit for kind in KINDS.values() if dimension in kind.dimensions), None)
    return unit_of_kind or dimension_text(dimension).removeprefix("in ")


def dimension_text(dimension: Dimension) -> str:
    """A dimension in words: `a length`, `an angle`, else its SI unit."""
    for kind in KINDS.values():
        if dimension in kind.dimensions:
            return kind.with_article
    symbols = zip(("m", "kg", "s", "rad"), dimension, strict=True)
    parts = [name if power == 1 else f"{name}^{power}" for name, power in symbols if power]
    return f"in {' '.join(parts)}"


# ---- the table ------------------------------------------------------------------------------------------------

BASES = ("m", "kg", "s", "rad", "A", "K", "count")
# A unit in a line: symbols, each with the prefixes that it takes in brackets; what one of it is; words, which may be
# plural, of those with a star with micro, milli, kilo and mega. Prefixes are few: krad and Mm are slips of the pen.
_TABLE: Final = """
m(n µ m c d k)          |                 | meter* metre*
kg                      |                 |
g(µ m)                  | 0.001 kg        | gram*
s(n µ m) sec secs       |                 | second*
rad(µ m)                |                 | radian
A(n µ m k)              |                 | ampere*
K(m)                    |                 | kelvin
                        |                 | count
°C degC degree_Celsius  | 1 K             |
min mins                | 60 s            | minute
h hr hrs                | 60 min          | hour
d                       | 24 h            | day
msec                    | 0.001 s         |
usec                    | 1e-6 s          |
                        | 1e-6 m          | micron
                        | 0.01 m          | centimeter centimetre
N(µ m c da k M)         | 1 kg m/s^2      | newton*
Pa(h k M G)             | 1 N/m^2         | pascal*
bar(m)                  | 1e5 Pa          |
J(m k M)                | 1 N m           | joule*
W(µ m k M)              | 1 J/s           | watt*
Wh(k)                   | 1 W h           |
Hz(k M) hertz(kilo mega) | 1 s^-1         |
V(µ m k)                | 1 W/A           | volt*
                        | 1 A s           | coulomb*
pC                      | 1e-12 A s       |
nC                      | 1e-9 A s        |
µC μC uC                | 1e-6 A s        |
F(p n µ)                | 1 A s/V         | farad*
Ω(m k M) ohm(k M)       | 1 V/A           | ohm*
T(m)                    | 1 V s/m^2       | tesla*
l(m) L(m)               | 0.001 m^3       | liter* litre*
cc                      | 1 cm^3          |
rev revs                | 6.2831853071795864769252867665590057683943387987502 rad | turn revolution
deg °                   | 1/360 rev       | degree
gon                     | 1/400 rev       |
arcmin                  | 1/60 deg        | arcminute
arcsec                  | 1/60 arcmin     | arcsecond
                        | 0.001 rad       | milliradian
                        | 1e-6 rad        | microradian
rpm                     | 1 rev/min       |
rps                     | 1 rev/s         |
t                       | 1000 kg         | tonne
kgf                     | 9.80665 N       |
gf                      | 0.001 kgf       |
dyn                     | 1e-5 N          |
in(µ) inch inches       | 0.0254 m        |
ft foot feet            | 12 in           |
yd                      | 3 ft            | yard
mi                      | 1760 yd         | mile
thou                    | 0.001 in        |
lb lbs                  | 0.45359237 kg   | pound
oz                      | 1/16 lb         |
lbf(k)                  | 0.45359237 kgf  |
ozf                     | 1/16 lbf        |
kip                     | 1000 lbf        |
slug                    | 1 lbf s^2/ft    | slug
psi                     | 1 lbf/in^2      |
ksi                     | 1 kip/in^2      |
atm                     | 101325 Pa       |
hp                      | 550 ft lbf/s    |
mph                     | 1 mi/h          |
kph                     | 1 km/h          |
cSt                     | 1 mm^2/s        |
ε(µ)                    | 1               | strain
                        | 1e-6            | microstrain
% percent               | 0.01            |
‰                       | 0.001           |
ppm                     | 1e-6            |
"""
_PREFIXES: Final = {
    "p": "1e-12", "n": "1e-9", "µ": "1e-6", "μ": "1e-6", "u": "1e-6", "m": "0.001", "c": "0.01", "d": "0.1",
    "": "1", "da": "10", "h": "100", "k": "1000", "M": "1e6", "G": "1e9",
    "micro": "1e-6", "milli": "0.001", "kilo": "1000", "mega": "1e6",
}  # fmt: skip
Root = tuple[Fraction, dict[str, Fraction], frozenset[str]]  # factor to SI, exponents of BASES, names of units
_SYMBOL = re.compile(r"([^\s(]+)(?:\(([^)]*)\))?")


@cache
def _spellings() -> dict[str, tuple[str, str, str]]:
    """Every spelling with its prefix, what one of the unit is, and its name: its first symbol, else its first word."""
    spellings: dict[str, tuple[str, str, str]] = {}
    for line in _TABLE.strip().splitlines():
        first, definition, last = (part.strip() for part in line.split("|"))
        symbols, words = dict(_SYMBOL.findall(first)), last.split()
        name = next(iter(symbols), "") or words[0].strip("*")
        # micro has two signs in Unicode, and none on most keyboards
        prefixed = {f"{before}{symbol}": before for symbol, prefixes in symbols.items()
                    for before in ("", *prefixes.replace("µ", "µ μ u").split())}  # fmt: skip
        for word in words:
            metric = ("", "micro", "milli", "kilo", "mega") if word.endswith("*") else ("",)
            prefixed |= {f"{before}{word.strip('*')}{end}": before for before in metric for end in ("", "s")}
        spellings |= {text: (before, definition, name) for text, before in prefixed.items()}
    return spellings


@cache
def _named(word: str) -> Root:
    """What a spelling, or 1, stands for; KeyError if it is none."""
    if word == "1":
        return Fraction(1), {}, frozenset()
    before, definition, name = _spellings()[word]
    number, _, product = definition.partition(" ")
    factor, exponents, _names = _product(product or "1")[0]
    size = Fraction(_PREFIXES[before]) * Fraction(number or 1) * factor
    return size, exponents if definition else {name: Fraction(1)}, frozenset({name})


# ---- reading --------------------------------------------------------------------------------------------------

_WORD = re.compile(r"[^\W\d]\w*|°\w*|[%‰]")
_FACTOR = re.compile(rf"\s*(?P<sign>[*/.]?)\s*(?P<word>{_WORD.pattern}|1(?![\d.])|\()")
_POWER = re.compile(
    r"\s*(?:\^|\*\*)\s*(?:\(\s*([-+]?\s*\d{1,2}(?:[./]\d{1,2})?)\s*\)|([-+]?\s*\d{1,2}(?:\.\d{1,2})?))(?![\d.])"
)
MOST_DIGITS = 100_000  # binary, of a factor: powers of powers have many
MOST_SIGNS = 200
_FORMS = "write a unit as N m, kg/m^3 or s^-1"


def _product(text: str, begin: int = 0) -> tuple[Root, int]:
    """A product of units from a place on, and where it ends; ValueError, KeyError, ArithmeticError if it is none."""
    factor, exponents, names, place = Fraction(1), dict.fromkeys(BASES, Fraction(0)), frozenset[str](), begin
    while item := _FACTOR.match(text, place):
        if item["sign"] and place == begin:
            raise ValueError(text)
        if item["word"] == "(":
            (size, powers, named), place = _product(text, item.end())
            place = text.index(")", place) + 1
        else:
            (size, powers, named), place = _named(item["word"]), item.end()
        raised = _POWER.match(text, place)
        power = Fraction("".join((raised[1] or raised[2]).split())) if raised else Fraction(1)
        power, place = -power if item["sign"] == "/" else power, raised.end() if raised else place
        if abs(power) * (size.numerator.bit_length() + size.denominator.bit_length()) > MOST_DIGITS:
            raise ValueError(text)
        factor *= size ** int(power) if power.denominator == 1 else Fraction(float(size) ** float(power))
        for base, exponent in powers.items():
            exponents[base] += power * exponent
        names |= named
    place += len(text[place:]) - len(text[place:].lstrip())
    if place == begin or text[place : place + 1] not in ("", ")"):
        raise ValueError(text)
    return (factor, {base: power for base, power in exponents.items() if power}, names), place


@cache
def root(text: str) -> Root:
    """What a unit in use is: factor to SI, exponents by `BASES`, the units named in it; UnitError if it is none."""
    written = _plain(text).strip()
    try:
        if len(text) > MOST_SIGNS:
            raise ValueError(text)
        product, end = _product(written or "1")
        if end < len(written):
            raise ValueError(text)
    except (ValueError, LookupError, ArithmeticError):
        word = next((name for name in _WORD.findall(written) if name not in _spellings()), "")
        remedy = _remedy(text, word) or ("" if word else _FORMS)
        raise UnitError(f"the unit '{text[:60]}' is not known", remedy) from None
    return product


@cache
def unit(text: str) -> tuple[Fraction, Dimension]:
    """Factor to SI and dimension of a unit such as `N m`, `kg m^2`, `rpm`; UnitError if it is none of mechanics."""
    try:
        factor, exponents, names = root(text)
    except UnitError as error:  # in a model the word may be a dimension's name
        raise UnitError(error.what, error.remedy or _PRODUCT) from None
    if exponents.keys() - set(BASES[:4]):
        raise UnitError(f"the unit '{text}' is not one of mechanics", "use units of length, mass, time and angle")
    length, mass, time, angle = (exponents.get(base, Fraction(0)) for base in BASES[:4])
    dimension = (length, mass, time, angle)
    if "Hz" in names or (dimension == _dimension(time=-1) and factor != 1):
        raise UnitError(f"the unit '{text}' may count turns or radians", "write an angular speed in rpm or rad/s")
    return factor, dimension


# ---- spellings ------------------------------------------------------------------------------------------------

_PRODUCT = "write a product of a number and a dimension as 2 * AB"
# Signs an engineer's keyboard or word processor makes of - * ^2; the minus of a superscript included.
_SIGNS = str.maketrans({"−": "-", "–": "-", "×": "*", "⋅": "·"})
_SUPERSCRIPT = re.compile("⁻?[⁰¹²³⁴⁵⁶⁷⁸⁹]")
_DIGITS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def normalise(text: str) -> str:
    """The text with typographic signs as plain ones: − – × as - *, m² as m^2."""
    return _SUPERSCRIPT.sub(lambda match: "^" + match[0].translate(_DIGITS), text.translate(_SIGNS))


# Those that a misspelt one is compared with.
_USUAL: Final = (
    "mm cm m µm km in ft deg rad mrad kg g mg t lb s ms min N mN kN MN lbf Pa kPa MPa GPa bar psi J kJ W kW rpm "
    "V mV A mA Hz kHz gon rev turn"
)
# What other spellings are likely to mean, by what to write.
_MEANT: Final = {
    spelling: remedy
    for remedy, spellings in {
        "write deg for degrees, 360 to a turn, or gon, 400 to a turn": "grad grade grads gradian grd altgrad",
        "write rpm, or rad/s": "u r umin tr upm cps umdr", "write turn, or Hz": "cycle cycles",
        "write t for 1000 kg, or lb": "ton tons", "write kgf, or N": "kp", "write kW; 1 PS are 0.7355 kW": "ps",
        "write thou for 0.001 in, or mrad for an angle": "mil mils", "write MPa, or Pa s for a viscosity": "mpa",
        "write kN for a force, km/h for a speed": "kn", "write N m for a torque, nm for a length": "nm",
    }.items() for spelling in spellings.split()
}  # fmt: skip
_PHRASES: Final = {  # whole units, without their spaces
    re.compile(r"[uUrR](pm|PM)?/[Mm]in\.?|[Mm]in(-1|⁻¹)|[1I]?/[Mm]in\.?"): "write rpm, or rad/s",
    re.compile(r"[uUrR]/s|s(-1)"): "write rad/s, rpm or Hz",
    re.compile(r"(.*/)?[Hh]{1,2}:[Mm]{2}(:[Ss]{2})?.*"): "write s",
}
_TORQUE = re.compile(r"(?<![\w])((?:[mkMcµμu]|da)?)N(mm|cm|m)(?!\w)([\^*]?)")
_TURNS = re.compile(r"(?<![\w])(?:U|Umdr\.?)\s?/\s?(?=(?:min|s)(?!\w))")
_POUND_FEET = re.compile(r"(?<!\w)(?:(ft|in)[- .·⋅*]?(lb|oz)[fs]?|(lb|oz)[fs]?[- .·⋅*]?(ft|in))(?!\w)")
_SECOND = re.compile(r"(?<![\w])[Ss]ek\b\.?|(?<![\w])[Ss]ec\.")


def _plain(text: str) -> str:
    """A unit in plain signs and spaces: `N m` for `Nm`, `rev/min` for `U/min`, `s` for `Sek.`, `m^2` for `m²`.

    In `mV/Nm` both are below the stroke.
    """

    def torque(match: re.Match[str]) -> str:
        product = f"{match[1]}N {match[2]}"
        return f"{product}{match[3]}" if match[3] else f"({product})"

    spaced = _TURNS.sub("rev/", _TORQUE.sub(torque, normalise(text)))
    return _SECOND.sub("s", spaced).replace("·", "*")


def pound_feet(text: str) -> str:
    """A unit of a sensor with its torques of pounds and feet written out: `lbf ft` for `ft-lb`, `ft lb` and `lb-ft`.

    Not of a model's: a minus may stand there, and `lb ft` is a mass times a length. No sensor measures that.
    """
    return _POUND_FEET.sub(lambda match: f"({match[2] or match[3]}f {match[1] or match[4]})", text)


def _remedy(text: str, word: str) -> str:
    """What to write instead of a unit with a word that is none; empty where nothing is near."""
    bare, near = "".join(text.split()), nearest(word, _USUAL.split())
    phrase = next((remedy for phrase, remedy in _PHRASES.items() if phrase.fullmatch(bare)), "")
    return phrase or _MEANT.get(word.casefold(), "") or (near if near.startswith("did you mean") else "")


# ---- in which units numbers are shown ---------------------------------------------------------------------------

ScreenUnits = Mapping[str, tuple[float, str]]  # SI unit → factor and unit in which a number of it is shown
ANGLES = {"rad": "deg"}  # where no angle is stated; nobody reads radians
LENGTHS = {**dict.fromkeys(("ft", "foot", "feet"), "ft"), **dict.fromkeys(("in", "inch", "inches"), "in"), "yd": "ft"}
POUNDS = re.compile(r"\b(lbf|ozf|kip|lbs?|oz|slug|psi|ksi|hp)\b")
_NONE: ScreenUnits = MappingProxyType({})
_IN_USE: ContextVar[ScreenUnits] = ContextVar("units in use", default=_NONE)


def stated_units(mechanism: Any) -> dict[str, str]:
    """The unit that a mechanism states most often, for each unit of SI: {"m": "mm", "rad": "deg"}."""
    if "stated_units" not in mechanism.worked_out:
        entries = [entry for entry in mechanism.parameter_set.entries.values() if not entry.alias]
        stated = [entry.quantity.unit for entry in entries if entry.quantity.unit[:1] not in ("", "1", "%", "‰")]
        units: dict[str, str] = {}
        for text, _ in Counter(stated).most_common():
            units.setdefault(si_unit(unit(text)[1]), text)
        mechanism.worked_out["stated_units"] = {si: text for si, text in (ANGLES | units).items() if si != text}
    return dict(mechanism.worked_out["stated_units"])


def _customary(units_stated: Mapping[str, str]) -> ScreenUnits:
    """Feet or inches for lengths that are stated so, pounds for forces, and what follows of both."""
    length = LENGTHS.get(units_stated.get("m", ""), "")
    pounds = any(POUNDS.search(units_stated.get(si, "")) for si in ("N", "N m", "kg", "Pa", "N/m", "W"))
    units = {"m": length, "m/s": f"{length}/s", "m/s^2": f"{length}/s^2"} if length else {}
    if pounds:
        force = units_stated["N"] if POUNDS.search(units_stated.get("N", "")) else "lbf"
        torque = units_stated["N m"] if POUNDS.search(units_stated.get("N m", "")) else f"{force} {length or 'ft'}"
        units |= {"N": force, "N m": torque, "J": torque, "W": f"{torque}/s", "Pa": "psi", "N s": f"{force} s"}
        units |= {"N/m": f"{force}/{length or 'ft'}"}
        units |= {si: units_stated[si] for si in ("W", "Pa") if POUNDS.search(units_stated.get(si, ""))}
    return {si: (1 / float(unit(text)[0]), text.replace("^2", "²")) for si, text in units.items()}


def in_use() -> ScreenUnits:
    """The units in use; what is not among them is shown in SI."""
    return _IN_USE.get()


def follow(units: Mapping[str, str]) -> None:
    """Show numbers as a model has them from now on: all of a run of the command line is about one."""
    _IN_USE.set(_customary(units))


@contextmanager
def shown_as(units: Mapping[str, str]) -> Iterator[None]:
    """Show numbers as a model has them, by its stated units."""
    token = _IN_USE.set(_customary(units))
    try:
        yield
    finally:
        _IN_USE.reset(token)


def stated_by(arguments: Iterable[Any]) -> Mapping[str, str] | None:
    """The stated units of the first model or result among the arguments of a call; None if there is none."""
    for argument in arguments:
        if hasattr(type(argument), "worked_out"):
            return stated_units(argument)
        if isinstance(units := getattr(argument, "attrs", {}), Mapping) and "model_units" in units:
            return dict(json.loads(units["model_units"] or "{}"))
    return None
