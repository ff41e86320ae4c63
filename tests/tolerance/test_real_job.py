"""A study of a real mechanism: the same bits for any workers and portions, stopped and resumed, on a cluster."""

from __future__ import annotations

import signal
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import trunnion
from toleranced import fourbar
from toy_job import bits
from trunnion import Mechanism, MechanismError
from trunnion.studies.batch import run
from trunnion.studies.tolerance import sampling
from trunnion.studies.tolerance.first_order import study
from trunnion.studies.tolerance.sampling import Sampling

SAMPLES, STEPS = 3000, 120
METHODS = ("monte-carlo", "quasi-monte-carlo")


def mechanism() -> Mechanism:
    """A four-bar with friction, a play, correlated lengths, other distributions, and some that do not go together."""
    joints = fourbar().data()["joints"]
    joints["B"]["pin"] = {"radius": "5 mm", "clearance": "0.03 mm ± 0.01 mm"}
    return fourbar(
        loaded=True,
        joints=joints,
        tolerances={
            "l1": "±0.3 mm", "l2": "±40 mm", "l3": {"limits": "±1 mm", "distribution": "beta", "alpha": 2, "beta": 3},
            "l4": {"limits": "+2/-1 mm", "distribution": "triangular"}, "joints.D.friction.coefficient": "±0.02",
            "links.coupler.mass": {"limits": "±0.05 kg", "distribution": "truncated"}, "drivers.A.speed": "±0.1 rad/s",
        },
        correlations=[{"of": ["l1", "l3"], "coefficient": 0.4}],
        measures={
            "angle": {"angle": "rocker", "limit": "±6 deg"},
            "peak": {"effort": "A", "as": "maximum", "limit": "+1/-0.5 N m"},
            "stroke": {"stroke": "D"},
            "at": {"reaction": "C", "at": "70 deg"},
        },
    )  # fmt: skip


def job(method: str) -> Sampling:
    return study(mechanism(), steps=STEPS).sampling(method, SAMPLES, 5)


@pytest.fixture(scope="module")
def parts() -> dict[str, Any]:
    return {method: run(job(method))[0] for method in METHODS}


@pytest.fixture(scope="module")
def known(parts: dict[str, Any]) -> dict[str, Any]:
    return {method: bits(parts[method]) for method in METHODS}


@pytest.mark.slow
def test_there_is_something_to_lose(parts: dict[str, Any]) -> None:
    """Several blocks, samples without an answer, both passed and not."""
    one = job("monte-carlo")
    samples = one.joined(parts["monte-carlo"])
    assert one.blocks >= 5
    assert 0 < np.count_nonzero(np.isnan(samples.figure).any(axis=0)) < SAMPLES / 2
    assert 0 < np.count_nonzero(samples.passed.all(axis=0)) < SAMPLES
    assert job("quasi-monte-carlo").blocks >= 8


@pytest.mark.slow
def test_same_bits_for_any_workers(known: Any) -> None:
    assert bits(run(job("monte-carlo"), jobs=3)[0]) == known["monte-carlo"]


@pytest.mark.slow
def test_same_bits_on_a_local_cluster(known: Any) -> None:
    pytest.importorskip("distributed")
    assert bits(run(job("quasi-monte-carlo"), jobs=2, cluster="local")[0]) == known["quasi-monte-carlo"]


@pytest.mark.slow
def test_stopped_and_resumed(tmp_path: Path) -> None:
    """Ctrl-C after some blocks, the rest by two workers: the same Dataset as in one go, to the last bit."""
    path = tmp_path / "run.trn"

    def stop(samples: int) -> None:
        if samples > 900:
            signal.raise_signal(signal.SIGINT)

    asked: Any = {"samples": SAMPLES, "steps": STEPS, "methods": ("linear", "monte-carlo")}
    with pytest.raises(KeyboardInterrupt, match=r"run\.trn: the same command goes on"):
        trunnion.tolerance(mechanism(), seed=5, checkpoint=path, progress=stop, **asked)
    rest = trunnion.tolerance(mechanism(), seed=5, jobs=2, checkpoint=path, **asked)
    xr.testing.assert_identical(rest, trunnion.tolerance(mechanism(), seed=5, **asked))
    assert rest["samples"].item() == SAMPLES
    with pytest.raises(MechanismError, match="another job"):
        trunnion.tolerance(mechanism(), seed=6, checkpoint=path, **asked)


def test_seed_and_only_the_seed_changes_samples() -> None:
    """Fewer samples are the first ones; other measures see the same mechanisms."""
    assert study(fourbar()).sampling("monte-carlo", 16384, 1).block_size == 2048
    found = [
        trunnion.tolerance(fourbar(), names, methods=["monte-carlo"], samples=samples, seed=seed)
        for names, samples, seed in (
            (["angle"], 8192, 1), (["angle"], 8192, 1), (["angle"], 16384, 1), (["angle"], 8192, 2),
        )
    ]  # fmt: skip
    xr.testing.assert_identical(found[0], found[1])
    (half,) = np.flatnonzero(found[2]["convergence_samples"].values == 8192)
    assert found[2]["convergence_mean"].values[0, half] == pytest.approx(found[0]["mean"].values[0], rel=1e-14)
    assert found[3]["mean"].item() != found[0]["mean"].item()


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["numpy", "compiled"])
def test_memory_grows_with_the_figures_kept_alone(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three times as many samples need the bytes of their figures more: two copies while they are joined."""
    monkeypatch.setattr(sampling, "CURVES", 100 * 360)
    found = study(fourbar(loaded=True, tolerances={"l3": "±1 mm"}, measures={"peak": {"effort": "A", "as": "maximum"}}))
    first = found.sampling("monte-carlo", 1, 5, engine)
    few, many = (found.sampling("monte-carlo", blocks * first.block_size, 5, engine) for blocks in (2, 6))
    run(few, threads=True)  # what is worked out once: machine code, tables
    peaks = []
    for one in (few, many):
        tracemalloc.start()
        one.joined(run(one, threads=True)[0])
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] - peaks[0] < 0.1 * peaks[0] + 2 * 10 * (many.samples - few.samples)
