"""Options of several verbs: what they mean together; tables, notes and help of the terminal."""

import json

import pandas as pd
import pytest
import xarray as xr
from rich.cells import cell_len
from typer.main import get_command

import trunnion
from manual.test_cli import EXAMPLES
from trunnion.cli import app as cli
from trunnion.cli.options import PLOT_KINDS, over, points
from trunnion.cli.result import QUIET, say, show_rows
from trunnion.cycle.model_measures import Named, vocabulary
from trunnion.errors import Finding, Severity
from trunnion.views.cycle import PLOTS

FOUR_BAR = EXAMPLES / "durango-fourbar.yaml"
STRIBECK = {"joint_defaults.friction.static": "0.5", "joint_defaults.friction.stribeck_speed": "0.1 m/s"}
LAW = ("--friction", "stribeck")
SETTINGS = tuple(part for name, value in STRIBECK.items() for part in ("--set", f"{name}={value}"))
VERBS = [
    ("check",),
    ("analyse", "--steps", 24),
    ("locking", "--steps", 12),
    ("plot", "--steps", 24, "--kind", "torque", "--out", "a.png"),
    ("report", "--steps", 24, "--out", "a.html"),
    ("sweep", "--steps", 24, "--over", "AB=1.9m:2m:2"),
]


@pytest.mark.spread(3)
@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: str(verb[0]))
def test_parameters_of_a_law_that_an_option_names(program, verb):
    """Another law and its parameters by --set, in either order."""
    done = [program(verb[0], FOUR_BAR, *verb[1:], *options) for options in (LAW + SETTINGS, SETTINGS + LAW)]
    assert all(one.code in (0, 1) for one in done), done[0].err
    assert done[0] == done[1]


def test_points_of_a_grid_are_all_combinations():
    assert points(over(["a=0deg:30deg:7", "b=1,2,3"])) == 21
    assert points({}) == 1


def test_the_help_names_every_plot_of_a_cycle():
    """Written out there, for the module of the plots loads matplotlib."""
    assert PLOT_KINDS.replace(" or ", ", ").split(", ") == list(PLOTS)


def test_one_position_instead_of_the_cycle(program):
    """The numbers of `--at` are those of that row of the cycle, the summary of the cycle is the same."""
    mechanism = trunnion.read(FOUR_BAR)
    whole, there = trunnion.analyse(mechanism), trunnion.analyse(mechanism, at="60 deg")
    for name in ("drive_effort", "reaction_force", "friction_power", "link_angle", "locking_margin"):
        wanted = whole[name].isel(position=60)
        assert there[name].isel(position=0).values == pytest.approx(wanted.values, rel=1e-9, abs=1e-9, nan_ok=True)
    own = ("power_residual", "friction_iterations", "positions_solved")  # of the positions
    of_cycle = [[one for one in json.loads(each.attrs["summary"]) if one["name"] not in own] for each in (whole, there)]
    assert of_cycle[0] == of_cycle[1]
    done = program("analyse", FOUR_BAR, "--at", "60deg")
    assert done.code == 0
    assert f"{float(whole['drive_effort'].isel(position=60, driver=0)) / 1e3:.6g}"[:5] in done.out


@pytest.mark.parametrize("words", [("--at", "20mm"), ("--steps", 0)])
def test_what_is_wrong_with_an_option_is_said_of_the_option(program, words):
    done = program("analyse", FOUR_BAR, *words)
    assert (done.code, done.err.startswith(f"error: {words[0]}: ")) == (2, True), done.err


SLIDER, LOOSE = EXAMPLES / "toleranced-slider-crank.yaml", EXAMPLES / "fourbar-with-play.yaml"


@pytest.mark.slow
def test_seats_of_all_joints_by_an_option(program, tmp_path):
    """--seat loaded gives seats, errors and what they cost; free is the mechanism with its pins in the middle."""
    done = program("analyse", SLIDER, "--seat", "loaded", "--out", tmp_path / "a.csv", "--out", tmp_path / "a.nc")
    assert done.code == 0
    assert "transmission error of S" in done.out
    assert "seat iterations" in done.out
    table = pd.read_csv(tmp_path / "a.csv")
    for column in ("P.seat_1_x", "P.end_force_1_x", "P.contact_1_x", "P.seat_xi", "S.seat_2_y", "S.slide_error",
                   "piston.Q.error_x", "P.contact_lost", "seat_rounds"):  # fmt: skip
        assert column in table
    size = (table["P.seat_1_x"] ** 2 + table["P.seat_1_y"] ** 2) ** 0.5
    assert size.to_numpy() == pytest.approx(17e-6, rel=1e-9)  # 16 H7/f7: 16 to 52 µm wide
    with xr.open_dataset(tmp_path / "a.nc") as whole:
        assert whole.seat_offset.dims == ("joint", "end", "axis", "position")
    free = program("analyse", LOOSE, "--seat", "free", "--out", tmp_path / "b.csv")
    assert "P.seat_1_x" not in pd.read_csv(tmp_path / "b.csv")
    assert "are at the middle of their play" in free.err + free.out


def test_the_list(program):
    code, out, _ = program("check", SLIDER, "--set", "crank=52mm", "--list")
    assert code == 0
    assert all(
        name in out for name in ("transmission_angle:Q", "velocity:piston.Q.x", "stroke-position", "O.pin.radius")
    )
    names = {each.name: each for each in vocabulary(trunnion.read(SLIDER).with_values({"crank": "52mm"}))[0]}
    assert names["crank"] == Named("crank", "sweep", "m", 0.052, "52mm")
    assert names["drive-torque"].use == "stated"
    assert names["effort:O"].value == names["drive-torque"].value


HEAD = ["", "linear", "searched", "Monte Carlo", "of variance"]
ROWS = [
    ["peak", "286.579\u00a0N\u00a0m at 245°", "−0.9887 to +0.9784\u00a0N\u00a0m", "286.58\u00a0N\u00a0m", "46\u00a0%"],
    ["99.73 % range", "286.0893 to 287.0702\u00a0N\u00a0m", "", "286.0980 to 287.0377\u00a0N\u00a0m", "—"],
]  # fmt: skip


@pytest.mark.parametrize("columns", [40, 80, 90, 200])
def test_numbers_keep_their_units_and_words_are_whole(columns, monkeypatch, capsys):
    """A table too wide for whole words is shown in parts, each of which names its rows."""
    monkeypatch.setenv("COLUMNS", str(columns))
    show_rows("title", HEAD, ROWS)
    told = capsys.readouterr().out
    assert max(cell_len(line) for line in told.splitlines()) <= columns
    assert (told.count("peak") > 1) == (columns == 40)
    words = [word for row in [HEAD, *ROWS] for cell in row for word in cell.split(" ")]
    assert all(word in told for word in words)


@pytest.mark.parametrize("code", sorted(QUIET))
def test_what_nearly_every_run_has_is_a_note(code, capsys):
    """It is left to the report and to `check`; of the same code a warning is shown."""
    note = Finding("x", code=code, severity=Severity.NOTE)
    say([note])
    assert not capsys.readouterr().err
    say([note], every=True)
    say([Finding("x", code=code, severity=Severity.WARNING)])
    assert capsys.readouterr().err.count("x") == 2


def test_the_help_has_each_verb_once_under_a_question_with_examples_that_are_read():
    commands = get_command(cli.app).commands
    assert sorted(cli._name(verb) for verbs in cli.GROUPS.values() for verb in verbs) == sorted(commands)
    for name, command in commands.items():
        for example in cli.EXAMPLES[name]:
            command.make_context(name, example.split(), resilient_parsing=False)


@pytest.mark.slow
def test_tolerances_are_written_as_asked(program, tmp_path):
    """Tables, the whole result, a figure and a page of one run; with a row of units where that is asked for."""
    files = ["t.csv", "t.parameters.csv", "t.nc", "t.json", "t.svg"]
    asked = ("--steps", 12, "--samples", 200, "--kind", "histogram", "--units-row", "--report", "t.html")
    done = program("tolerance", EXAMPLES / "toleranced-fourbar.yaml", *asked, *(f"--out={name}" for name in files))
    assert done.code == 0, done.err
    assert {path.name for path in tmp_path.iterdir()} == {*files, "t.html"}
    assert done.out.startswith("Four-bar with tolerances\nrocker-angle: angle of link rocker")
    assert json.loads((tmp_path / "t.json").read_text("utf-8"))["attrs"]["seed"] == 1
    table = pd.read_csv(tmp_path / "t.csv", header=[0, 1])
    with xr.open_dataset(tmp_path / "t.nc") as whole:
        assert float(table["yield"].iloc[0, 0]) == float(whole["yield"][0])
    assert "Four-bar with tolerances" in (tmp_path / "t.html").read_text("utf-8")
