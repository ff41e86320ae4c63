"""Machine code settles friction as NumPy does, also where it locks, turns round or cannot be assembled."""

from pathlib import Path

import numpy as np
import pytest
from benchmarks.studio import chain

from trunnion.algebra.dual import Dual
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism
from trunnion.solve import backward, settle_code
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.margin import margin_in
from trunnion.solve.run import prepare
from trunnion.solve.status import status_of

EXAMPLES = Path(__file__).parents[2] / "examples"
STEPS = 90
TEXTS = {
    "chain": chain(13),
    **{name: (EXAMPLES / f"{name}.yaml").read_text("utf-8") for name in ("jansen", "drawing-press", "scotch-yoke")},
    "locked": (EXAMPLES / "drawing-press.yaml").read_text("utf-8").replace("friction: 0.1", "friction: 0.4"),
    "cardan": (EXAMPLES / "pezzuti-cardan.yaml").read_text("utf-8"),
}


@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("positions", [slice(None), slice(7, 8), slice(0, 3)])
def test_machine_code_settles_friction_as_numpy_does(name, positions, monkeypatch):
    run = prepare(Mechanism(**entries_of(TEXTS[name])[0]))
    time = run.cycle.times(STEPS)[positions]
    ran, run_code = [], settle_code._run
    monkeypatch.setattr(settle_code, "_run", lambda *given: ran.append(given) or run_code(*given))
    backs = []
    with np.errstate(all="ignore"):
        for many in (10**9, 1):
            monkeypatch.setattr(backward, "MANY_MODULES", many)
            assert not ran
            backs.append(run.solve(time, method=FrictionMethod()))
        plain, coded = backs
        margins = [np.broadcast_to(margin_in(back, 3.0), time.shape) for back in backs]
    assert ran
    np.testing.assert_array_equal(*(status_of(back, time.shape) for back in backs))
    np.testing.assert_allclose(margins[1], margins[0], rtol=1e-9)
    parts = [np.ravel(np.abs(part)) for wrench in plain.reactions.values() for part in wrench]
    size = np.fmax.reduce(np.concatenate(parts))  # NaN where all of it is locked
    for joint, wrench in plain.reactions.items():
        for part, other in zip(wrench, coded.reactions[joint], strict=True):
            np.testing.assert_allclose(other, part, rtol=0, atol=1e-12 * np.nan_to_num(size))
    for settled, other in zip(plain.settled, coded.settled, strict=True):
        for what in ("iterations", "converged", "certain", "share"):
            np.testing.assert_allclose(getattr(other, what), getattr(settled, what), rtol=1e-9, err_msg=what)


def test_equations_of_one_kind_share_their_code(monkeypatch):
    monkeypatch.setattr(settle_code, "_codes", {})
    run = prepare(Mechanism(**entries_of(chain(20))[0]))
    run.solve(run.cycle.times(STEPS))
    assert len(settle_code._codes) <= 2  # the last dyad, which the resisting torque loads, may have other zeros


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
