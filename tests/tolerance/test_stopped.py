"""Ctrl-C before the first portion of the samples: what is known without them is told, and nothing else breaks."""

from __future__ import annotations

import json
import multiprocessing
import signal
from functools import partial
from pathlib import Path

import pytest

import trunnion
from toleranced import fourbar
from trunnion.results.export import save
from trunnion.views.tolerance.report import report
from trunnion.views.tolerance.tables import tables

LIMITED = {"angle": {"angle": "rocker", "at": "60 deg", "limit": "±1 deg"}}


def interrupt(_: int) -> None:
    signal.raise_signal(signal.SIGINT)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["monte-carlo", "quasi-monte-carlo"])
@pytest.mark.parametrize("jobs", [1, 2])
def test_stopped_before_the_first_portion(method: str, jobs: int, tmp_path: Path) -> None:
    found = trunnion.tolerance(
        fourbar(measures=LIMITED), methods=["linear", method], samples=200_000, jobs=jobs, progress=interrupt
    )
    assert found.attrs["stopped"] == 1
    assert "yield" not in found
    said = [row["what"] for row in json.loads(found.attrs["findings"])]
    assert any("stopped before the end: 0 of" in what for what in said)
    assert "worst case" in str(tables(found)[0])
    assert "stopped before the end" in report(found)
    save(found, tmp_path / "x.csv")
    save(found, tmp_path / "x.nc")
    assert not multiprocessing.active_children()


def test_an_allocation_whose_samples_are_stopped_decides_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    from trunnion.studies.allocation import allocate

    monkeypatch.setattr(allocate, "tolerance", partial(allocate.tolerance, progress=interrupt))
    costs = {"l2": {"model": "power", "B": 1, "k": 1, "unit": "mm"}}
    with pytest.raises(KeyboardInterrupt):
        allocate.allocate(fourbar(measures=LIMITED, costs=costs), criterion="yield")
