"""Operations on vectors of floats as instructions of LLVM, and the functions that no processor has.

Errors, in units of the last place: sqrt, sums, products and quotients 0.5, sin, cos, atan2 and exp below 2 in their
range, tanh 2.5; beyond it they are NaN (`SINE_RANGE`, `EXP_RANGE`). The polynomials of sin, cos and atan are those of
fdlibm (Sun Microsystems, 1993; https://netlib.org/fdlibm), whose arguments are reduced here without branches.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any

from llvmlite import ir

from trunnion.engines.graph import EXP_RANGE, SINE_RANGE

# π/2 in three floats, each the rest that the ones before leave; ln 2 in two
HALF_PI = (1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33)
LN2 = (6.93147180369123816490e-01, 1.90821492927058770002e-10)
SINE = (
    -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
    2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10,
)  # fmt: skip
COSINE = (
    4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
    -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11,
)  # fmt: skip
ARCTANGENT = (
    3.33333333333329318027e-01, -1.99999999998764832476e-01, 1.42857142725034663711e-01, -1.11111104054623557880e-01,
    9.09088713343650656196e-02, -7.69187620504482999495e-02, 6.66107313738753120669e-02, -5.83357013379057348645e-02,
    4.97687799461593236017e-02, -3.65315727442169155270e-02, 1.62858201153657823623e-02,
)  # fmt: skip
ROUNDER = 6755399441055744.0  # 1.5 · 2⁵²: a sum with it has its whole part in the last bits
FUSED = ("contract",)  # a product and a sum may be one instruction with one rounding
DOUBLE, LONG, INT, BYTE, BIT = ir.DoubleType(), *(ir.IntType(bits) for bits in (64, 32, 8, 1))
Value = Any  # of llvmlite, which has no types


class Lanes:
    """Instructions on `width` floats at a time, at the builder's place; a width of 1 is a plain float."""

    def __init__(self, builder: Any, width: int, tables: dict[tuple[float, ...], Value]) -> None:
        self.b = builder
        self.width = width
        self.tables = tables  # of the module, by their entries
        self._constants: dict[tuple[str, bool], Value] = {}
        kinds = (self._wide(scalar) for scalar in (DOUBLE, LONG, INT, BYTE, BIT))
        self.double, self.long, self.int, self.byte, self.bit = kinds

    def _wide(self, kind: Any) -> Any:
        return ir.VectorType(kind, self.width) if self.width > 1 else kind

    def _all(self, kind: Any, scalar: Any, value: Any) -> Value:
        return ir.Constant(kind, [ir.Constant(scalar, value)] * self.width if self.width > 1 else value)

    def constant(self, value: float | bool) -> Value:
        """The same float or bool in all lanes."""
        key = repr(value), isinstance(value, bool)
        if key not in self._constants:
            kinds = (self.bit, BIT) if isinstance(value, bool) else (self.double, DOUBLE)
            self._constants[key] = self._all(*kinds, value)
        return self._constants[key]

    def whole(self, value: int) -> Value:
        return self._all(self.long, LONG, value)

    def index(self, value: int) -> Value:
        return self._all(self.int, INT, value)

    def splat(self, scalar: Value) -> Value:
        """A plain number in all lanes."""
        kind = ir.VectorType(scalar.type, self.width)
        first = self.b.insert_element(ir.Constant(kind, ir.Undefined), scalar, ir.Constant(INT, 0))
        mask = ir.Constant(ir.VectorType(INT, self.width), [0] * self.width)
        return self.b.shuffle_vector(first, ir.Constant(kind, ir.Undefined), mask)

    # ---- what a processor has -----------------------------------------------------------------------------------

    def add(self, a: Value, b: Value) -> Value:
        return self.b.fadd(a, b, flags=FUSED)

    def sub(self, a: Value, b: Value) -> Value:
        return self.b.fsub(a, b, flags=FUSED)

    def mul(self, a: Value, b: Value) -> Value:
        return self.b.fmul(a, b, flags=FUSED)

    def div(self, a: Value, b: Value) -> Value:
        return self.b.fdiv(a, b)

    def neg(self, a: Value) -> Value:
        return self.b.fneg(a)

    def compare(self, sign: str, a: Value, b: Value) -> Value:
        """As in Python: false with NaN, but `!=`."""
        return self.b.fcmp_unordered(sign, a, b) if sign == "!=" else self.b.fcmp_ordered(sign, a, b)

    def select(self, condition: Value, a: Value, b: Value) -> Value:
        return self.b.select(condition, a, b)

    def _intrinsic(self, name: str, *args: Value) -> Value:
        full = f"llvm.{name}.v{self.width}f64" if self.width > 1 else f"llvm.{name}.f64"
        declared = self.b.module.globals.get(full)
        kind = ir.FunctionType(self.double, [self.double] * len(args))
        return self.b.call(declared or ir.Function(self.b.module, kind, name=full), args)

    def sqrt(self, a: Value) -> Value:
        return self._intrinsic("sqrt", a)

    def abs(self, a: Value) -> Value:
        return self._intrinsic("fabs", a)

    def floor(self, a: Value) -> Value:
        return self._intrinsic("floor", a)

    def rint(self, a: Value) -> Value:
        return self._intrinsic("rint", a)

    def copysign(self, a: Value, sign: Value) -> Value:
        return self._intrinsic("copysign", a, sign)

    def fma(self, a: Value, b: Value, c: Value) -> Value:
        """a b + c, rounded once."""
        return self._intrinsic("fma", a, b, c)

    # ---- what follows from it ---------------------------------------------------------------------------------------

    def isnan(self, a: Value) -> Value:
        return self.b.fcmp_unordered("uno", a, a)

    def finite(self, a: Value) -> Value:
        return self.compare("<", self.abs(a), self.constant(math.inf))

    def differ(self, values: Sequence[Value], others: Sequence[Value]) -> Value:
        """Whether any bit of any lane does: one plain bit."""
        pairs = [[self.b.bitcast(value, self.long) for value in pair] for pair in zip(values, others, strict=True)]
        bits = functools.reduce(self.b.or_, [self.b.xor(*pair) for pair in pairs])
        return self.any(self.b.icmp_signed("!=", bits, self.whole(0)))

    def any(self, lanes: Value) -> Value:
        """Whether a bit is set in any lane: one plain bit."""
        if self.width == 1:
            return lanes
        mask = ir.IntType(self.width)
        return self.b.icmp_signed("!=", self.b.bitcast(lanes, mask), ir.Constant(mask, 0))

    def larger(self, a: Value, b: Value, sign: str = ">") -> Value:
        """The larger of two, NaN if one is; with < the smaller."""
        if isinstance(b, ir.Constant):
            a, b = b, a
        picked = self.select(self.compare(sign, a, b), a, b)  # if b is NaN, no comparison holds, and found is b
        return picked if isinstance(a, ir.Constant) else self.select(self.isnan(a), a, picked)

    def sign(self, a: Value) -> Value:
        signed = self.copysign(self.constant(1.0), a)
        return self.select(self.compare("!=", a, self.constant(0.0)), self.select(self.isnan(a), a, signed), a)

    def polynomial(self, x: Value, coefficients: Sequence[float]) -> Value:
        """c₀ + c₁ x + c₂ x² …"""
        result = self.constant(coefficients[-1])
        for coefficient in reversed(coefficients[:-1]):
            result = self.fma(result, x, self.constant(coefficient))
        return result

    def within(self, x: Value, most: float, result: Value) -> Value:
        """What was found, NaN where |x| is beyond a range, or NaN."""
        return self.select(self.compare("<=", self.abs(x), self.constant(most)), result, self.constant(math.nan))

    def _rounded(self, x: Value) -> tuple[Value, Value]:
        """The whole number nearest to x, as a float and in the last bits of an integer."""
        shifted = self.b.fadd(x, self.constant(ROUNDER))
        return self.b.fsub(shifted, self.constant(ROUNDER)), self.b.bitcast(shifted, self.long)

    def sincos(self, x: Value) -> tuple[Value, Value]:
        """Sine and cosine."""
        turns, bits = self._rounded(self.b.fmul(x, self.constant(2 / math.pi)))
        r = x
        for part in HALF_PI:
            r = self.fma(turns, self.constant(-part), r)
        z = self.mul(r, r)
        sine = self.fma(self.mul(z, r), self.polynomial(z, SINE), r)
        half = self.b.fmul(z, self.constant(0.5))
        most = self.b.fsub(self.constant(1.0), half)
        rest = self.b.fsub(self.b.fsub(self.constant(1.0), most), half)  # what the rounding of 1 − z/2 lost
        cosine = self.b.fadd(most, self.fma(self.mul(z, z), self.polynomial(z, COSINE), rest))
        odd = self.b.icmp_signed("!=", self.b.and_(bits, self.whole(1)), self.whole(0))
        first = self._turned(self.select(odd, cosine, sine), bits)
        second = self._turned(self.select(odd, sine, cosine), self.b.add(bits, self.whole(1)))
        return self.within(x, SINE_RANGE, first), self.within(x, SINE_RANGE, second)

    def _turned(self, value: Value, quarters: Value) -> Value:
        """With the other sign where the second of the last bits is set: in the lower half of the circle."""
        sign = self.b.shl(self.b.and_(quarters, self.whole(2)), self.whole(62))
        return self.b.bitcast(self.b.xor(self.b.bitcast(value, self.long), sign), self.double)

    def atan2(self, y: Value, x: Value) -> Value:
        """The angle of (x, y) in (−π, π]; NaN where one is infinite."""
        width, height = self.abs(x), self.abs(y)
        steep = self.compare(">", height, width)
        longer, shorter = self.select(steep, height, width), self.select(steep, width, height)
        far = self.compare(">", shorter, self.b.fmul(longer, self.constant(math.tan(math.pi / 8))))
        small = self._arctangent(far, longer, shorter)
        quarter = self._minus(math.pi / 4, self.neg(small), HALF_PI[1] / 2)
        angle = self.select(far, quarter, small)
        angle = self.select(steep, self._minus(math.pi / 2, angle, HALF_PI[1]), angle)
        left = self.b.icmp_signed("<", self.b.bitcast(x, self.long), self.whole(0))  # −0 is left of the origin too
        angle = self.select(left, self._minus(math.pi, angle, 2 * HALF_PI[1]), angle)
        return self.copysign(angle, y)

    def _arctangent(self, far: Value, longer: Value, shorter: Value) -> Value:
        """atan(shorter / longer), less π/4 where `far`; what rounding takes from the quotient is put back."""
        zero, wide = self.constant(0.0), self.b.fadd(shorter, longer)
        apart = self.b.fsub(longer, shorter)
        above = self.select(far, self.neg(apart), shorter)
        above_rest = self.select(far, self.b.fsub(shorter, self.b.fsub(longer, apart)), zero)
        below = self.select(far, wide, longer)
        below_rest = self.select(far, self.b.fsub(shorter, self.b.fsub(wide, longer)), zero)
        below = self.select(self.compare("==", longer, zero), self.constant(1.0), below)
        inverse = self.div(self.constant(1.0), below)
        t = self.b.fmul(above, inverse)
        left = self.b.fadd(self.fma(self.neg(t), below, above), above_rest)
        rest = self.b.fmul(self.fma(self.neg(t), below_rest, left), inverse)
        z = self.b.fmul(t, t)
        rest = self.fma(self.neg(z), rest, rest)  # by the slope of the arctangent
        return self.b.fadd(t, self.fma(self.b.fmul(t, z), self.neg(self.polynomial(z, ARCTANGENT)), rest))

    def _minus(self, most: float, angle: Value, rest: float) -> Value:
        """(most + rest) − angle: an angle that has more digits than one float."""
        return self.b.fsub(self.constant(most), self.b.fsub(angle, self.constant(rest)))

    def _exponential(self, x: Value) -> tuple[Value, Value]:
        """eʳ − 1 and 2ᵏ with eˣ = 2ᵏ eʳ, |r| ≤ ln 2 / 2, for |x| < 700."""
        count, bits = self._rounded(self.b.fmul(x, self.constant(1 / math.log(2))))
        r = self.fma(count, self.constant(-LN2[0]), x)
        r = self.fma(count, self.constant(-LN2[1]), r)
        series = self.polynomial(r, [1 / math.factorial(k) for k in range(2, 15)])
        power = self.b.bitcast(self.b.shl(self.b.add(bits, self.whole(1023)), self.whole(52)), self.double)
        return self.fma(self.mul(r, r), series, r), power

    def exp(self, x: Value) -> Value:
        less, power = self._exponential(x)
        return self.within(x, EXP_RANGE, self.fma(power, less, power))

    def tanh(self, x: Value) -> Value:
        """(e²ˣ − 1) / (e²ˣ + 1), of |x|; 1 where rounding leaves nothing else."""
        double = self.larger(self.b.fmul(self.abs(x), self.constant(2.0)), self.constant(44.0), "<")
        less, power = self._exponential(double)
        less = self.fma(power, less, self.b.fsub(power, self.constant(1.0)))
        result = self.div(less, self.b.fadd(less, self.constant(2.0)))
        return self.select(self.isnan(x), x, self.copysign(result, x))

    # ---- tables ------------------------------------------------------------------------------------------------------

    def table(self, entries: Sequence[float]) -> Value:
        """A constant array of the module, the same for the same entries."""
        key = tuple(entries)
        if key not in self.tables:
            kind = ir.ArrayType(DOUBLE, len(key))
            made = self.tables[key] = ir.GlobalVariable(self.b.module, kind, name=f"table{len(self.tables)}")
            made.initializer = ir.Constant(kind, [ir.Constant(DOUBLE, number) for number in key])
            made.global_constant, made.linkage = True, "internal"
        return self.tables[key]

    def gather(self, table: Value, index: Value) -> Value:
        """The entries at some places, which exist."""
        vector = ir.Constant(self.double, ir.Undefined) if self.width > 1 else None
        for lane in range(self.width):
            place = self.b.extract_element(index, ir.Constant(INT, lane)) if self.width > 1 else index
            entry = self.b.load(self.b.gep(table, [ir.Constant(INT, 0), place]))
            vector = self.b.insert_element(vector, entry, ir.Constant(INT, lane)) if self.width > 1 else entry
        return vector

    def take(self, entries: Sequence[float], x: Value) -> Value:
        """The entry whose number is x; the first or last beyond them."""
        x = self.select(self.compare(">", x, self.constant(0.0)), x, self.constant(0.0))
        most = self.constant(float(len(entries) - 1))
        x = self.select(self.compare("<", x, most), x, most)
        return self.gather(self.table(entries), self.b.fptosi(x, self.int))

    def search(self, entries: Sequence[float], side: str, x: Value) -> Value:
        """How many entries of a rising table are below x, or not above it with side right; by halves."""
        steps = len(entries).bit_length()
        table = self.table([*entries, *[math.inf] * (2**steps - len(entries))])
        place = self.index(0)
        for step in reversed(range(steps)):
            probe = self.gather(table, self.b.add(place, self.index(2**step - 1)))
            further = self.compare("<" if side == "left" else "<=", probe, x)
            place = self.b.select(further, self.b.add(place, self.index(2**step)), place)
        result = self.b.sitofp(place, self.double)
        return self.larger(result, self.constant(float(len(entries))), "<")  # ∞ is not above what fills the table up
