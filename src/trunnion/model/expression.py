"""Expressions over named dimensions: `BE * cos(gamma)`, `90 deg - 0.1 deg`, `2*AB + 3 mm`.

A number directly followed by a unit is one literal. A unit is words with optional integer powers, joined by a
single space or by / * · without spaces (`N m`, `rad/s`, `kg m^2`); an operator with spaces around it calculates.
The text is cut into tokens here, each operand replaced by a placeholder, and what is left is parsed by the
standard library's `ast` over a whitelist of nodes: nothing of the text is ever executed.
"""

from __future__ import annotations

import ast
import operator as operators
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import reduce
from itertools import combinations
from typing import Final

import numpy as np

from trunnion.algebra.namespace import Number, namespace
from trunnion.model.units import ANGLE, NUMBER, Dimension, UnitError, dimension_text, fits, normalise, unit

MAX_LENGTH = 500
MAX_DEPTH = 40

_NUMBER = r"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?(?![0-9.])"  # whole: a part of a number is none
_WORD = r"(?:[^\W\d_]+|%|°[A-Za-z]?)(?!\w|\s*\()(?:(?:\^|\*\*)[-+]?[0-9](?:\.[0-9]{1,2})?(?![\w.]))?"
_UNIT = rf"(?:{_WORD})(?:[ /*·⋅](?:{_WORD}))*"
LITERAL = re.compile(rf"(?P<number>{_NUMBER})(?:\s*(?P<unit>{_UNIT})|\s+(?P<per>1/{_UNIT}))?")
_NAME = r"[^\W\d]\w*(?:\.[^\W\d]\w*\.[^\W\d]\w*|\.[^\W\d]\w+)?"  # also S.slide and ram.Q.x
_TOKEN = re.compile(rf"\s*(?:(?P<literal>{LITERAL.pattern})|(?P<name>{_NAME})|(?P<operator>\*\*|[-+*/^(),]))")
# 1500 min-1, as catalogues write a speed: here it is a difference
_RECIPROCAL = re.compile(rf"\s*{_NUMBER}\s*(?:{_UNIT}[ /*·])?(?P<power>(?P<unit>min|s)-[12])(?![\w.])")
_FRACTION = re.compile(rf"(?:([0-9]+)[- ])?([0-9]+)/([1-9][0-9]*)\s*({_UNIT})")  # 1/2 in, 1-1/2 in

Evaluator = Callable[[Mapping[str, Number]], Number]
Dimensions = Mapping[str, "Dimension | None"]


@dataclass(frozen=True)
class _Function:
    """A function of expressions: its name in the namespace, how many arguments, what it does to dimensions."""

    name: str
    arguments: tuple[int, int]
    takes: str  # "angle", "number" or "same": arguments of one dimension
    gives: str  # "angle", "number", "same" or "root"


_MANY = 20
FUNCTIONS: Final[Mapping[str, _Function]] = {
    "sin": _Function("sin", (1, 1), "angle", "number"),
    "cos": _Function("cos", (1, 1), "angle", "number"),
    "tan": _Function("tan", (1, 1), "angle", "number"),
    "asin": _Function("arcsin", (1, 1), "number", "angle"),
    "acos": _Function("arccos", (1, 1), "number", "angle"),
    "atan": _Function("arctan", (1, 1), "number", "angle"),
    "atan2": _Function("arctan2", (2, 2), "same", "angle"),
    "sqrt": _Function("sqrt", (1, 1), "same", "root"),
    "hypot": _Function("hypot", (2, 2), "same", "same"),
    "abs": _Function("abs", (1, 1), "same", "same"),
    "min": _Function("minimum", (2, _MANY), "same", "same"),
    "max": _Function("maximum", (2, _MANY), "same", "same"),
    "between": _Function("between", (3, 3), "same", "number"),
}
RESERVED = frozenset({"pi", *FUNCTIONS})  # names a dimension cannot have
MOTION = ("drive", "speed", "time")  # nor these: in loads, coordinate and rate of the first driver, and time
PLACED = "."  # in a name: of a joint or a point, as in the columns of a result: S.slide, ram.Q.x, O.rotation_velocity


@dataclass(frozen=True)
class Literal:
    """A number with its unit: value in SI, dimension; `unit` is empty for a bare number."""

    value: float
    dimension: Dimension
    unit: str


@dataclass(frozen=True)
class Term:
    """A part of an expression, compiled.

    value: of the values of the names; dimension: from the dimensions of the names; operands: what it is made of;
    parts: those below it; takes, gives: as a function has them, of terms too (of a literal, a name, a product or a
    power nothing).
    """

    value: Evaluator
    dimension: Callable[[Dimensions], Dimension | None]
    operands: tuple[Literal | str, ...]
    parts: tuple[Term, ...] = ()
    takes: str = ""
    gives: str = ""
    function: str = ""


@dataclass(frozen=True)
class Expression:
    """A parsed expression.

    text: as it is read; names: the dimensions it speaks of; evaluate: values of those (SI floats, arrays, duals) to a
    value; literal: set if it is nothing but one number with its unit (and perhaps a minus); bare: whether it has
    neither a unit nor a name in it; kinks: functions of the same values, where one of which changes its sign the value
    jumps or bends: at both ends of a `between`, of an `abs` …
    """

    text: str
    names: tuple[str, ...]
    evaluate: Evaluator
    literal: Literal | None
    bare: bool
    kinks: tuple[Evaluator, ...]
    term: Term = field(repr=False)

    def __reduce__(self) -> tuple[Callable[[str], Expression], tuple[str]]:
        """Compiled anew in another process: closures cannot be pickled."""
        return parse, (self.text,)

    def dimension(self, names: Dimensions) -> Dimension | None:
        """Dimension of the value, from those of the names (None: unknown); UnitError if terms do not fit."""
        return self.term.dimension(names)


def literal(number: str, unit_text: str) -> Literal:
    """The value of `number` times `unit_text` in SI, rounded once; UnitError if it has none."""
    value = float(number)
    factor, dimension = unit(unit_text) if unit_text else (Fraction(1), NUMBER)
    if value and np.isfinite(value):
        try:
            value = float(Fraction(number) * factor)
        except OverflowError:
            value = float("inf")
    if not np.isfinite(value):
        raise UnitError(f"the number {number} is too large", "give a finite number")
    return Literal(value, dimension, unit_text)


def parse(text: str) -> Expression:
    """Read an expression; UnitError says what is wrong with it. Never runs code."""
    if len(text) > MAX_LENGTH:
        raise UnitError(f"an expression of {len(text)} characters, {MAX_LENGTH} at most", "split it in dimensions")
    if fraction := _FRACTION.fullmatch(normalise(text).strip()):
        integer, over, under, unit_text = fraction.groups()
        literal(under, unit_text)  # UnitError for what is no unit
        size = int(integer or 0) + int(over) / int(under)
        raise UnitError(f"'{text}' divides by {under} {unit_text}", f"write {size:.12g} {unit_text}")
    source, operands = _tokens(normalise(text))
    try:
        depth = _depth(tree := ast.parse(source, mode="eval").body)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise UnitError(f"'{text}' cannot be read", "check operators and parentheses") from None
    if depth > MAX_DEPTH:
        raise UnitError(f"'{text[:40]}…' is nested too deeply", "split it in dimensions")
    term = _compile(tree, operands)
    names = dict.fromkeys(item for item in operands.values() if isinstance(item, str) and item not in RESERVED)
    literals = [operand for operand in operands.values() if isinstance(operand, Literal)]
    core = tree.operand if isinstance(tree, ast.UnaryOp) else tree
    alone = literals[0] if isinstance(core, ast.Name) and literals else None
    bare = len(literals) == len(operands) and not any(operand.unit for operand in literals)
    return Expression(text, tuple(names), term.value, alone, bare, tuple(_kinks(term)), term)


def _tokens(text: str) -> tuple[str, dict[str, Literal | str]]:
    """The text as Python source with placeholders `_0`, `_1`, … for operands, and what they stand for."""
    source: list[str] = []
    operands: dict[str, Literal | str] = {}
    place, after_operand = 0, False
    text = text.strip()
    while place < len(text):
        match = _TOKEN.match(text, place)
        if not match or (match["operator"] == "," and "(" not in source):
            rest = "," if match else text[place:].strip()[:20]
            raise UnitError(f"'{rest}' is not understood in '{text}'", _hint(text, place))
        if power := _RECIPROCAL.match(text, place):
            what = f"'{power['power']}' is {power['unit']} less {power['power'][-1]} in '{text}'"
            raise UnitError(what, "write an angular speed in rpm or rad/s, a power of a unit as s^-1")
        operator = match["operator"]
        if operator is not None:
            source.append("**" if operator == "^" else operator)
        elif after_operand:
            what = f"an operator is missing before '{match[0].strip()}' in '{text}'"
            raise UnitError(what, "write a product as 2 * AB, a quantity as 60 mm")
        else:
            source.append(f"_{len(operands)}")
            number = match["number"]
            operands[source[-1]] = literal(number, match["unit"] or match["per"] or "") if number else match["name"]
        after_operand = operator is None or operator == ")"
        place = match.end()
    return " ".join(source), operands


def _hint(text: str, place: int = 0) -> str:
    """The remedy that the commonest slips need. place: from which on nothing is understood."""
    if text[place : place + 1] == "." and re.search(r"[0-9]\s*[^\W\d_]+$", text[:place]):  # 10 N.m
        return f"write {text[:place]} {text[place + 1 :]}"
    if re.search(r"[0-9],[0-9]", text):
        return "write a decimal point, not a comma"
    return "use numbers with units, names of dimensions, + - * / ^ ( ) and " + ", ".join(sorted(RESERVED))


def _depth(tree: ast.expr) -> int:
    """How deep the tree is nested; RecursionError beyond Python's own limit."""
    return 1 + max((_depth(child) for child in ast.iter_child_nodes(tree) if isinstance(child, ast.expr)), default=0)


# ---- a tree, compiled -----------------------------------------------------------------------------------------

_OPERATORS: Mapping[type[ast.operator], Callable[[Number, Number], Number]] = {
    ast.Add: operators.add, ast.Sub: operators.sub, ast.Mult: operators.mul, ast.Div: operators.truediv,
    ast.Pow: operators.pow,
}  # fmt: skip


def _compile(tree: ast.expr, operands: Mapping[str, Literal | str]) -> Term:
    """The tree as nested closures. Constants are NumPy floats, so that 1/0 and (-1)^0.5 give inf and nan, data."""
    match tree:
        case ast.Name(id=key):
            return _operand(operands[key])
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=inner):
            part, negative = _compile(inner, operands), isinstance(sign, ast.USub)
            value: Evaluator = (lambda names: -part.value(names)) if negative else part.value
            return Term(value, part.dimension, part.operands, (part,), "same", "same")
        case ast.BinOp(op=operator, left=left, right=right) if type(operator) in _OPERATORS:
            return _binary(operator, _compile(left, operands), _compile(right, operands), _integer(right, operands))
        case ast.Call(func=ast.Name(id=key), args=arguments, keywords=[]):
            return _call(operands[key], tuple(_compile(argument, operands) for argument in arguments))
    raise UnitError("an expression has a part that is no number, name, operator or function", _hint(""))


def _operand(operand: Literal | str) -> Term:
    if isinstance(operand, Literal):
        constant = np.float64(operand.value)
        dimension = operand.dimension if operand.value or operand.unit else None  # a bare 0 fits anywhere
        return Term(lambda names: constant, lambda names: dimension, (operand,))
    if operand == "pi":
        return Term(lambda names: np.float64(np.pi), lambda names: NUMBER, (operand,))
    if operand in FUNCTIONS:
        raise UnitError(f"the function '{operand}' has no argument", f"write {operand}(…)")
    name = operand

    def look_up(names: Mapping[str, Number]) -> Number:
        value = names[name]
        return np.float64(value) if isinstance(value, (float, int)) else value

    return Term(look_up, lambda names: names[name], (operand,))


def _integer(tree: ast.expr, operands: Mapping[str, Literal | str]) -> int | None:
    """The exponent as an int if it is a whole literal number."""
    negative = isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.USub)
    core = tree.operand if isinstance(tree, ast.UnaryOp) else tree
    operand = operands[core.id] if isinstance(core, ast.Name) else None
    if not isinstance(operand, Literal) or operand.value != int(operand.value) or abs(operand.value) > 99:
        return None
    return -int(operand.value) if negative else int(operand.value)


def _binary(operator: ast.operator, first: Term, second: Term, exponent: int | None) -> Term:
    """Two parts and an operator. exponent: the second as an int if it is a whole literal number."""
    combine, operands, parts = _OPERATORS[type(operator)], (*first.operands, *second.operands), (first, second)

    def value(names: Mapping[str, Number]) -> Number:
        return combine(first.value(names), second.value(names))

    def terms(names: Dimensions) -> Dimension | None:
        return _same([first.dimension(names), second.dimension(names)], "added")

    def product(names: Dimensions) -> Dimension | None:
        one, other = first.dimension(names), second.dimension(names)
        if one is None or other is None:
            return None
        return _combine(one, other, Fraction(1 if isinstance(operator, ast.Mult) else -1))

    def power(names: Dimensions) -> Dimension | None:
        base, above = first.dimension(names), second.dimension(names)
        if above is not None and above != NUMBER:
            raise UnitError(f"an exponent is {dimension_text(above)}", "an exponent must be a number without unit")
        if base is None or base == NUMBER:
            return base
        if exponent is None:
            raise UnitError(f"{dimension_text(base)} is raised to a power that is not a whole number", "use sqrt or ^2")
        return _combine(NUMBER, base, Fraction(exponent))

    if isinstance(operator, ast.Add | ast.Sub):
        return Term(value, terms, operands, parts, "same", "same")
    if isinstance(operator, ast.Mult | ast.Div):
        return Term(value, product, operands, parts)
    if exponent is None:
        return Term(value, power, operands, parts)
    return Term(lambda names: first.value(names) ** exponent, power, operands, parts)  # duals below 0 have such powers


def _call(name: Literal | str, arguments: tuple[Term, ...]) -> Term:
    if isinstance(name, Literal):
        raise UnitError("an operator is missing before a parenthesis", "write a product as 2 * (a + b)")
    if name not in FUNCTIONS:
        raise UnitError(f"'{name}' is not a function", "the functions are " + ", ".join(sorted(FUNCTIONS)))
    function = FUNCTIONS[name]
    least, most = function.arguments
    if not least <= len(arguments) <= most:
        raise UnitError(f"{name} takes {least} argument{'s' * (least > 1)}, not {len(arguments)}", "separate them by ,")

    def value(names: Mapping[str, Number]) -> Number:
        values = [argument.value(names) for argument in arguments]
        if name == "between":  # it switches a load on over part of the motion
            place, low, high = values
            return namespace(*values).where((place >= low) & (place < high), 1.0, 0.0)
        apply = getattr(namespace(*values), function.name)
        return reduce(apply, values) if len(values) > 1 else apply(values[0])

    def dimension(names: Dimensions) -> Dimension | None:
        common = _same([argument.dimension(names) for argument in arguments], f"combined in {name}")
        needed = {"angle": ANGLE, "number": NUMBER}.get(function.takes)
        if needed is not None and common is not None and not fits(common, needed):
            raise UnitError(f"{name} is given {dimension_text(common)}", f"{name} takes {dimension_text(needed)}")
        if function.gives in ("angle", "number"):
            return ANGLE if function.gives == "angle" else NUMBER
        return common if function.gives == "same" or common is None else _combine(NUMBER, common, Fraction(1, 2))

    operands = (name, *(operand for argument in arguments for operand in argument.operands))
    return Term(value, dimension, operands, arguments, function.takes, function.gives, name)


def _kinks(part: Term) -> Iterator[Evaluator]:
    """Functions whose sign decides which side of a switch a part is on."""

    def less(first: Evaluator, other: Evaluator) -> Evaluator:
        return lambda names: first(names) - other(names)

    values = [below.value for below in part.parts]
    if part.function == "between":
        yield from (less(values[0], end) for end in values[1:])
    elif part.function in ("min", "max"):
        yield from (less(argument, other) for argument, other in combinations(values, 2))
    elif part.function in ("abs", "atan2"):  # an angle jumps by a turn where its first argument passes 0
        yield values[0]
    for below in part.parts:
        yield from _kinks(below)


def unitless_angles(part: Term, names: Dimensions, plain: Collection[str], angle: bool) -> Iterator[str | float]:
    """Numbers without a unit, and dimensions that are such (plain), that are taken as radians.

    They stand for an angle where the whole is one, beside a term that is one, or in sin, cos and tan. angle: whether
    the part is wanted as one.
    """
    if part.takes:
        beside = part.takes == "same" and any(below.dimension(names) == ANGLE for below in part.parts)
        angle = part.takes == "angle" or beside or (angle and part.gives == "same")
    elif angle:
        dimensions = [operand for operand in part.operands if isinstance(operand, str)]  # functions and pi among them
        if not any(operand.unit for operand in part.operands if isinstance(operand, Literal)):
            if dimensions and {*plain}.issuperset(dimensions):
                yield from dimensions
            elif not dimensions:
                yield float(part.value({}))
        angle = False
    for below in part.parts:
        yield from unitless_angles(below, names, plain, angle)


def _combine(first: Dimension, second: Dimension, power: Fraction) -> Dimension:
    """The dimension of a product with a power."""
    length, mass, time, angle = (a + power * b for a, b in zip(first, second, strict=True))
    return length, mass, time, angle


def _same(dimensions: list[Dimension | None], verb: str) -> Dimension | None:
    """The common dimension of terms; an angle beside pure numbers makes an angle."""
    terms = [dimension for dimension in dimensions if dimension is not None]
    result = next((dimension for dimension in terms if dimension != NUMBER), NUMBER if terms else None)
    for dimension in terms:
        if result is not None and not fits(dimension, result):
            what = f"{dimension_text(result)} and {dimension_text(dimension)} are {verb}"
            raise UnitError(what, "give every number its unit, such as 3 mm")
    return result
