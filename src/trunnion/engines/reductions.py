"""What a GPU does with the numbers of its lanes, (sample, position), so that few of them have to leave it.

Each kernel has so many threads as its first argument says; the others are addresses and numbers. A list that threads
write to has no order: who reads it sorts it.

pick(n, flags, count, list): the numbers of the true flags.
take8, take1 (n, list, from, to): to[i] = from[list[i]], of 8 bytes or 1; put8, put1: to[list[i]] = from[i].
gravest(samples, positions, status, to): the largest byte of each sample.
bins(samples · places, positions, places, place, middle, scale, fineness, octaves, numbers, counts): how many numbers of
each place of a window are in each bin (`statistics.histogram`) about its middle; place: its position. NaN are left out.
tops(samples, positions, places, place, gain, sign, periodic, numbers, best, count, list): of each sample the place of
the largest number, −1 where one is NaN, and in the list (sample · places + place) what else may be the largest between
positions, as in `measures.extremes`; gain: what is added to the number of each place, before its sign.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir

from trunnion.engines.lanes import BYTE, DOUBLE, INT, LONG, Lanes
from trunnion.engines.program import thread_number

__all__ = ["NAMES", "reductions"]

Value = Any  # of llvmlite, which has no types
EXPONENT = 1023 << 52  # the bits of 1.0
KINDS = {"n": LONG, "b": BYTE.as_pointer(), "l": LONG.as_pointer(), "d": DOUBLE.as_pointer(), "i": INT.as_pointer()}


def reductions() -> str:
    """The module with all of them."""
    module = ir.Module(name="reductions")
    for name, (kinds, body) in NAMES.items():
        types = [KINDS[kind] for kind in kinds]
        function = ir.Function(module, ir.FunctionType(ir.VoidType(), types), name=name)
        function.calling_convention = "ptx_kernel"
        b = ir.IRBuilder(function.append_basic_block("entry"))
        writer = _Kernel(b)
        writer.i = thread_number(b, function.args[0])
        body(writer, *function.args[1:])
        b.ret_void()
    return str(module)


class _Kernel:
    """One kernel as it is written; i: the number of the thread."""

    i: Value

    def __init__(self, b: Any) -> None:
        self.b = b
        self.one = Lanes(b, 1, {})

    def at(self, array: Value, place: Value) -> Value:
        return self.b.load(self.b.gep(array, [place]))

    def store(self, value: Value, array: Value, place: Value) -> None:
        self.b.store(value, self.b.gep(array, [place]))

    def whole(self, value: int) -> Value:
        return ir.Constant(LONG, value)

    def append(self, value: Value, count: Value, array: Value) -> None:
        """One more at the end of a list."""
        place = self.b.atomic_rmw("add", count, self.whole(1), "monotonic")
        self.store(value, array, place)

    def loop(self, count: Value, states: Sequence[Value], step: Callable[..., Sequence[Value]]) -> list[Value]:
        """What states come to by step(k, …states) for k from 0 to before the count."""
        before, (head, body, after) = self.b.block, (self.b.append_basic_block() for _ in range(3))
        self.b.branch(head)
        self.b.position_at_end(head)
        k, *phis = (self.b.phi(value.type) for value in (count, *states))
        self.b.cbranch(self.b.icmp_signed("<", k, count), body, after)
        self.b.position_at_end(body)
        found = step(k, *phis)
        further = self.b.add(k, self.whole(1))
        for phi, start, value in zip((k, *phis), (self.whole(0), *states), (further, *found), strict=True):
            phi.add_incoming(start, before)
            phi.add_incoming(value, self.b.block)
        self.b.branch(head)
        self.b.position_at_end(after)
        return phis


def _pick(k: _Kernel, flags: Value, count: Value, into: Value) -> None:
    with k.b.if_then(k.b.icmp_signed("!=", k.at(flags, k.i), ir.Constant(BYTE, 0))):
        k.append(k.i, count, into)


def _take(k: _Kernel, places: Value, source: Value, into: Value) -> None:
    k.store(k.at(source, k.at(places, k.i)), into, k.i)


def _put(k: _Kernel, places: Value, source: Value, into: Value) -> None:
    k.store(k.at(source, k.i), into, k.at(places, k.i))


def _gravest(k: _Kernel, positions: Value, status: Value, into: Value) -> None:
    start = k.b.mul(k.i, positions)

    def step(p: Value, most: Value) -> list[Value]:
        one = k.at(status, k.b.add(start, p))
        return [k.b.select(k.b.icmp_signed(">", one, most), one, most)]

    (most,) = k.loop(positions, [ir.Constant(BYTE, 0)], step)
    k.store(most, into, k.i)


def _bins(
    k: _Kernel, positions: Value, places: Value, place: Value, middle: Value, scale: Value, fineness: Value,
    octaves: Value, numbers: Value, counts: Value,
) -> None:  # fmt: skip
    b = k.b
    s, w = b.sdiv(k.i, places), b.srem(k.i, places)
    number = k.at(numbers, b.add(b.mul(s, positions), k.at(place, w)))
    with b.if_then(b.not_(k.one.isnan(number))):
        t = b.fdiv(b.fsub(number, k.at(middle, w)), k.at(scale, w))
        far = b.fadd(k.one.abs(t), k.one.constant(1.0))
        most = b.sub(b.shl(b.add(octaves, k.whole(1023)), k.whole(52)), k.whole(1))  # the float before 2 ** octaves
        bits = b.bitcast(far, LONG)
        bits = b.select(b.icmp_signed("<", bits, most), bits, most)
        index = b.ashr(b.sub(bits, k.whole(EXPONENT)), b.sub(k.whole(52), fineness))
        index = b.xor(index, b.ashr(b.bitcast(t, LONG), k.whole(63)))
        half = b.shl(octaves, fineness)
        at = b.add(b.mul(w, b.add(half, half)), b.add(index, half))
        b.atomic_rmw("add", b.gep(counts, [at]), ir.Constant(INT, 1), "monotonic")


def _tops(
    k: _Kernel, positions: Value, places: Value, place: Value, gain: Value, sign: Value, periodic: Value,
    numbers: Value, best: Value, count: Value, into: Value,
) -> None:  # fmt: skip
    b, one, start = k.b, k.one, k.b.mul(k.i, positions)
    way, round_ = b.sitofp(sign, DOUBLE), b.icmp_signed("!=", periodic, k.whole(0))
    end = b.sub(places, k.whole(1))

    def value(w: Value) -> Value:
        number = k.at(numbers, b.add(start, k.at(place, w)))
        return b.fmul(way, b.fadd(number, k.at(gain, w)))

    def higher(w: Value, most: Value, top: Value, total: Value) -> list[Value]:
        v = value(w)
        above = b.or_(b.icmp_signed("==", w, k.whole(0)), one.compare(">", v, most))
        return [b.select(above, v, most), b.select(above, w, top), b.fadd(total, v)]

    most, top, total = k.loop(places, [one.constant(0.0), k.whole(0), one.constant(0.0)], higher)
    gone = one.isnan(total)
    k.store(b.select(gone, k.whole(-1), top), best, k.i)

    def beside(w: Value, step: int, edge: Value, other: Value) -> Value:
        """The number of the place before or after; round the period, or that of the place itself at an end."""
        at_edge = b.icmp_signed("==", w, edge)
        return value(b.select(at_edge, b.select(round_, other, w), b.add(w, k.whole(step))))

    def further(w: Value) -> list[Value]:
        v = value(w)
        left, right = beside(w, -1, k.whole(0), end), beside(w, 1, end, k.whole(0))
        high = b.and_(one.compare(">=", v, left), b.not_(one.compare(">=", right, v)))
        last = b.and_(b.icmp_signed("==", w, end), b.not_(round_))  # nothing rises from the end of a range
        high = b.or_(high, b.and_(one.compare(">=", v, left), last))
        drop = one.larger(b.fsub(v, left), b.fsub(v, right))
        low = one.compare("<", b.fadd(v, b.fmul(drop, one.constant(0.5))), most)
        with b.if_then(b.and_(b.and_(high, b.not_(low)), b.icmp_signed("!=", w, top))):
            k.append(b.add(b.mul(k.i, places), w), count, into)
        return []

    with b.if_then(b.not_(gone)):
        k.loop(places, [], further)


NAMES: dict[str, tuple[str, Callable[..., None]]] = {
    "pick": ("nbll", _pick),
    "take8": ("nldd", _take),
    "take1": ("nlbb", _take),
    "put8": ("nldd", _put),
    "put1": ("nlbb", _put),
    "gravest": ("nnbb", _gravest),
    "bins": ("nnnlddnndi", _bins),
    "tops": ("nnnldnndlll", _tops),
}
