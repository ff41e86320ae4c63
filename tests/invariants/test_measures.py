"""What holds of the figures of measures whatever the mechanism, and of extremes on panels."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from measured import many
from mechanisms import build, four_bar
from trunnion.algebra.course import Courses
from trunnion.algebra.dual import Dual
from trunnion.algebra.panels import FIT, ON_GAUSS, POINTS, above, extreme, spread_out, weighted
from trunnion.measures.measures import Measure
from trunnion.measures.positions import path_of, plan
from trunnion.solve.forward import forward
from trunnion.solve.run import prepare


@given(st.floats(0.05, 6.2), st.floats(0.05, 3.0))
@settings(max_examples=20)
def test_windows_are_part_of_the_cycle(first, wide):
    """A window has its ends to rounding, positions in rising order, and the same course as the whole cycle there."""
    run = RUN
    over = Measure("over", "rotation", "D", over=(first, first + wide), statistic="rms")
    whole = Measure("whole", "rotation", "D", statistic="maximum")
    window = plan(run, [over, whole], 60).windows["over"]
    assert np.all(np.diff(window.time) > 0)
    place = path_of(run, window.time[[0, -1]])
    assert (place[0] - first + np.pi) % (2 * np.pi) - np.pi == pytest.approx(0, abs=1e-12)
    assert place[1] - place[0] == pytest.approx(wide, abs=1e-12)
    read = many(run, [over]).read(run.values, {"over": window.time})["over"]
    frame = run.solve(window.time).walk.motions["rocker"].frame
    change = (read.shown[0] - np.arctan2(frame.s, frame.c) + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(change, 0, atol=1e-10)


RUN = prepare(build(four_bar()))


def test_no_figure_of_a_mechanism_that_does_not_go_together_somewhere():
    """Of rods from too short to too long, held against many positions: however short the gap, no figure hides it."""
    measures = [
        Measure("least", "rotation", "D", statistic="minimum"),
        Measure("mean", "angle", "coupler", statistic="mean"),
        Measure("most", "effort", "A", statistic="maximum"),
    ]
    rods = 0.9 * np.concatenate([np.linspace(0.5, 1.6, 100), 10 / 9 + np.geomspace(1e-4, 1e-2, 20)])[:, None]
    values = RUN.system.mechanism.parameters({"links.coupler.points.C.x": rods})
    made, time = many(RUN, measures), RUN.cycle.times(720)
    with np.errstate(all="ignore"):
        frame = forward(RUN.system, values, RUN.chosen.assembly, time).motions["rocker"].frame
    open_ = np.any(np.isnan(np.broadcast_to(frame.c, (len(rods), len(time)))), axis=1)
    assert 10 < np.count_nonzero(open_) < 100
    for read in made.read(values).values():
        gone = np.isnan(read.figure)
        assert np.all(gone[open_])
        assert np.count_nonzero(gone & ~open_) < 3  # where the gap is shorter than a step


TURN = 2 * np.pi
EDGES = np.linspace(0.0, TURN, 9)


def series(seed, orders=4):
    """A periodic function with a few harmonics."""
    rng = np.random.default_rng(seed)
    a, phase = rng.normal(size=orders) / np.arange(1, orders + 1) ** 2, rng.uniform(0, TURN, orders)
    k = np.arange(1, orders + 1)
    return lambda x: np.sum(a * np.cos(k * np.asarray(x)[..., None] + phase), axis=-1)


def fitted(*functions, edges=EDGES):
    """Coefficients of courses on the same panels, (lane, panel, coefficient)."""
    time = edges[:-1, None] + np.diff(edges)[:, None] / 2 * (1 + POINTS)
    return np.array([function(time) for function in functions]) @ FIT.T


def place_of(found, lane=0, edges=EDGES):
    panel = found.panel[lane]
    return float(edges[panel] + (edges[panel + 1] - edges[panel]) / 2 * (np.ravel(found.spot)[lane] + 1))


def first(rows):
    return rows[0]


@given(st.integers(0, 10_000), st.sampled_from([1.0, -1.0]))
def test_extremes_of_many_courses(seed, sign):
    """No lower than any of many places, level there, and those of `Courses` of each by itself."""
    functions = [series(seed + k) for k in range(3)]
    found, x = extreme(fitted(*functions)[None], first, sign), np.linspace(0, TURN, 20_001)
    for lane, function in enumerate(functions):
        assert sign * found.value[lane] >= np.max(sign * function(x)) - 1e-9
        assert function(place_of(found, lane)) == pytest.approx(found.value[lane], abs=1e-8)
        alone = Courses.of(lambda t, f=function: (f(t)[None], np.zeros(len(t), int)), EDGES[[0, -1]])
        assert alone.extreme(first, sign).value == pytest.approx(found.value[lane], abs=1e-7)


@given(st.integers(0, 10_000), st.floats(-0.6, 0.6))
def test_shares_above_a_level(seed, level):
    function = series(seed)
    x = (np.arange(40_000) + 0.5) / 40_000 * TURN
    share = np.sum(above(fitted(function), level)) / 2 / (len(EDGES) - 1)
    assert share == pytest.approx(np.mean(function(x) > level), abs=2e-4)


@given(st.integers(0, 10_000))
def test_derivatives(seed):
    """Of an extreme, its place, a mean square and a share, against differences."""
    function, change = series(seed), series(seed + 1)
    own, other, step = fitted(function), fitted(change), 1e-6
    dual = Dual(own, other)
    both = [own + way * step * other for way in (1.0, -1.0)]
    found, ends = extreme(Dual(own[None], other[None]), first), [extreme(one[None], first) for one in both]
    if ends[0].panel[0] == ends[1].panel[0] == found.panel[0]:
        slope = (ends[0].value - ends[1].value) / (2 * step)
        np.testing.assert_allclose(found.value.dual, slope, rtol=1e-5, atol=1e-7)
        moved = (ends[0].spot - ends[1].spot) / (2 * step)
        np.testing.assert_allclose(found.spot.dual, moved, rtol=1e-4, atol=1e-5)
    half = np.full((1, len(EDGES) - 1, 1), TURN / 16)

    def square(coefficients):
        values = (
            Dual(coefficients.real @ ON_GAUSS, coefficients.dual @ ON_GAUSS)
            if isinstance(coefficients, Dual)
            else coefficients @ ON_GAUSS
        )
        return weighted(values * values, half)

    np.testing.assert_allclose(
        square(dual).dual, (square(both[0]) - square(both[1])) / (2 * step), rtol=1e-6, atol=1e-9
    )
    shares = [np.sum(above(one, 0.1)) for one in both]
    slopes = np.abs(np.diff(function(np.linspace(0, TURN, 20_001)))) * 20_000 / TURN
    if (
        np.min(slopes + 10 * np.abs(function(np.linspace(0, TURN, 20_001))[1:] - 0.1)) > 0.1
    ):  # it touches the level nowhere
        assert np.sum(above(dual, 0.1).dual) == pytest.approx((shares[0] - shares[1]) / (2 * step), rel=1e-3, abs=1e-4)


def test_an_extreme_at_an_edge_moves_with_it():
    """A course 1 + (t − p) up to a jump at p: its largest value changes as the edge does, its place by 1."""
    edges = np.array([0.0, 1.0, 2.0])
    time = edges[:-1, None] + np.diff(edges)[:, None] / 2 * (1 + POINTS)
    moves = np.array([(1 + POINTS) / 2, (1 - POINTS) / 2])  # of the nodes, the edge between both panels moving by 1
    values = np.where(time < 1, time**2, 0.0)
    total = np.where(time < 1, 2 * time * moves, 0.0)
    found = extreme(Dual((values @ FIT.T)[None, None], (total @ FIT.T)[None, None]), first)
    assert float(found.value.real[0]) == pytest.approx(1.0)
    assert float(found.value.dual[0]) == pytest.approx(2.0)
    assert place_of(extreme((values @ FIT.T)[None, None], first), 0, edges) == pytest.approx(1.0)


def test_gaps_and_constants():
    """A panel without values is left out, a course without any has no extreme, one that does not change no place."""
    own = fitted(np.cos, lambda x: 0 * x + 3.0, np.cos)
    own[0, 0] = own[0, -1] = np.nan
    own[2] = np.nan
    found = extreme(own[None], first)
    assert found.value[0] == pytest.approx(np.cos(TURN / 8))
    assert found.constant.tolist() == [False, True, False]
    assert np.isnan(found.value[2])


@given(st.integers(0, 10_000))
def test_rows_at_times_of_panels_of_their_own(seed):
    rng = np.random.default_rng(seed)
    edges = np.sort(np.append(rng.uniform(0, TURN, (2, 3)), [EDGES] * 2, axis=1), axis=1)
    function, low, half = series(seed), edges[:, :-1], np.diff(edges) / 2
    own = function(low[..., None] + half[..., None] * (1 + POINTS)) @ FIT.T
    time = np.linspace(0, TURN, 91)
    np.testing.assert_allclose(spread_out(own[None], low, half, time)[0], np.array([function(time)] * 2), atol=1e-6)
