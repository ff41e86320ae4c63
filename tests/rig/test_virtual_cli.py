"""Rig files and `trunnion rig` as a user meets them."""

import functools
import re
from pathlib import Path

import pytest

import trunnion
from manual.conftest import program
from trunnion.errors import MechanismError
from trunnion.rig.virtual import observe, rig_file
from trunnion.rig.virtual.rig_file import Rig

__all__ = ["program"]

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FOUR_BAR = EXAMPLES / "toleranced-fourbar.yaml"
RIG = EXAMPLES / "rig" / "fourbar-rig.yaml"


@pytest.fixture
def run(program):
    return functools.partial(program, "rig")


@pytest.mark.slow
def test_files_of_a_rig(run, tmp_path):
    planned = run(FOUR_BAR, RIG)
    assert planned.code == 0
    assert not list(tmp_path.iterdir())
    done = run(FOUR_BAR, RIG, "--out", "data", "--seed", 3, "--set", "schedule.turns=2")
    assert done.code == 2
    assert "schedule" in done.err
    done = run(FOUR_BAR, RIG, "--out", "data", "--seed", 3, "--set", "joint_defaults.friction.coefficient=0.05")
    assert done.code == 0
    assert "wrote data" in done.out
    assert {path.name for path in (tmp_path / "data").iterdir()} == {
        "run-01.csv", "run-02.csv", "run-03.csv", "mapping.yaml", "truth.yaml",
    }  # fmt: skip
    head = (tmp_path / "data" / "run-01.csv").read_text("utf-8").splitlines()[0]
    assert head == "t [s],count,z,T1 [V],T2 [V],n1 [rpm],w2 [V]"
    assert "joints.B.friction.coefficient: 0.05" in (tmp_path / "data" / "truth.yaml").read_text("utf-8")


GOOD = """trunnion-rig: 1
schedule: {turns: 2}
rate: 1 kHz
encoder: {per_turn: 60}
sensors:
  T: {measures: "effort:A", range: 10 N m}
"""


@pytest.mark.spread(12)
@pytest.mark.parametrize(
    ("old", "new", "line", "what", "remedy"),
    [
        ("turns: 2", "turrns: 2", 2, "the key 'turrns' is unknown", "'turns'"),
        ("1 kHz", "1 kg", 3, "the unit 'kg' is not a frequency", "2 kHz"),
        ("1 kHz", "fast", 3, "not a number", "12.5 mV"),
        ("per_turn: 60", "per_turn: 0", 4, "greater than or equal to 1", ""),
        ("trunnion-rig: 1", "trunnion-rig: 2", 1, "version 2", "trunnion-rig: 1"),
        ("trunnion-rig: 1", "trunnion: 1", 1, "is no rig file but a model file", "name a rig file"),
        ("range: 10 N m", "range: -10 N m", 6, "is not above zero", "above"),
        ("range: 10 N m", "bits: 12", 6, "neither span nor range", "span"),
        ("range: 10 N m", "span: 10 N m", 6, "is a span without bits", "bits: 16"),
        ("range: 10 N m", "rangee: 10 N m", 6, "'rangee' is unknown", "'range'"),
        ("range: 10 N m", "per_turn: 60", 6, "a speed only", "rate:"),
        ("range: 10 N m", "column: t", 6, "that of time too", "column"),
        ("turns: 2", "over: {l2: 3:2}", 2, "no range", "FROM:TO:COUNT"),
        ("turns: 2", "over: {l2: 3 mm:2 cm:4}", 2, "no range", "same unit"),
        ("turns: 2", "over: {l2: [1]}, conditions: [{l2: 3 mm}]", 2, "a grid and rows", "not both"),
        ("effort:A", "effort:B", 6, "no driver 'B'", "known: 'A'"),
        ("range: 10 N m", "range: 10 V", 6, "'10 V' is not in N m", ""),
    ],
)
def test_findings_have_line_and_remedy(run, tmp_path, old, new, line, what, remedy):
    assert old in GOOD
    (tmp_path / "rig.yaml").write_text(GOOD.replace(old, new, 1), encoding="utf-8")
    done = run(FOUR_BAR, "rig.yaml")
    assert done.code == 2, done.out
    first = done.err.splitlines()[0]
    assert first.startswith(f"rig.yaml:{line}: error:"), done.err
    assert what in done.err
    assert remedy in done.err


def test_the_page_tells_every_key():
    """Each key of a rig file is on the page."""
    page = (EXAMPLES.parent / "docs" / "how-to" / "virtual-rig.md").read_text("utf-8")
    for part in (Rig, rig_file.Schedule, rig_file.Encoder, rig_file.Sensor, rig_file.Accuracies):
        for name, field in part.model_fields.items():
            assert re.search(rf"\b{re.escape(field.alias or name)}\b", page), (part.__name__, name)


def test_a_range_keeps_its_unit():
    rig = Rig(**{"trunnion-rig": 1, "rate": 100, "sensors": {"a": {"measures": "effort:A"}},
                 "schedule": {"over": {"x": "0 deg:30 deg:4", "y": "-1:1:3", "z": ["1 mm"]}}})  # fmt: skip
    rows = rig.schedule.rows()
    assert len(rows) == 12
    assert rows[0] == {"x": "0 deg", "y": -1.0, "z": "1 mm"}
    assert [row["x"] for row in rows[::3]] == ["0 deg", "10 deg", "20 deg", "30 deg"]
    with pytest.raises(MechanismError, match="more than"):
        Rig(**{"trunnion-rig": 1, "rate": 100, "sensors": {"a": {"measures": "effort:A"}},
               "schedule": {"over": {"x": "0:1:500", "y": "0:1:500"}}}).schedule.rows()  # fmt: skip


def test_files_that_no_rig_has_written_stay(run, tmp_path):
    """Neither the rig file itself nor data of a real rig are written over; those of an earlier run are."""
    small = GOOD.replace("rate: 1 kHz", "rate: 500 Hz")
    for name, there in (("mapping.yaml", small), ("truth.yaml", "a: 1\n"), ("run-01.csv", "t\n"), ("rig.yaml", small)):
        own = tmp_path / name.partition(".")[0]
        own.mkdir()
        (own / name).write_text(there, encoding="utf-8")
        (tmp_path / "rig.yaml").write_text(small, encoding="utf-8")
        done = run(FOUR_BAR, own / name if there is small else "rig.yaml", "--out", own)
        assert (own / name).read_text("utf-8") == there
        assert done.code == (0 if name == "rig.yaml" else 2), done.err
        assert (
            "is read here" if name == "mapping.yaml" else "" if done.code == 0 else "is of no virtual rig"
        ) in done.err
        assert len(list(own.iterdir())) == (4 if done.code == 0 else 1)
    assert run(FOUR_BAR, "rig.yaml", "--out", "rig", "--seed", 2).code == 0


def _files(folder):
    return {str(one.relative_to(folder)): one.read_bytes() for one in folder.rglob("*") if one.is_file()}


@pytest.mark.spread(5)
@pytest.mark.parametrize("where", ["data", "not/yet/there"])
@pytest.mark.parametrize("form", ["csv", "parquet", "tdms"])
@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt(), MemoryError()])
def test_a_rig_that_fails_leaves_nothing(run, tmp_path, monkeypatch, where, form, error):
    """Neither files of the one that failed nor, where there was an earlier one, other ones than its own."""
    pytest.importorskip({"csv": "pandas", "parquet": "pyarrow", "tdms": "nptdms"}[form])
    (tmp_path / "rig.yaml").write_text(GOOD.replace("rate: 1 kHz", "rate: 500 Hz"), encoding="utf-8")
    rig, model = Rig.read(tmp_path / "rig.yaml"), trunnion.read(FOUR_BAR)
    seen = trunnion.rig.observe(model, rig, 1)
    write = observe.WRITERS[form]

    def fails(*arguments):
        write(*arguments)
        raise error

    if where == "data":
        seen.write(tmp_path / where, form)
        (tmp_path / where / "notes.txt").write_text("of the laboratory", encoding="utf-8")
    before, folders = _files(tmp_path), sorted(tmp_path.iterdir())
    with monkeypatch.context() as patched:
        patched.setitem(observe.WRITERS, form, fails)
        with pytest.raises(MechanismError if isinstance(error, OSError) else type(error)) as failure:
            trunnion.rig.observe(model, rig, 2).write(tmp_path / where, form)
    if isinstance(error, OSError):
        assert "No space left" in str(failure.value)
    assert _files(tmp_path) == before
    assert sorted(tmp_path.iterdir()) == folders
    trunnion.rig.observe(model, rig, 2).write(tmp_path / where, form)
    assert set(_files(tmp_path)) >= {f"{where}/{name}" for name in ("mapping.yaml", "truth.yaml", f"run-01.{form}")}
    assert _files(tmp_path) != before
