"""Ctrl-C in a tolerance study: nothing is told of a part of the samples, and nothing is left running."""

from __future__ import annotations

import multiprocessing
import signal
from functools import partial

import pytest

import trunnion
from toleranced import fourbar

LIMITED = {"angle": {"angle": "rocker", "at": "60 deg", "limit": "±1 deg"}}


def interrupt(_: int) -> None:
    signal.raise_signal(signal.SIGINT)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["monte-carlo", "quasi-monte-carlo"])
@pytest.mark.parametrize("jobs", [1, 2])
def test_stopped_before_the_first_portion(method: str, jobs: int) -> None:
    with pytest.raises(KeyboardInterrupt):
        trunnion.tolerance(
            fourbar(measures=LIMITED), methods=["linear", method], samples=200_000, jobs=jobs, progress=interrupt
        )
    assert not multiprocessing.active_children()


def test_an_allocation_whose_samples_are_stopped_decides_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    from trunnion.studies.allocation import allocate

    monkeypatch.setattr(allocate, "tolerance", partial(allocate.tolerance, progress=interrupt))
    costs = {"l2": {"model": "power", "B": 1, "k": 1, "unit": "mm"}}
    with pytest.raises(KeyboardInterrupt):
        allocate.allocate(fourbar(measures=LIMITED, costs=costs), criterion="yield")
