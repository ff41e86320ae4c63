"""`trunnion identify` as it is called: tables, files, figures, report, the model written back, and what is refused."""

import shutil
from pathlib import Path

import pytest
import xarray as xr

from trunnion.cli.app import main
from trunnion.model.mechanism import read_mechanism
from trunnion.rig.identification import identify as identification

ROOT = Path(__file__).resolve().parents[2]
MODEL = "pezzuti-cardan.yaml"
FRICTION = "joint_defaults.friction.coefficient"
RIG = """
trunnion-rig: 1
name: small
schedule: {over: {misalignment: [5 deg, 25 deg]}, turns: 4, idle: 0.2 s}
set: {input.speed: 600 rpm}
rate: 2 kHz
encoder: {per_turn: 60}
sensors:
  torque-in: {measures: "effort:input", range: 20 N m, noise: 20 mN m, accuracy: {gain: 0.1 %, zero: 10 mN m}}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The model, and measurements of it with a friction coefficient of 0.35."""
    place = tmp_path_factory.mktemp("rig")
    shutil.copy(ROOT / "examples" / MODEL, place)
    (place / "rig.yaml").write_text(RIG)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        patch.setattr("sys.argv", ["trunnion", "rig", MODEL, "rig.yaml", "--out", "data", "--set", f"{FRICTION}=0.35"])
        with pytest.raises(SystemExit) as ended:
            main()
    assert ended.value.code == 0
    return place


@pytest.fixture
def call(folder, monkeypatch, capsys):
    def run(*options, mapping="data/mapping.yaml"):
        monkeypatch.chdir(folder)
        monkeypatch.setenv("COLUMNS", "160")
        monkeypatch.setattr("sys.argv", ["trunnion", "identify", MODEL, mapping, *options])
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main()
        told = capsys.readouterr()
        return int(ended.value.code or 0), told.out + told.err

    return run


@pytest.mark.slow
def test_estimates_of_a_model_that_does_not_fit_are_not_written(folder, call, monkeypatch):
    """The crank angle 10° off: a coefficient that makes up for it is no coefficient of friction."""
    results, identify = [], identification.identify

    def once(*numbers, **options):
        """Both commands identify the same."""
        if not results:
            results.append(identify(*numbers, **options))
        return results[0]

    monkeypatch.setattr(identification, "identify", once)
    mapping = (folder / "data" / "mapping.yaml").read_text()
    assert "angle: {from: pulses," in mapping
    (folder / "data" / "off.yaml").write_text(mapping.replace("angle: {from", "angle: {zero: 10 deg, from"))
    status, text = call("--parameter", f"mu={FRICTION}", "--write", "off-model.yaml", mapping="data/off.yaml")
    assert status == 1
    assert "'off-model.yaml' is not written: the model does not fit" in text
    assert not (folder / "off-model.yaml").exists()
    status, text = call("--parameter", f"mu={FRICTION}", mapping="data/off.yaml")  # nor is it well without --write
    assert status == 1
    assert "error: fit: the model does not fit" in text
    assert len(results) == 1


@pytest.mark.slow
def test_tables_files_and_the_model(folder, call):
    files = ["x.csv", "x.fit.csv", "x.residuals.csv", "x.nc", "x.json", "x.svg"]
    outs = [part for name in files for part in ("--out", name)]
    status, text = call("--parameter", f"mu={FRICTION}", "--start", "mu=0.3", "--hold-out", "misalignment=25 deg",
                        "--write", "found.yaml", "--report", "x.html", *outs)  # fmt: skip
    assert status == 0, text
    assert "mu │   0.3 │ 0.3" in text
    assert "held-out data" in text
    assert (folder / "x.csv").read_text().startswith("parameter,paths,unit,start,estimate,standard_uncertainty,lower")
    assert (folder / "x.fit.csv").read_text().count("\n") == 3
    assert (folder / "x.residuals.csv").read_text().count("\n") > 100
    with xr.open_dataset(folder / "x.nc") as kept:
        low, high = (float(kept[end].values[0]) for end in ("lower", "upper"))
    assert low < 0.35 < high
    written = read_mechanism(folder / "found.yaml")
    assert low < float(written.parameters()[FRICTION]) < high
    before, after = ((folder / name).read_text().splitlines() for name in (MODEL, "found.yaml"))
    assert sum(a != b for a, b in zip(before, after, strict=True)) == 1
    page = (folder / "x.html").read_text()
    assert "Content-Security-Policy" in page
    assert "<script" not in page
    assert "http" not in page.replace("http-equiv", "")


@pytest.mark.spread(7)
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "no parameter to identify"),
        (["--parameter", "=A"], "names no number"),
        (["--parameter", "mu=friction"], "stands for"),
        (["--parameter", FRICTION, "--channel", "torque-out"], "the measurement has torque-in"),
        (["--parameter", FRICTION, "--hold-out", "run-7"], "there is no condition 'run-7'"),
        (["--parameter", FRICTION, "--kind", "histogram"], "use one of intervals, correlation, residuals"),
        (["--parameter", FRICTION, "--write", MODEL], "is the model itself"),
        (["--parameter", FRICTION, "--write", "x.toml"], "write .yaml or .json"),
        (["--parameter", FRICTION, "--report", "x.pdf"], "a report is not written as"),
        (["--parameter", FRICTION, "--guard", "-1"], "guard"),
    ],
)
def test_bad_input_is_told(call, options, message):
    status, text = call(*options)
    assert status == 2
    assert message in text
    assert "Traceback" not in text
