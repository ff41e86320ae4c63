"""Limits that are missed are errors, told first, with advice that works."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from typer.testing import CliRunner

import trunnion
from toleranced import FOURBAR, fourbar, fourbar_angle
from trunnion import Mechanism
from trunnion.cli.app import app
from trunnion.studies.allocation.allocate import half_widths

NOMINAL = float(fourbar_angle(**FOURBAR))
COSTS = {name: {"model": "power", "B": 1, "k": 1, "unit": "mm"} for name in FOURBAR}


def missed(found: xr.Dataset) -> list[dict[str, Any]]:
    rows = json.loads(found.attrs["findings"])
    return [row for row in rows if row["severity"] == "error" and row["where"].startswith("measures.")]


def made(**limits: Any) -> dict[str, Any]:
    return {"measures": {"angle": {"angle": "rocker", "at": "60 deg", **limits}}}


@pytest.mark.parametrize(
    ("limits", "methods", "told"),
    [
        ({"limit": "±0.5 deg"}, ["linear", "worst-case", "monte-carlo"], ()),
        ({"limit": "±0.1 deg"}, ["linear"], ("worst case",)),
        ({"limit": "±0.1 deg"}, ["linear", "worst-case"], ("worst case",)),
        ({"limit": "±0.05 deg"}, ["monte-carlo"], ("yield", "Cpk")),
        ({"limit": "±0.05 deg"}, ["linear", "worst-case", "monte-carlo"], ("worst case", "yield", "Cpk")),
        ({"at_most": NOMINAL + 1e-3}, ["linear"], ("worst case", "at most")),
        ({"at_least": NOMINAL - 1e-2, "at_most": NOMINAL + 1e-2}, ["linear", "monte-carlo"], ()),
    ],
)
def test_what_is_outside_the_limits(limits: dict[str, Any], methods: list[str], told: tuple[str, ...]) -> None:
    found = trunnion.tolerance(fourbar(**made(**limits)), methods=methods, samples=2000)
    rows = missed(found)
    assert bool(rows) == bool(told)
    for word in told:
        assert word in rows[0]["what"]
    assert len(json.loads(found.attrs["missed"])) == len(rows)


def test_a_wide_scatter_within_the_worst_case_breaks_nothing() -> None:
    """A uniform number that fills its limits: C_pk is 0.58, and yet no mechanism is outside."""
    limit = 1.02 * 0.05e-3 * abs(float(fourbar_angle(**FOURBAR | {"l3": 0.09 + 1e-6}) - NOMINAL)) / 1e-6
    tolerances = {"l3": {"limits": "±0.05 mm", "distribution": "uniform"}}
    found = trunnion.tolerance(fourbar(tolerances=tolerances, **made(limit=limit)), samples=2000)
    assert found["cpk"].item() < 0.7
    assert not missed(found)


def advice(mechanism: Mechanism) -> str:
    rows = missed(trunnion.tolerance(mechanism, methods=["linear", "worst-case"]))
    assert len(rows) == 1
    return str(rows[0]["remedy"])


def test_a_nominal_figure_outside_is_not_mended_by_tolerances() -> None:
    """Nor does `allocate` mend it, which says so too."""
    mechanism = fourbar(**made(at_most=NOMINAL - 1e-3), costs=COSTS)
    assert "tolerances cannot correct it" in advice(mechanism)
    assert "allocate" not in advice(mechanism)
    assert not trunnion.allocate(mechanism, samples=0).attrs["found"]


def test_tolerances_to_one_side_are_not_mended_by_narrower_ones() -> None:
    mechanism = fourbar(tolerances={"l3": "+0.3/+0.2 mm"}, **made(limit="±0.05 deg"), costs={"l3": COSTS["l3"]})
    assert "centre them or change the nominal mechanism" in advice(mechanism)
    assert not trunnion.allocate(mechanism, samples=0).attrs["found"]


def test_what_allocate_can_mend() -> None:
    mechanism = fourbar(**made(limit="±0.1 deg"), costs=COSTS)
    told = advice(mechanism)
    assert "`trunnion allocate` finds the cheapest tolerances" in told
    found = trunnion.allocate(mechanism, samples=0)
    assert found.attrs["found"]
    mended = mechanism.with_tolerances(half_widths(found))
    assert not missed(trunnion.tolerance(mended, methods=["linear", "worst-case"]))
    assert "if the model states `costs`" in advice(fourbar(**made(limit="±0.1 deg")))


def test_rss_whose_yield_is_short_is_an_error() -> None:
    """Uniform numbers fill their limits: what RSS keeps within the limit three in a hundred break."""
    tolerances = {name: {"limits": "±0.05 mm", "distribution": "uniform"} for name in FOURBAR}
    mechanism = fourbar(tolerances=tolerances, **made(limit="±0.08 deg"), costs=COSTS)
    found = trunnion.allocate(mechanism, criterion="rss", samples=4000)
    assert found["yield"].item() < 0.99
    rows = missed(found)
    assert (rows[0]["code"], rows[0]["figures"]["target"]) == ("yield.below_rss", 0.9973)
    better = trunnion.allocate(mechanism, criterion="yield", target=0.9973, samples=4000)
    assert not missed(better)


# ---- the command line -----------------------------------------------------------------------------------------


def run(tmp_path: Path, mechanism: Mechanism, *arguments: str) -> tuple[int, str, str]:
    path = tmp_path / "model.yaml"
    path.write_text(json.dumps(mechanism.data()), encoding="utf-8")
    told = CliRunner().invoke(app, [arguments[0], str(path), *arguments[1:]])
    return told.exit_code, told.stdout, told.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("limit", "code"), [("±0.05 deg", 1), ("±0.5 deg", 0)])
def test_the_first_line_and_the_exit_status(tmp_path: Path, limit: str, code: int) -> None:
    page = tmp_path / "x.html"
    status, out, err = run(
        tmp_path, fourbar(name="Bar", **made(limit=limit)), "tolerance", "--samples", "500", "--report", str(page)
    )
    assert status == code
    assert out.startswith("measures.angle: limits not met: worst case") == bool(code)
    assert ("limits not met" in err) == bool(code)
    body = page.read_text("utf-8").partition("<main>")[2]
    first = re.sub(r"<[^>]+>", "", body).strip().partition("\n")[0]
    assert first.startswith("Error measures.angle limits not met") == bool(code)


@pytest.mark.parametrize(("asked", "fine"), [(0.9, True), (0.9999, False)])
def test_a_yield_that_is_asked_for_decides_alone(asked: float, fine: bool) -> None:
    """The worst case is far outside either way."""
    mechanism = fourbar(**made(limit="±0.06 deg"))
    found = trunnion.tolerance(mechanism, samples=4000, target=asked)
    assert 0.95 < found["yield"].item() < 0.999
    assert bool(missed(found)) != fine
    assert missed(trunnion.tolerance(mechanism, samples=4000))


@pytest.mark.parametrize("coefficient", [0.0, 0.9])
def test_what_to_narrow_first_for_a_yield_is_by_variance(coefficient: float) -> None:
    """It decides a yield, and the worst case knows no correlation."""
    text = made(limit="±0.01 deg")
    together = [{"of": ["l2", "l3", "l4"], "coefficient": coefficient}] if coefficient else []
    result = trunnion.tolerance(fourbar(**text, correlations=together), methods=["linear", "monte-carlo"], samples=2000,
                                target=0.99)  # fmt: skip
    parts = result["contribution_variance"].sel(measure="angle")
    top = str(parts["parameter"].values[int(parts.values.argmax())])
    share = 100 * float(parts.max() / parts.sum())
    (row,) = missed(result)
    assert f"'{top}', {share:.3g} % of the variance" in row["remedy"]
