"""What is shown and written of joints in play: figures, tables, summary."""

from __future__ import annotations

import functools

import numpy as np
import pytest
import xarray as xr
from test_report import Page

import trunnion
from playing import rattling
from playing_space import rattling_in_space
from trunnion.dynamics.spectrum import spectrum
from trunnion.errors import MechanismError
from trunnion.results.tables import columns
from trunnion.views.motion.figure import figure
from trunnion.views.motion.report import report


@functools.cache
def rattled() -> xr.Dataset:
    return trunnion.simulate(rattling(), duration=7e-4, steps=700)


def test_the_path_of_the_pin_lies_in_its_hole() -> None:
    made = figure(rattled(), "orbit")
    (axes,) = made.axes
    lines = {len(line.get_xdata()): line for line in axes.lines}
    (wall,), path = axes.patches, lines[701]
    assert wall.get_radius() == pytest.approx(500.0)  # µm
    assert np.nanmax(np.hypot(*path.get_data())) == pytest.approx(500 + 77.9, abs=0.3)
    assert "45.8" in axes.get_title(loc="left")


def test_each_end_of_a_pin_in_space_has_its_hole() -> None:
    result = trunnion.simulate(rattling_in_space(), duration=3e-4, steps=100)
    panels = figure(result, "orbit").axes
    assert [axes.get_title(loc="left").partition(":")[0] for axes in panels] == ["Q.end_1", "Q.end_2"]
    for axes in panels:
        path = next(line for line in axes.lines if len(line.get_xdata()) == 101)
        assert np.nanmax(np.hypot(*path.get_data())) == pytest.approx(500 + 77.9, abs=0.5)
    named = [name for name, *_ in columns(result) if "offset" in name]
    assert named[:3] == [f"Q.end_1.contact_offset.{axis}" for axis in "xyz"]
    assert len(named) == 3 * 4


def test_gaps_and_forces_over_time() -> None:
    (gaps,), (forces,) = figure(rattled(), "gaps").axes, figure(rattled(), "contacts").axes
    assert gaps.get_ylabel() == "gap [µm]"
    assert forces.get_ylabel() == "contact force [kN]"
    drawn = max((line for line in forces.lines if len(line.get_xdata()) > 100), key=lambda line: len(line.get_xdata()))
    assert np.nanmax(drawn.get_ydata()) == pytest.approx(45.8, abs=0.1)


@pytest.mark.slow
def test_the_report_has_force_gap_orbit_and_spectrum() -> None:
    page = Page(report(rattled()))
    assert not page.open
    (contact,) = page.scene()["motion"]["contacts"]
    assert contact["name"] == "Q"
    assert max(contact["force"]) == pytest.approx(float(rattled()["contact_normal_force"].max()), rel=1e-6)
    assert contact["gap"] == pytest.approx(rattled()["contact_gap"].values[0], rel=1e-6)
    pictures = [attrs["alt"] for tag, attrs in page.tags if tag == "img"]
    assert len(pictures) == 2
    assert "holes" in pictures[0]
    assert "frequency" in pictures[1]


def test_a_motion_without_play_has_no_such_figures() -> None:
    result = trunnion.simulate(trunnion.read("examples/flywheel-press.yaml"), duration=1e-3, steps=1)
    for kind in ("orbit", "gaps", "contacts", "spectrum"):
        with pytest.raises(MechanismError) as raised:
            figure(result, kind)
        assert [finding.where for finding in raised.value.findings] == [f"--kind {kind}"]


def test_columns_of_contacts_and_impacts() -> None:
    times = {name: (unit, values) for name, unit, values in columns(rattled())}
    assert times["Q.contact_gap"][0] == "m"
    assert times["Q.contact_gap"][1][0] == pytest.approx(5e-4)
    assert times["Q.contact_offset.x"][1][0] == pytest.approx(0.0, abs=1e-15)
    assert {"work_contact", "contact_energy", "Q.reaction_x"} <= times.keys()
    impacts = {name: (unit, values) for name, unit, values in columns(rattled(), "impacts")}
    assert list(impacts["contact"][1]) == ["Q", "Q"]
    assert impacts["approach"][0] == "m/s"
    assert impacts["approach"][1][0] == pytest.approx(4.38578315, rel=1e-8)


def test_the_spectrum_of_harmonics_is_theirs() -> None:
    """Hann's window: a constant, and amplitudes on frequencies, each with half of it beside; Parseval's equation."""
    count, step = 400, 1e-3
    time = step * np.arange(count)
    forces = 7.0 + 3.0 * np.cos(2 * np.pi * 50 * time + 0.4) + 0.5 * np.sin(2 * np.pi * 180 * time)
    frequency, amplitude = spectrum(time, forces)
    assert frequency[[1, -1]] == pytest.approx([2.5, 500])
    at = {place: k for k, place in enumerate(np.round(frequency, 6))}
    assert amplitude[[at[0.0], at[50.0], at[180.0]]] == pytest.approx([7.0, 3.0, 0.5], rel=1e-12)
    assert amplitude[[at[47.5], at[52.5]]] == pytest.approx([1.5, 1.5], rel=1e-12)
    assert amplitude[at[100.0]] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("last", [700, 701])
def test_the_spectrum_holds_the_square_of_the_force(last: int) -> None:
    """Parseval: Σ (w F)²/(Σw)² N is the sum of the squares of the two-sided amplitudes, for even and odd numbers."""
    time, force = rattled()["time"].values[:last], rattled()["contact_normal_force"].values[:, :last]
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(last) / last)
    _, amplitude = spectrum(time, force)
    ends = amplitude[0, 0] ** 2 + (amplitude[0, -1] ** 2 if last % 2 == 0 else 0.0)
    inner = np.sum(amplitude[0, 1 : -1 if last % 2 == 0 else None] ** 2) / 2
    assert ends + inner == pytest.approx(last * np.sum((window * force[0]) ** 2) / np.sum(window) ** 2, rel=1e-12)
    assert rattled()["contact_force_amplitude"].shape == (1, rattled().sizes["frequency"])


def test_the_spectrum_as_table_and_figure() -> None:
    table = {name: (unit, values) for name, unit, values in columns(rattled(), "spectrum")}
    assert [unit for unit, _ in table.values()] == ["Hz", "N"]
    assert table["frequency"][1][1] == pytest.approx(1 / (701 * 1e-6))
    (axes,) = figure(rattled(), "spectrum").axes
    assert axes.get_ylabel() == "amplitude [kN]"
    assert "more --steps" not in axes.get_title(loc="left")
    coarse = trunnion.simulate(rattling(), duration=7e-4, steps=20)
    assert "more --steps" in figure(coarse, "spectrum").axes[0].get_title(loc="left")
