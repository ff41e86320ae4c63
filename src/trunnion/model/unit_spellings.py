"""Which spellings of units are read: those in common use. What pint makes of any other is not what its writer meant.

pint puts every prefix before every unit it knows: `Grad` is a giga-radian to it, `Min` a million inches, `daNm` a
length over a mass. So only the spellings listed here are read, and another one is told with what it would have been.
"""

from __future__ import annotations

import re
from typing import Final

from trunnion.model.names import nearest

__all__ = ["READ", "USUAL", "plain", "pound_feet", "remedy_for", "strange_sign", "words"]

# prefixes of each symbol; an angle has none but in mrad and µrad, so that Grad is no giga-radian
_SYMBOLS: Final = {
    "m": "n µ m c d k", "g": "µ m k", "s": "n µ m", "min": "", "h": "", "d": "",
    "N": "µ m c da k M", "Pa": "h k M G", "bar": "m", "J": "m k M", "W": "µ m k M", "Wh": "k",
    "rad": "µ m", "deg": "", "°": "", "gon": "", "arcmin": "", "arcsec": "", "rpm": "", "rps": "",
    "Hz": "k M", "V": "µ m k", "A": "n µ m k", "C": "p n µ", "F": "p n µ", "Ω": "m k M", "ohm": "k M", "T": "m",
    "K": "m", "°C": "", "l": "m", "L": "m", "cc": "", "t": "", "kgf": "", "gf": "", "dyn": "",
    "in": "µ", "ft": "", "yd": "", "mi": "", "thou": "", "lb": "", "lbs": "", "oz": "", "lbf": "k", "ozf": "",
    "kip": "", "slug": "", "psi": "", "ksi": "", "atm": "", "hp": "", "mph": "", "kph": "", "cSt": "", "ε": "µ",
    "%": "", "‰": "", "ppm": "",
}  # fmt: skip
_NO_SYMBOL = {"C"}  # without a prefix: a temperature as likely as a charge
_SPELT_OUT: Final = (
    "meter metre gram second newton pascal joule watt hertz volt ampere coulomb farad ohm tesla liter litre"
)
_WORDS: Final = (
    "minute hour day degree radian milliradian microradian turn revolution arcminute arcsecond inch foot yard mile "
    "pound slug micron centimeter centimetre tonne percent count strain microstrain kelvin"
)
_MORE: Final = (
    "sec secs msec usec mins hr hrs rev revs feet inches kelvin degC degree_Celsius rpm strain microstrain hours days"
)


def _read() -> frozenset[str]:
    found = set(_MORE.split())
    for symbol, prefixes in _SYMBOLS.items():
        found |= set() if symbol in _NO_SYMBOL else {symbol}
        for prefix in prefixes.split():  # micro has two signs in Unicode, and none on most keyboards
            found |= {f"{one}{symbol}" for one in (("µ", "μ", "u") if prefix == "µ" else (prefix,))}
    names = [*_WORDS.split(), *_SPELT_OUT.split()]
    names += [f"{prefix}{name}" for name in _SPELT_OUT.split() for prefix in ("micro", "milli", "kilo", "mega")]
    return frozenset({*found, *names, *(f"{name}s" for name in names)})


READ: Final = _read()
# Those that a misspelt one is compared with.
USUAL: Final = (
    "mm cm m µm km in ft deg rad mrad kg g mg t lb s ms min N mN kN MN lbf Pa kPa MPa GPa bar psi J kJ W kW rpm "
    "V mV A mA Hz kHz gon rev turn"
)
_DEGREES = "write deg for degrees, 360 to a turn, or gon, 400 to a turn"
_SPEED = "write rpm, or rad/s"
# What other spellings are likely to mean.
_MEANT: Final = {
    "grad": _DEGREES, "grade": _DEGREES, "grads": _DEGREES, "gradian": _DEGREES, "altgrad": "write deg",
    "mil": "write thou for 0.001 in, or mrad for an angle", "mils": "write thou for 0.001 in, or mrad for an angle",
    "ton": "write t for 1000 kg, or lb", "tons": "write t for 1000 kg, or lb", "kp": "write kgf, or N",
    "ps": "write kW; 1 PS are 0.7355 kW", "mpa": "write MPa for a pressure, Pa s for a viscosity", "gon": "write gon",
    "c": "write °C for a temperature, pC or nC for a charge",
    "a": "write A for ampere", "u": _SPEED, "r": _SPEED, "umin": _SPEED, "tr": _SPEED, "upm": _SPEED, "cps": _SPEED,
    "cycle": "write turn, or Hz", "cycles": "write turn, or Hz", "mdeg": "write it in deg, or mrad",
    "kn": "write kN for a force, km/h for a speed", "kt": "write km/h for a speed, kg or t for a mass",
    "g_n": "write m/s^2", "g_0": "write m/s^2", "zoll": "write in", "umdr": _SPEED, "nms": "write N m s",
    "ns": "write N s for a momentum, ns for a time", "std": "write h", "sekunden": "write s", "grd": _DEGREES,
    "knm": "write kNm", "nm": "write N m for a torque, nm for a length",
}  # fmt: skip
_PHRASES: Final = {  # whole units, without their spaces
    re.compile(r"[uUrR](pm|PM)?/[Mm]in\.?|[Mm]in(-1|⁻¹)|[1I]?/[Mm]in\.?"): _SPEED,
    re.compile(r"[uUrR]/s|s(-1)"): "write rad/s, rpm or Hz",
    re.compile(r"(.*/)?[Hh]{1,2}:[Mm]{2}(:[Ss]{2})?.*"): "write s",
}
_TORQUE = re.compile(r"(?<![\w])((?:[mkMcµμu]|da)?)N(mm|cm|m)(?!\w)([\^*]?)")
_TURNS = re.compile(r"(?<![\w])(?:U|Umdr\.?)\s?/\s?(?=(?:min|s)(?!\w))")
_POUND_FEET = re.compile(r"(?<!\w)(?:(ft|in)-(lb|oz)[fs]?|(lb|oz)[fs]?-(ft|in))(?!\w)")
_POUND_FEET_ALONE = re.compile(r"(?:(ft|in)[ .·⋅*]?(lb|oz)[fs]?|(lb|oz)[fs]?[ .·⋅*]?(ft|in))")
_SECOND = re.compile(r"(?<![\w])[Ss]ek\b\.?|(?<![\w])[Ss]ec\.")
_WORD = re.compile(r"[^\W\d]\w*|°\w*|%|‰|ε")
_SIGN = re.compile(r"[\s\d.*/^()·⋅+-]")


def plain(text: str) -> str:
    """A unit as pint reads it: `N m` for `Nm`, which is a measure of yarn to it, `rev/min` for `U/min`, `s` for `Sek.`.

    In `mV/Nm` both are below the stroke.
    """
    spaced = _TORQUE.sub(_torque, text)
    spaced = _SECOND.sub("s", _TURNS.sub("rev/", spaced))
    return spaced.replace("·", "*").replace("⋅", "*")


def pound_feet(text: str) -> str:
    """A unit of a sensor with its torques of pounds and feet written out: `lbf ft` for `ft-lb`, `ft lb` and `lb-ft`.

    Not of a model's: a minus may stand there, and `lb ft` is a mass times a length. No sensor measures that.
    """

    def product(found: re.Match[str]) -> str:
        return f"({found[2] or found[3]}f {found[1] or found[4]})"

    alone = _POUND_FEET_ALONE.fullmatch(text.strip())
    return product(alone) if alone else _POUND_FEET.sub(product, text)


def _torque(found: re.Match[str]) -> str:
    product = f"{found[1]}N {found[2]}"
    return f"{product}{found[3]}" if found[3] else f"({product})"


def words(text: str) -> list[str]:
    """The names in a unit."""
    return _WORD.findall(text)


def strange_sign(text: str) -> str:
    """A sign that stands in no unit; pint passes over some, and makes a product of what is beside them."""
    return _SIGN.sub("", _WORD.sub("", text))[:1]


def remedy_for(text: str, word: str) -> str:
    """What to write instead of a unit with a word that is none; empty where nothing is near."""
    bare = "".join(text.split())
    if told := next((remedy for phrase, remedy in _PHRASES.items() if phrase.fullmatch(bare)), ""):
        return told
    if told := _MEANT.get(word.casefold(), ""):
        return told
    near = nearest(word, USUAL.split())
    return near if near.startswith("did you mean") else ""
