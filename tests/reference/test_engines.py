"""What is recorded and compiled gives the numbers of NumPy: operations, functions, loops, tables, in any split."""

import os

import numpy as np
import pytest
from benchmarks.engines import compared

import trunnion
from mechanisms import DURANGO
from trunnion.algebra.namespace import looped
from trunnion.engines import machine_code
from trunnion.engines.graph import BOTH, EXP_RANGE, POSITION, SAMPLE, SINE_RANGE, Graph
from trunnion.engines.program import program
from trunnion.engines.recorded import Recorded, functions, number_of
from trunnion.solve.run import prepare
from trunnion.solve.walk_kernel import WalkKernel

SPECIAL = np.array([0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 1e-300, 5.0, -2.5])


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    return tmp_path


def compiled(function, *arrays, width=0):
    """What a kernel of rows of numbers gives."""
    graph = Graph()
    numbers = [Recorded(graph, graph.input(f"x{k}", POSITION)) for k in range(len(arrays))]
    nodes = [number_of(graph, one) for one in function(*numbers)]
    count = len(arrays[0])
    found = [np.empty((1, count), bool if graph.booleans[node] else float) for node in nodes]
    code = machine_code.MachineCode(program(graph, nodes, width or machine_code.vector_width()))
    inputs = {f"x{k}": np.ascontiguousarray(array, float) for k, array in enumerate(arrays)}
    code.bound(inputs, found, (0, 1), (0, count))()
    return [one[0] for one in found]


def last_places(found, exact):
    """Largest error in units of the last place of the exact number."""
    return float(np.max(np.abs((found - exact) / np.spacing(np.abs(exact.astype(float))))))


@pytest.mark.parametrize(
    ("name", "reach", "most"),
    [("sin", 10.0, 2.0), ("cos", 10.0, 2.0), ("sin", SINE_RANGE, 2.0), ("cos", SINE_RANGE, 2.0),
     ("exp", EXP_RANGE, 2.0), ("tanh", 30.0, 2.5), ("tanh", 1e-3, 2.5)],
)  # fmt: skip
def test_functions_are_exact_to_the_last_places(name, reach, most):
    """Against numbers of 64 binary digits."""
    rng = np.random.default_rng(3)
    x = np.concatenate([rng.uniform(-reach, reach, 50_001), np.arange(-9, 10) * np.pi / 2])
    x = x[np.abs(x) <= reach]
    (found,) = compiled(lambda x: (getattr(np, name)(x),), x)
    assert last_places(found, getattr(np, name)(x.astype(np.longdouble))) <= most


def test_the_angle_of_a_point_is_exact_to_the_last_places():
    rng = np.random.default_rng(4)
    y, x = rng.normal(size=(2, 50_001)) * 10.0 ** rng.uniform(-9, 9, (2, 50_001))
    (found,) = compiled(lambda y, x: (np.arctan2(y, x),), y, x)
    assert last_places(found, np.arctan2(y.astype(np.longdouble), x.astype(np.longdouble))) <= 2.0


@pytest.mark.parametrize("name", ["sin", "cos", "exp"])
def test_beyond_its_range_a_function_is_no_number(name):
    reach = EXP_RANGE if name == "exp" else SINE_RANGE
    (found,) = compiled(lambda x: (getattr(np, name)(x),), np.array([1.01, -1.01, np.inf, np.nan, 0.5] * 2) * reach)
    assert np.isnan(found).tolist() == [True, True, True, True, False] * 2


@pytest.mark.parametrize("name", ["sqrt", "abs", "floor", "rint", "tanh", "sign", "isfinite", "negative", "square"])
def test_functions_of_special_numbers(name):
    (found,) = compiled(lambda x: (getattr(np, name)(x),), SPECIAL)
    with np.errstate(all="ignore"):
        np.testing.assert_allclose(found, getattr(np, name)(SPECIAL), rtol=1e-15)


@pytest.mark.parametrize(
    "name",
    ["maximum", "minimum", "fmax", "fmin", "less", "less_equal", "greater", "greater_equal", "equal", "not_equal",
     "add", "subtract", "multiply", "divide", "hypot"],
)  # fmt: skip
def test_functions_of_special_pairs(name):
    a, b = (grid.ravel() for grid in np.meshgrid(SPECIAL, SPECIAL))
    (found,) = compiled(lambda a, b: (getattr(np, name)(a, b),), a, b)
    with np.errstate(all="ignore"):
        expected = getattr(np, name)(a, b)
    if name == "hypot":  # its squares have to be numbers; of an infinite side and a NaN NumPy says ∞
        known = ~np.isnan(a) & ~np.isnan(b) & ((expected == 0) | (expected > 1e-150))
        found, expected = found[known], expected[known]
    np.testing.assert_allclose(found, expected, rtol=1e-15)


@pytest.mark.parametrize("name", ["maximum", "minimum"])
def test_the_larger_of_a_special_number_and_a_constant(name):
    larger = getattr(np, name)
    found = compiled(lambda x: [larger(*pair) for c in SPECIAL for pair in ((x, c), (c, x))], SPECIAL)
    np.testing.assert_array_equal(found, [larger(SPECIAL, c) for c in SPECIAL for _ in range(2)])


def test_angles_on_the_axes():
    y, x = (grid.ravel() for grid in np.meshgrid(SPECIAL[np.isfinite(SPECIAL)], SPECIAL[np.isfinite(SPECIAL)]))
    (found,) = compiled(lambda y, x: (np.arctan2(y, x),), y, x)
    np.testing.assert_allclose(found, np.arctan2(y, x), rtol=1e-15)
    assert np.array_equal(np.signbit(found), np.signbit(np.arctan2(y, x)))


def test_tables():
    rng = np.random.default_rng(5)
    rising, entries = np.sort(rng.normal(size=37)), rng.normal(size=38)
    x = np.concatenate([2 * rng.normal(size=500), rising, [-np.inf, np.inf]])

    def looked_up(x):
        place = np.searchsorted(rising, x)
        return place, np.searchsorted(rising, x, side="right"), functions.take(entries, place)

    left, right, taken = compiled(looked_up, x)
    assert np.array_equal(left, np.searchsorted(rising, x))
    assert np.array_equal(right, np.searchsorted(rising, x, side="right"))
    assert np.array_equal(taken, entries[np.searchsorted(rising, x)])


def test_loops_within_loops():
    """Square roots by Newton's method, each quotient by a loop of its own; what does not change stays outside."""

    def roots(x, y):
        def halved(now):
            (inverse,) = looped(lambda z: [z[0] * (2.0 - now[0] * z[0])], [1.0 / (now[0] + 0.01 * np.sin(y))], 6)
            return [0.5 * (now[0] + np.sqrt(x) * np.sqrt(x) * inverse)]

        return looped(halved, [x * 0.0 + 1.0], 9)

    x, y = np.random.default_rng(6).uniform(0.5, 4.0, (2, 33))
    (found,) = compiled(roots, x, y)
    np.testing.assert_allclose(found, np.sqrt(x), rtol=1e-15)


@pytest.mark.parametrize("width", [2, 4])
def test_numbers_given_by_sample_by_position_and_by_both(width):
    """Each is computed where it differs, by vectors of any width, in parts that change no bit."""
    graph, rng = Graph(), np.random.default_rng(7)
    kinds = {"g": 0, "s": SAMPLE, "p": POSITION, "b": BOTH}
    g, s, p, b = (Recorded(graph, graph.input(name, differs)) for name, differs in kinds.items())
    outputs = [np.sin(g) + s * np.cos(p) - b, np.exp(p) * g, s * g, (p > 0.5) & (b < s), g * 2.0]
    nodes = [number_of(graph, one) for one in outputs]
    code = machine_code.MachineCode(program(graph, nodes, width))
    inputs = {"g": np.array([0.3]), "s": rng.normal(size=5), "p": rng.uniform(size=11), "b": rng.normal(size=(5, 11))}
    whole, parts = ([np.empty((5, 11), bool if graph.booleans[n] else float) for n in nodes] for _ in range(2))
    code.bound(inputs, whole, (0, 5), (0, 11))()
    for samples in ((0, 2), (2, 5)):
        for positions in ((0, 4), (4, 11)):
            code.bound(inputs, parts, samples, positions)()
    values = (inputs["g"], inputs["s"][:, None], inputs["p"], inputs["b"])
    g_, s_, p_, b_ = values
    expected = [np.sin(g_) + s_ * np.cos(p_) - b_, np.exp(p_) * g_, s_ * g_, (p_ > 0.5) & (b_ < s_), g_ * 2.0]
    for one, other, known in zip(whole, parts, expected, strict=True):
        assert np.array_equal(one, other)
        np.testing.assert_allclose(one, np.broadcast_to(known, (5, 11)), rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize(("samples", "positions"), [(1, 1), (3, 2), (1, 3), (4, 5)])
def test_rows_shorter_than_a_vector(samples, positions):
    run = prepare(trunnion.read(DURANGO))
    path = run.system.mechanism.path_of("AB")
    lengths = run.values[path] * (1 + 1e-3 * np.arange(samples)[:, None])
    values = run.system.mechanism.parameter_set.evaluate({path: lengths})
    time = np.linspace(0.1, 0.4, positions)
    curves, status = WalkKernel(run, {"effort": lambda back: back.efforts["A"]}).curves(values, time)
    assert status.shape == (samples, positions)
    np.testing.assert_allclose(curves["effort"], run.solve(time, values).efforts["A"], rtol=1e-12)


def test_angles_beyond_the_range_are_left_to_numpy():
    """After 10⁵ rad of the drive the sine of a compiled kernel is no number, and NumPy's is used."""
    run = prepare(trunnion.read(DURANGO))
    turns = run.cycle.times(8) + 20_000 * run.cycle.duration
    kernel = WalkKernel(run, {"effort": lambda back: back.efforts["A"]})
    curves, status = kernel.curves(dict(run.values), turns)
    assert kernel.again == 8
    assert np.array_equal(curves["effort"][0], run.solve(turns, run.values).efforts["A"])
    assert np.all(status < trunnion.Status.NOT_CONVERGED)


@pytest.mark.spread(2)
@pytest.mark.parametrize("seed", range(30, 50))
def test_random_planar_mechanisms(seed):
    """Efforts and reactions to 1e-9 of their peak, the same statuses."""
    found = compared("planar", seed)
    assert found.refused or found.agrees


@pytest.mark.sample(3)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(30, 36))
def test_random_spatial_mechanisms(seed):
    found = compared("spatial", seed)
    assert found.refused or found.agrees


def kept(folder):
    return sorted((folder / "trunnion" / "compiled").glob("*"))


def run_once():
    graph = Graph()
    x = Recorded(graph, graph.input("x", POSITION))
    code = machine_code.MachineCode(program(graph, [(x * 3.0).node], 4))
    found = [np.empty((1, 8))]
    code.bound({"x": np.arange(8.0)}, found, (0, 1), (0, 8))()
    assert np.array_equal(found[0][0], 3.0 * np.arange(8))
    return code


def test_code_is_kept_and_used_again(cache):
    assert run_once().compiled
    assert len(kept(cache)) == 1
    assert not run_once().compiled


@pytest.mark.parametrize("damage", [b"", b"nothing", None])
def test_damaged_code_is_replaced(cache, damage):
    run_once()
    (path,) = kept(cache)
    whole = path.read_bytes()
    path.write_bytes(damage if damage is not None else whole[:-1] + bytes([whole[-1] ^ 1]))
    assert run_once().compiled
    assert path.read_bytes() == whole


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="of POSIX")
@pytest.mark.parametrize("open_", ["file", "folder"])
def test_code_that_others_may_have_written_is_not_run(cache, open_):
    run_once()
    (path,) = kept(cache)
    (path if open_ == "file" else path.parent).chmod(0o777)
    assert run_once().compiled


def test_a_folder_that_cannot_be_written(cache):
    (cache / "trunnion").write_text("a file where the folder should be")
    assert run_once().compiled
    assert run_once().compiled


def test_a_loop_goes_on_while_any_lane_changes():
    """Lanes of one vector that come to rest after different numbers of rounds, the first of them at once."""
    graph = Graph()
    x = Recorded(graph, graph.input("x", POSITION))
    (count,) = looped(lambda now: [np.minimum(now[0] + 1.0, x)], [0.0 * x], 50)
    code = machine_code.MachineCode(program(graph, [number_of(graph, count)], 4))
    found, rounds = np.empty((1, 8)), np.array([0.0, 3.0, 49.0, 7.0, 2.0, 60.0, 1.0, 0.0])
    code.bound({"x": rounds}, [found], (0, 1), (0, 8))()
    assert found[0].tolist() == np.minimum(rounds, 50.0).tolist()


def test_a_loop_ends_where_all_lanes_are_done():
    """A step leaves lanes that are done; no round is made where all are; the same with and without values."""
    calls, needed = [], np.array([0.0, 3.0, 49.0, 7.0, 2.0, 60.0, 1.0, np.nan])

    def counted(limit):
        def step(state):
            calls.append(1)
            goes = state[0] < limit
            return [np.where(goes, state[0] + 1.0, state[0]), np.where(goes, state[0] - limit, state[1])]

        return looped(step, [0.0 * limit, -1.0], 50, lambda state: np.logical_not(state[0] < limit))

    plain = counted(needed)
    assert len(calls) == 50
    calls.clear()
    assert counted(np.array([2.0, 3.0]))[0].tolist() == [2.0, 3.0]
    assert len(calls) == 3
    for number, expected in zip(compiled(counted, needed), plain, strict=True):
        np.testing.assert_array_equal(np.ravel(number), np.broadcast_to(expected, needed.shape))
