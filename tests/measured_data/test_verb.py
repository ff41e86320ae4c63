"""`trunnion data` as a user meets it: tables, files, findings, and nothing half-written."""

import csv
import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import trunnion
from manual.conftest import program
from measured_data.recording import mapping, recorded, text_of
from trunnion.errors import MechanismError
from trunnion.rig.reading.measurement import dataset
from trunnion.rig.reading.tables import read_table

__all__ = ["program"]  # a fixture


@pytest.fixture
def rig(tmp_path):
    (tmp_path / "a.csv").write_text(text_of(recorded()), "utf-8")
    entry = {"file": "a.csv", "set": {"beta": "15 deg"}}
    text = json.dumps(mapping({"files": [entry], "set": {"input.speed": {"mean": "speed-in"}}}))
    (tmp_path / "rig.json").write_text(text, encoding="utf-8")
    return tmp_path / "rig.json"


def test_tables_and_files(program, rig, tmp_path):
    for package in ("h5netcdf", "pyarrow"):
        pytest.importorskip(package)
    code, out, err = program(
        "data", "rig.json", "--units-row", *(f"--out=c{end}" for end in (".csv", ".nc", ".parquet", ".json"))
    )
    assert (code, err) == (0, "")
    for text in (
        "15 deg",
        "19",
        "600",
        "torque-in",
        "effort:input",
        "19 whole turns",
        "zero of torque-in",
        "wrote c.nc",
    ):
        assert text in out
    read = trunnion.rig.read(rig)
    course = read.conditions[0].courses["torque-in"]
    table = pd.read_csv(tmp_path / "c.csv", skiprows=[1])
    assert len(table) == 90
    assert table["torque-in.mean"].to_numpy() == pytest.approx(course.mean)
    assert table["torque-in.uncertainty"].to_numpy() == pytest.approx(course.uncertainty)
    assert table["beta"].to_numpy() == pytest.approx(np.radians(15))
    assert table["input.speed"].to_numpy() == pytest.approx(20 * np.pi, rel=1e-4)
    assert set(table["condition"]) == {"beta 15 deg"}
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "c.parquet"), table, check_dtype=False)
    with xr.open_dataset(tmp_path / "c.nc") as whole:
        assert whole["mean"].dims == ("condition", "channel", "position")
        np.testing.assert_array_equal(whole["mean"].sel(channel="torque-in")[0], course.mean)
        assert json.loads(whole.attrs["measured"])[0] == "effort:input"


def test_faults_and_bad_input(program, rig, tmp_path):
    columns = recorded()
    columns["T2"] *= -1
    (tmp_path / "b.csv").write_text(text_of(columns), "utf-8")
    code, out, err = program("data", "rig.json", "a.csv", "b.csv")
    assert code == 1
    assert "beta 15 deg" in out  # the other condition has its file for a name
    assert err.startswith("b.csv: warning: channels.brake: sign: the power of load:brake is negative in 19 of 19 turns")
    pd.DataFrame(columns).drop(columns=["T1", "n2"]).to_csv(tmp_path / "b.csv", index=False)
    code, out, err = program("data", "rig.json", "a.csv", "b.csv", "--out", "c.csv")
    assert (code, out) == (2, "")
    assert "b.csv: error: there is no column 'T1', 'n2'; the file has 't', 'T2', 'n1', 'encoder', 'angle'" in err
    assert not (tmp_path / "c.csv").exists()
    code, _, err = program("data", "rig.json", "--out", "c.ods")
    assert code == 2
    assert "cannot write" in err
    code, _, err = program("data", "missing.yaml")
    assert code == 2
    assert "cannot be read" in err


def test_results_are_not_written_over_what_is_read(program, rig, tmp_path):
    (tmp_path / "link.csv").symlink_to(tmp_path / "a.csv")
    (tmp_path / "b.csv").write_bytes((tmp_path / "a.csv").read_bytes())
    before = {name: (tmp_path / name).read_bytes() for name in ("a.csv", "b.csv", "rig.json")}
    for named, out in (([], "a.csv"), ([], "link.csv"), ([], "rig.json"), (["b.csv"], "b.csv")):
        code, _, err = program("data", "rig.json", *named, "--out", out)
        assert code == 2
        assert "is read here, and would be written over by --out — name another file" in err
    assert {name: (tmp_path / name).read_bytes() for name in before} == before
    assert program("data", "rig.json", "b.csv", "--out", "a.csv").code == 0  # it is not read here


def test_no_text_of_a_table_is_a_formula(tmp_path):
    """Names of conditions and of what was set come from files; a spreadsheet must not execute them."""
    path = tmp_path / "=cmd|calc!A1.csv"
    path.write_text(text_of(recorded(turns=3)), "utf-8")
    trunnion.save(dataset(trunnion.rig.read(mapping(), [path])), tmp_path / "one.csv")
    assert set(pd.read_csv(tmp_path / "one.csv")["condition"]) == {"'=cmd|calc!A1"}
    found = trunnion.rig.read(mapping({"set": {"@beta": "-15 deg"}}), [path])
    trunnion.save(dataset(found), tmp_path / "two.csv", units_row=True)
    with (tmp_path / "two.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0][1] == "'@beta"
    assert not [cell for row in rows for cell in row if cell[:1] in tuple("=+@") or cell[:2] == "-c"]
    own = read_table(tmp_path / "two.csv", ["@beta", "phase"])  # our own reader knows the name
    assert own.columns["@beta"].values == pytest.approx(np.radians(-15))
    with pytest.raises(MechanismError, match="begins with '='"):
        trunnion.rig.read(mapping({"channels": {"=T1": mapping()["channels"]["brake"]}}), [path])
