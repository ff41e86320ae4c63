"""Machine code solves a row of modules as NumPy does, also where it locks, turns round or cannot be assembled."""

import numpy as np
import pytest
from benchmarks.studio import chain

from mechanisms_parts import EXAMPLES
from trunnion.algebra.dual import Dual
from trunnion.engines import parts
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism
from trunnion.solve import backward, row_code
from trunnion.solve.backward import status_of
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.margin import margin_in
from trunnion.solve.row_code import leaves_of
from trunnion.solve.run import prepare

STEPS = 90
TEXTS = {
    "chain": chain(13),
    **{name: (EXAMPLES / f"{name}.yaml").read_text("utf-8") for name in ("jansen", "drawing-press", "scotch-yoke")},
    "locked": (EXAMPLES / "drawing-press.yaml").read_text("utf-8").replace("friction: 0.1", "friction: 0.4"),
    "broken": chain(13).replace("d: 150 mm", "d: 146 mm"),
    "cardan": (EXAMPLES / "pezzuti-cardan.yaml").read_text("utf-8"),
}


@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("positions", [slice(None), slice(7, 8), slice(0, 3)])
def test_machine_code_solves_as_numpy_does(name, positions, monkeypatch):
    run = prepare(Mechanism(**entries_of(TEXTS[name])[0]))
    time = run.cycle.times(STEPS)[positions]
    ran, run_code = [], parts.Parts.run
    monkeypatch.setattr(parts.Parts, "run", lambda *given: ran.append(given) or run_code(*given))
    backs, turned = [], []
    with np.errstate(all="ignore"):
        for many in (10**9, 1):
            monkeypatch.setattr(backward, "MANY_MODULES", many)
            assert not ran
            backs.append(run.solve(time, method=FrictionMethod()))
            turned.append(backward.backward(backs[-1].walk.backward(), FrictionMethod(), backward.Given()))
        plain, coded = backs
        margins = [np.broadcast_to(margin_in(back, 3.0), time.shape) for back in backs]
    assert ran
    for plain, coded in (backs, turned):
        _same(plain, coded, time, 1e-10 if name == "cardan" else 1e-12)  # rounding of its motion grows
    np.testing.assert_allclose(margins[1], margins[0], rtol=1e-9)


def _same(plain, coded, time, within=1e-12):
    """All numbers of both to a share of their sizes, statuses and rounds alike."""
    np.testing.assert_array_equal(*(status_of(back, time.shape) for back in (plain, coded)))
    for name in ("reactions", "friction", "losses", "efforts", "loads", "load_powers", "friction_wrenches"):
        numbers = [np.array([np.broadcast_to(part, time.shape) for part in leaves_of(getattr(back, name))])
                   for back in (plain, coded)]  # fmt: skip
        size = np.nanmax(np.abs(numbers[0]), initial=0.0) if np.isfinite(numbers[0]).any() else 0.0
        np.testing.assert_allclose(numbers[1], numbers[0], rtol=0, atol=within * size, err_msg=name)
    for name in ("body_power", "gear_power"):
        np.testing.assert_allclose(getattr(coded, name), getattr(plain, name), rtol=1e-9, atol=1e-12)
    for link, motion in plain.walk.motions.items():
        parts = [np.array([np.broadcast_to(part, time.shape) for part in leaves_of(nest)])
                 for nest in (motion, coded.walk.motions[link])]  # fmt: skip
        lost = [np.isnan(part).any(axis=0) for part in parts]  # a pivot may be known of a link that is not
        np.testing.assert_array_equal(*lost)
        size = np.max(np.abs(parts[0][:, ~lost[0]]), initial=1.0)
        np.testing.assert_allclose(parts[1][:, ~lost[0]], parts[0][:, ~lost[0]], rtol=1e-9, atol=1e-12 * size)
    for settled, other in zip(plain.settled, coded.settled, strict=True):
        for what in ("iterations", "converged", "certain", "share"):
            np.testing.assert_allclose(getattr(other, what), getattr(settled, what), rtol=1e-9, err_msg=what)


def test_modules_that_are_alike_share_their_code(monkeypatch):
    monkeypatch.setattr(parts, "_codes", {})
    counts = []
    for dyads in (12, 20):
        run = prepare(Mechanism(**entries_of(chain(dyads))[0]))
        run.solve(run.cycle.times(STEPS))
        counts.append(len(parts._codes))
    # of driver, first, inner and last dyad, contacts, masses of links, friction, whatever the length of the chain
    assert counts[0] <= counts[1] <= counts[0] + 2 <= 22


def test_derivatives_are_those_of_numpy(monkeypatch):
    run = prepare(Mechanism(**entries_of(TEXTS["chain"])[0]))
    path = "joints.B5.friction.coefficient"
    values = {**run.values, path: Dual(run.values[path], 1.0)}
    slopes = []
    for many in (10**9, 1):
        monkeypatch.setattr(backward, "MANY_MODULES", many)
        back = run.solve(run.cycle.times(STEPS), values)
        parts = [part for wrench in back.reactions.values() for part in tuple(wrench)[:2] if isinstance(part, Dual)]
        slopes.append(np.array([np.broadcast_to(part.dual, STEPS) for part in parts]))
    assert np.nanmax(np.abs(slopes[0])) > 0
    np.testing.assert_allclose(slopes[1], slopes[0], rtol=0, atol=1e-10 * np.nanmax(np.abs(slopes[0])))


def _coded_as_plain(text, monkeypatch):
    """A cycle by machine code, as the product solves it, and by NumPy alone."""
    run = prepare(Mechanism(**entries_of(text)[0]))
    time = run.cycle.times(STEPS)
    with np.errstate(all="ignore"):
        coded = run.solve(time)
        monkeypatch.setattr(backward, "MANY_MODULES", 10**9)
        _same(run.solve(time), coded, time)
    monkeypatch.setattr(backward, "MANY_MODULES", 12)


def test_one_code_serves_mechanisms_that_differ_by_numbers(monkeypatch):
    monkeypatch.setattr(row_code, "_recorded", {})
    texts = (chain(13), chain(13).replace("c: 100 mm", "c: 101 mm"), chain(13).replace("1950 mm, 0]", "1950 mm, 1 mm]"))
    assert len(set(texts)) == 3  # a length, and a pivot dragged off zero
    for text in texts:
        _coded_as_plain(text, monkeypatch)
    assert len(row_code._recorded) == 1


def test_a_table_that_does_not_reach_its_period_is_no_closed_one(monkeypatch):
    monkeypatch.setattr(row_code, "_recorded", {})
    text = chain(13).replace("speed: 10 rad/s", "speed: 0.5 rad/s").replace("1 N m", "f")
    for points in ("[[0 s, 1.5 N m], [5 s, 2 N m], [10 s, 1.5 N m]]", "[[0 s, 1.5 N m], [5 s, 2 N m], [9 s, 4 N m]]"):
        table = f"tables: {{f: {{over: time, points: {points}, period: 10 s}}}}"
        _coded_as_plain(f"{text}{table}\n", monkeypatch)


def test_no_times_are_no_positions():
    run = prepare(Mechanism(**entries_of(TEXTS["chain"])[0]))
    assert status_of(run.solve(np.zeros(0)), (0,)).shape == (0,)
