"""The command line as a user meets it: every verb; every fault with message and exit status, nothing half-written."""

import csv
import json
import subprocess
import sys

import pytest

from mechanisms_parts import EXAMPLES

FOUR_BAR = EXAMPLES / "durango-fourbar.yaml"


def model(tmp_path, change, name="model.yaml"):
    """The four-bar with its text changed."""
    text = FOUR_BAR.read_text("utf-8")
    changed = change(text)
    assert changed != text
    path = tmp_path / name
    path.write_text(changed, "utf-8")
    return path


def table(path):
    """Rows of a CSV file."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def files(folder):
    return {path.name for path in folder.iterdir()}


@pytest.mark.slow
def test_analyse_prints_the_figures_of_the_case_study_and_writes_every_format(program, tmp_path):
    done = program("analyse", FOUR_BAR, "--out", "r.csv", "--out", "r.nc", "--out", "r.json", "--report", "r.html")
    assert done.code == 0
    for figure in ("−18.5698 │ kN m", "9.28831 │ kN m", "517.466", "2.37558", "I(0,1)R → II(2,3)RRR"):
        assert figure in done.out
    assert files(tmp_path) == {"r.csv", "r.nc", "r.json", "r.html"}
    rows = table(tmp_path / "r.csv")
    assert len(rows) == 360
    assert float(rows[60]["A.effort"]) == pytest.approx(3393.503681, abs=1e-6)
    assert rows[0]["status"] == "zero_slip"
    assert rows[1]["status"] == "solved"
    assert json.loads((tmp_path / "r.json").read_text("utf-8"))["attrs"]["formula"] == "I(0,1)R → II(2,3)RRR"


def test_set_replaces_dimensions_and_paths(program):
    plain = program("analyse", FOUR_BAR).out
    longer = program("analyse", FOUR_BAR, "--set", "AB=2.1m").out
    assert longer != plain
    assert program("analyse", FOUR_BAR, "--set", "AB=2100 mm").out == longer
    assert program("analyse", FOUR_BAR, "--set", "B.friction.coefficient=0.1").out != plain


@pytest.mark.slow
def test_points_come_from_a_csv_file(program, tmp_path):
    """Every verb that reads a model takes them; what is wrong with the file has its line."""
    (tmp_path / "motion.csv").write_text("time [s];angle [deg]\n0;0\n0,5;60\n1;90\n", encoding="utf-8")
    option = ("--table", "A=motion.csv")
    assert program("analyse", FOUR_BAR, *option, "--steps", "11", "--out", "r.csv").code == 0
    rotation = [float(row["A.rotation"]) for row in table(tmp_path / "r.csv")]
    assert rotation[0] == 0
    assert rotation[5] == pytest.approx(1.0471975511965976)
    for verb in (["check"], ["design"], ["plot", "--out", "p.svg", "--kind", "torque"], ["report", "--out", "r.html"]):
        assert program(verb[0], FOUR_BAR, *verb[1:], *option).code == 0
    assert program("analyse", FOUR_BAR, *option, "--set", "A.points.2.coordinate=80deg", "--steps", "5").code == 0
    (tmp_path / "motion.csv").write_text("0;0\n0,5;60 deg\n", encoding="utf-8")
    outcome = program("check", FOUR_BAR, *option)
    assert outcome.code == 2
    assert "motion.csv:2: error: '60 deg' is not a finite number — " in outcome.err


@pytest.mark.slow
def test_check_lists_the_ways_and_draws_them(program, tmp_path):
    done = program("check", FOUR_BAR, "--assemblies", "ways.svg")
    assert done.code == 0
    shown = [line.strip() for line in done.out.splitlines()]
    first = shown.index("way-1  C (7.60714, 2.1354) m  <- used")
    assert shown[first + 1] == "way-2  C (7.60714, -2.1354) m"
    assert shown[first + 2] == "to use another: assembly: {coupler: way-2}"
    assert "wrote ways.svg" in done.out
    assert b"<!-- coupler: way-2 -->" in (tmp_path / "ways.svg").read_bytes()
    assert files(tmp_path) == {"ways.svg"}


@pytest.mark.parametrize("verb", ["check", "report"])
@pytest.mark.parametrize(
    ("hint", "told"),
    [
        ("coupler: way-9", "the links coupler, rocker have no assembly mode 'way-9' — the modes are way-1, way-2"),
        ("crank: way-1", "the link 'crank' follows the driver A"),
        ("coupler: way-1, rocker: way-2", "'way-2' contradicts 'way-1' of the link 'coupler'"),
        ("ground: way-1", "'ground' is none"),
        ("coupler: way-x", "'way-x' is not the name of an assembly mode"),
    ],
)
def test_a_wrong_name_of_an_assembly_is_found_in_its_line(program, tmp_path, verb, hint, told):
    path = model(tmp_path, lambda text: text.replace("C: [7.6, 2.1]", hint))
    line = next(i for i, one in enumerate(path.read_text("utf-8").splitlines(), 1) if hint in one)
    done = program(verb, path, *(["--out", "r.html"] if verb == "report" else []))
    assert done.code == 2
    assert done.err.startswith(f"{path}:{line}: error: assembly.")
    assert told in done.err
    assert files(tmp_path) == {"model.yaml"}


def test_examples_are_listed_and_copied(program, tmp_path):
    assert "durango-fourbar" in program("examples").out
    assert program("examples", "durango-fourbar").code == 0
    assert (tmp_path / "durango-fourbar.yaml").read_bytes() == FOUR_BAR.read_bytes()
    again = program("examples", "durango-fourbar")
    assert again.code == 2
    assert "--force" in again.err
    assert program("examples", "durango-fourbar", "--force").code == 0
    assert "durango-fourbar" in program("examples", "nothing-like-it").err


def test_schema_is_shown_and_written(program, tmp_path):
    shown = json.loads(program("schema").out)
    assert "links" in shown["properties"]
    assert program("schema", "--out", "s.json").code == 0
    assert json.loads((tmp_path / "s.json").read_text("utf-8")) == shown


def test_units_row_comes_only_on_request(program, tmp_path):
    for options in ((), ("--units-row",)):
        program("analyse", FOUR_BAR, "--steps", "4", "--out", "r.csv", *options)
        head, *rows = (tmp_path / "r.csv").read_text("utf-8").splitlines()
        assert len(rows) == 4 + len(options)
        assert "A.rotation" in head.split(",")
        assert (rows[0].split(",")[:3] == ["s", "rad", "rad/s"]) == bool(options)


def test_a_linkage_that_does_not_close_everywhere_says_where_and_by_how_much(program, tmp_path):
    done = program("analyse", FOUR_BAR, "--set", "AB=4m", "--out", "r.csv")
    assert done.code == 1
    assert "cannot be assembled" in done.err
    assert "|BD| exceeds BC + CD by up to" in done.err
    rows = table(tmp_path / "r.csv")
    solved = [row for row in rows if row["status"] in ("solved", "zero_slip")]
    missing = [row for row in rows if row["status"] == "not_assembled"]
    assert solved
    assert missing
    assert all(row["A.effort"] for row in solved)
    assert not any(row["A.effort"] or row["coupler.C.x"] for row in missing)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--steps", "0"], "steps"), (["--set", "AX=1"], "AB"), (["--set", "AB=2 kg"], "mass"),
        (["--set", "AB=-1 m;import os"], "AB"), (["--friction", "kulomb"], "coulomb"),
        (["--method", "magic"], "newton"), (["--criterion", "-1"], "criterion"), (["--out", "r.ods"], ".csv"),
        (["--units-row"], "--units-row: has no effect"), (["--units", "model"], "--units: has no effect"),
        (["--columns", "all"], "--columns: has no effect"), (["--out", "r.csv", "--columns", "A.efort"], "A.effort"),
    ],
)  # fmt: skip
def test_bad_options_are_refused_with_a_message(program, tmp_path, options, word):
    done = program("analyse", FOUR_BAR, *options)
    assert done.code == 2
    assert word in done.err
    assert not files(tmp_path)


@pytest.mark.parametrize(("words", "status"), [(["check", str(FOUR_BAR)], 0), (["analyse", "missing.yaml"], 2)])
def test_the_process_ends_at_once_but_with_all_that_is_due(words, status):
    """What was printed is written, what was to be done at the end is done; modules are not taken down one by one."""
    begin = """
import atexit, sys
from trunnion.__main__ import main
import trunnion.cli.app as app
app.VERBS[0].callback.undone = type("Undone", (), {"__del__": lambda _: print("taken down")})()
run = app.main
def started():
    atexit.register(print, "at the end")
    run()
app.main = started
main()
"""
    done = subprocess.run([sys.executable, "-c", begin, *words], capture_output=True, text=True, check=False)
    assert done.returncode == status
    assert done.stdout.splitlines()[-1] == "at the end"
    assert bool(done.stderr) == bool(status)


def test_help_needs_no_heavy_imports():
    """What keeps `trunnion --help` quick."""
    heavy = ("numpy", "xarray", "pint", "matplotlib")
    code = f"import sys, trunnion.cli.app; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
