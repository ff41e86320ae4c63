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
from trunnion import Mechanism, MechanismError
from trunnion.studies.tolerance.first_order import study
from trunnion.studies.tolerance.runner import run
from trunnion.studies.tolerance.sampling import SampleTally, Sampling

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
def known() -> dict[str, tuple[Sampling, dict[str, bytes]]]:
    found = {}
    for method in METHODS:
        one = job(method)
        found[method] = one, bits(run(one).tally)
    return found


def bits(tally: SampleTally) -> dict[str, bytes]:
    """Every array of a tally, byte by byte."""
    arrays = tally.to_arrays().items()
    return {name: array.tobytes() + str((array.shape, array.dtype)).encode() for name, array in arrays}


@pytest.mark.slow
def test_there_is_something_to_lose(known: Any) -> None:
    """Several blocks, failures of more than one kind, both passed and not."""
    one, _ = known["monte-carlo"]
    tally = run(one).tally
    assert one.blocks >= 5
    assert 0 < np.sum(tally.failed) < SAMPLES / 2
    assert known["quasi-monte-carlo"][0].blocks >= 8


CREWS = [
    *(("monte-carlo", jobs, chunk) for jobs, chunk in ((1, 1), (1, 1500), (2, 1), (2, 1500), (3, 1))),
    *(("quasi-monte-carlo", jobs, chunk) for jobs, chunk in ((1, 1), (1, 1500), (3, 1500))),
]


@pytest.mark.slow
@pytest.mark.parametrize(("method", "jobs", "chunk"), CREWS)
def test_same_bits_for_workers_and_portions(known: Any, method: str, jobs: int, chunk: int) -> None:
    one, expected = known[method]
    assert bits(run(one, jobs=jobs, chunk=chunk).tally) == expected


@pytest.mark.slow
def test_same_bits_on_a_local_cluster(known: Any) -> None:
    pytest.importorskip("distributed")
    one, expected = known["monte-carlo"]
    assert bits(run(one, jobs=2, chunk=700, cluster="local").tally) == expected


@pytest.mark.slow
def test_blocks_in_any_order(known: Any) -> None:
    for method in METHODS:
        one, expected = known[method]
        sampler = one.prepare()
        order = np.random.default_rng(2).permutation(one.blocks)
        tally = one.empty()
        for block in order:
            tally = tally.merge(SampleTally.from_arrays(sampler.evaluate(int(block), int(block) + 1).to_arrays()))
        assert bits(tally) == expected


@pytest.mark.slow
def test_stopped_and_resumed(tmp_path: Path) -> None:
    """Ctrl-C after some blocks, the rest by two workers: the same Dataset as in one go, to the last bit."""
    path = tmp_path / "run.npz"

    pressed: list[int] = []

    def stop(samples: int) -> None:
        """Once: two portions may come in at the same time, and a second Ctrl-C ends everything."""
        if samples > 900 and not pressed:
            pressed.append(samples)
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt, match=r"run\.npz: --resume continues"):
        trunnion.tolerance(mechanism(), samples=SAMPLES, steps=STEPS, seed=5, chunk=1, checkpoint=path, progress=stop)
    whole = trunnion.tolerance(mechanism(), samples=SAMPLES, steps=STEPS, seed=5, methods=("linear", "monte-carlo"))
    rest = trunnion.tolerance(
        mechanism(), samples=SAMPLES, steps=STEPS, seed=5, methods=("linear", "monte-carlo"), jobs=2, checkpoint=path,
        resume=True,
    )  # fmt: skip
    xr.testing.assert_identical(rest, whole)
    assert rest["samples"].item() == SAMPLES
    with pytest.raises(MechanismError, match="another job"):
        trunnion.tolerance(mechanism(), samples=SAMPLES, steps=STEPS, seed=6, checkpoint=path, resume=True)


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
    assert found[2]["convergence_mean"].values[0, 2] == found[0]["mean"].values[0]
    assert found[3]["mean"].item() != found[0]["mean"].item()


@pytest.mark.parametrize("engine", ["numpy", "compiled"])
def test_memory_does_not_grow_with_the_samples(engine: str) -> None:
    """Samples are drawn, judged, counted and dropped block by block: four times as many need no more at any time."""
    found = study(fourbar(loaded=True, tolerances={"l3": "±1 mm"}, measures={"peak": {"effort": "A", "as": "maximum"}}))
    first = found.sampling("monte-carlo", 1, 5, engine)
    few, many = (found.sampling("monte-carlo", blocks * first.block_size, 5, engine) for blocks in (3, 12))
    run(few, threads=True)  # what is worked out once: machine code, tables
    peaks = []
    for one in (few, many):
        tracemalloc.start()
        run(one, threads=True)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert many.blocks == 4 * few.blocks
    assert peaks[1] < 1.1 * peaks[0]
