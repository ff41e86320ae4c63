"""Which peaks a view cuts: those next to a dead centre or to locking, never that of a load at work."""

import numpy as np
import pytest
import xarray as xr
from ruamel.yaml import YAML
from typer.testing import CliRunner

from trunnion import Mechanism, analyse
from trunnion.cli.app import app
from trunnion.errors import Status
from trunnion.views.curves import ease, usual_peak, whole_peaks
from trunnion.views.shown import plot

SLIDER_CRANK = """
trunnion: 1
space: planar
links:
  frame: {{points: {{O: [0, 0], S: {{at: [0, 0], axis: [1, 0]}}}}}}
  crank: {{points: {{O: [0, 0], P: [35 mm, 0]}}}}
  rod: {{points: {{P: [0, 0], Q: [130 mm, 0]}}}}
  piston: {{points: {{Q: [0, 0], S: {{at: [0, 0], axis: [1, 0]}}}}, mass: {mass}}}
joints:
  O: {{type: revolute, links: [frame, crank], pin: {{radius: 17 mm}}, friction: {mu}}}
  P: {{type: revolute, links: [crank, rod], pin: {{radius: 14 mm}}, friction: {mu}}}
  Q: {{type: revolute, links: [rod, piston], pin: {{radius: 8 mm}}, friction: {mu}}}
  S: {{type: prismatic, links: [frame, piston]}}
drivers: {{{drivers}}}
loads:
  work: {load}
assembly: {{P: [0, 35 mm], Q: [125 mm, 0]}}
"""


def model(text):
    return Mechanism.model_validate(YAML(typ="safe").load(text))


def press(between="330 deg, 340 deg"):
    load = f'{{joint: S, resisting_force: "100 kN * between(drive, {between})", useful: true}}'
    return model(SLIDER_CRANK.format(mu=0.02, mass="2 kg", drivers="O: {speed: 60 rpm}", load=load))


def engine(to="164.9999 mm", load="{joint: O, resisting_torque: 5 N m, useful: true}", mass="0 kg"):
    """Driven by its piston up to the dead centre."""
    drivers = f"S: {{speed: 0.01 m/s, range: [110 mm, {to}]}}"
    return model(SLIDER_CRANK.format(mu=0.001, mass=mass, drivers=drivers, load=load))


def shown(figure):
    """Least and greatest value of the vertical axis of each panel."""
    return [axes.get_ylim() for axes in figure.axes]


def drawn(figure):
    """The greatest magnitude that each panel has a curve of."""
    panels = ([np.asarray(line.get_ydata(), float) for line in axes.lines] for axes in figure.axes)
    return [max(float(np.nanmax(np.abs(values), initial=0.0)) for values in lines) for lines in panels]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["torque", "reactions", "power", "friction-power", "motion"])
def test_a_short_working_stroke_is_shown_whole(kind):
    """Ten of 360 positions carry all of the load, far above the rest."""
    result = analyse(press(), 360)
    assert np.all(ease(result) == 1.0)
    figure = plot(result, kind)
    for (low, high), most in zip(shown(figure), drawn(figure), strict=True):
        assert max(-low, high) >= most
    assert not any("outside" in text.get_text() for axes in figure.axes for text in axes.texts)


def test_what_grows_without_bound_at_a_dead_centre_is_cut_there_and_shown_on_demand():
    result = analyse(engine(), 400)
    effort = np.abs(result["drive_effort"].values[0])
    near = ease(result) < 1.0
    assert near[-1]
    assert not near[:300].any()
    figure = plot(result)
    high, scale = figure.axes[0].get_ylim()[1], drawn(figure)[0] / np.nanmax(effort)
    assert np.nanmax(effort[~near]) * scale < high < np.nanmax(effort) * scale
    assert any("--uncut" in text.get_text() for text in figure.axes[0].texts)
    whole = plot(whole_peaks(result))
    assert whole.axes[0].get_ylim()[1] >= drawn(whole)[0]
    assert not any("outside" in text.get_text() for text in whole.axes[0].texts)


def test_a_load_that_works_next_to_a_dead_centre_is_shown():
    """What rises a hundredfold where the condition has only begun to grow is no dead centre."""
    assert usual_peak(np.append(np.ones(99), 0.8), np.append(np.ones(99), 1000.0)) == 1000.0
    assert usual_peak(np.append(np.ones(99), 0.01), np.append(np.ones(99), 1000.0)) == 1.25


def result_of(condition, status=None, margin=None):
    count = len(condition)
    status = np.zeros(count) if status is None else status
    margin = np.full(count, np.inf) if margin is None else margin
    columns = {"condition": condition, "status": status, "locking_margin": margin}
    return xr.Dataset({name: ("position", np.asarray(values, float)) for name, values in columns.items()})


def test_a_position_is_next_to_a_dead_centre_only_in_one_run_with_it():
    condition = np.full(40, 2.0)
    condition[10:15] = [11, 30, 400, 30, 11]
    condition[30:33] = [11, 30, 11]  # poor, but no dead centre
    status = np.where(condition > 100, int(Status.NEAR_SINGULAR), 0)
    assert np.flatnonzero(ease(result_of(condition, status)) < 1.0).tolist() == [10, 11, 12, 13, 14]


@pytest.mark.parametrize("code", [Status.LOCKED, Status.SINGULAR, Status.NOT_ASSEMBLED])
def test_beside_positions_without_an_answer(code):
    """A run may end abruptly, as where a load locks it, or with what feeds it growing up to there."""
    condition, status = np.full(20, 2.0), np.zeros(20)
    condition[10:], status[10:] = np.nan, int(code)
    assert np.all(ease(result_of(condition, status)) == 1.0)
    condition[8:10] = [12.0, 30.0]
    assert np.flatnonzero(ease(result_of(condition, status)) < 1.0).tolist() == [8, 9]


@pytest.mark.slow
def test_plot_and_report_can_show_all(tmp_path):
    """The page is told that no position may be cut."""
    file, page, picture = (tmp_path / name for name in ("engine.yaml", "page.html", "picture.svg"))
    engine().write(file)
    for switch in ([], ["--uncut"]):
        for words in (["plot", "--kind", "torque", "--out", picture], ["report", "--out", page]):
            done = CliRunner().invoke(app, [words[0], str(file), "--steps", "400", *map(str, words[1:]), *switch])
            assert page.exists() or picture.exists(), done.output + repr(done.exception)
        assert ('"ease":[1.0]' in page.read_text("utf-8").replace(" ", "")) == bool(switch)
        assert ("near a dead centre" in picture.read_text("utf-8")) != bool(switch)


@pytest.mark.parametrize(("periodic", "eased"), [(1, [0, 1, 11]), (0, [11])])
def test_a_run_goes_on_from_the_last_position_to_the_first(periodic, eased):
    condition, status = np.ones(12), np.zeros(12, int)
    condition[[0, 1, 3, 11]], status[11] = 10.0, Status.NEAR_SINGULAR
    drive = xr.Variable("position", 30.0 * np.arange(12), {"units": "°", "long_name": "angle of A"})
    result = xr.Dataset(
        {"condition": ("position", condition), "status": ("position", status)}, {"drive": drive}, {"periodic": periodic}
    )
    assert np.flatnonzero(ease(result) < 1).tolist() == eased
