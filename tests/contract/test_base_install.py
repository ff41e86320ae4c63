"""Without any extra every verb works; what only an extra brings is asked for by its name."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from trunnion.cli.app import VERBS

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
FOUR_BAR, TOLERANCED = EXAMPLES / "durango-fourbar.yaml", EXAMPLES / "toleranced-fourbar.yaml"
LAB = [TOLERANCED, "lab/mapping.yaml"]
# every verb
WORK = [
    ["check", FOUR_BAR], ["analyse", FOUR_BAR, "--steps", 12, "--out", "a.csv", "--out", "a.json", "--out", "a.nc"],
    ["design", FOUR_BAR], ["locking", FOUR_BAR, "--steps", 12],
    ["simulate", EXAMPLES / "flywheel-press.yaml", "--time", "0.1 s"],
    ["assemble", EXAMPLES / "misaligned-hinges.yaml", "--steps", 12],
    ["sweep", FOUR_BAR, "--over", "AB=1.9m:2.0m:2", "--steps", 12],
    ["tolerance", TOLERANCED, "--samples", 100, "--steps", 12],
    ["allocate", TOLERANCED, "--steps", 12, "--samples", 100],
    ["play", EXAMPLES / "fourbar-with-play.yaml", "--steps", 12], ["rig", TOLERANCED, "rig.yaml", "--out", "lab"],
    ["data", "lab/mapping.yaml"], ["compare", *LAB],
    ["identify", *LAB, "--parameter", "joint_defaults.friction.coefficient"],
    ["plot", FOUR_BAR, "--kind", "torque", "--out", "torque.svg"],
    ["report", FOUR_BAR, "--steps", 36, "--out", "report.html"], ["export", FOUR_BAR, "--out", "a.glb"], ["examples"],
    ["schema"],
]  # fmt: skip
REFUSED = {
    "parquet": ["analyse", FOUR_BAR, "--out", "a.parquet"],
    "zarr": ["analyse", FOUR_BAR, "--out", "a.zarr"],
    "xlsx": ["analyse", FOUR_BAR, "--out", "a.xlsx"],
    "studio": ["studio", FOUR_BAR],
    "tdms": ["data", "lab/mapping.yaml", "lab/run.tdms"],
    "cluster": ["tolerance", TOLERANCED, "--cluster", "tcp://127.0.0.1:9"],
    "cad": ["export", FOUR_BAR, "--out", "a.urdf"],
}
# the packages of the extras are not there, nor found by who only looks for them
BASE = """
import contextlib, io, json, sys
from importlib.machinery import PathFinder
hidden, work = json.loads(sys.stdin.read())
class Base(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        return None if name.partition(".")[0] in hidden else super().find_spec(name, path, target)
if __name__ == "__main__":
    sys.meta_path[sys.meta_path.index(PathFinder)] = Base
    from trunnion.cli.app import main
    ends = []
    for words in work:
        sys.argv, told = ["trunnion", *words], io.StringIO()
        with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told):
            try:
                main()
            except SystemExit as end:
                ends.append((int(end.code or 0), told.getvalue()))
    print(json.dumps(ends))
"""


def extras():
    """Packages by the extra that brings them, of those that a user installs."""
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    return {name: [one.partition(">")[0] for one in stated[name]] for name in stated if name not in ("dev", "bench")}


@pytest.fixture(scope="module")
def ends(tmp_path_factory):
    """Exit status and words of every command, all in one process without the packages of extras."""
    folder = tmp_path_factory.mktemp("base")
    rig = (EXAMPLES / "rig" / "fourbar-rig.yaml").read_text("utf-8")
    (folder / "rig.yaml").write_text(rig.replace("turns: 30", "turns: 8"), encoding="utf-8")
    hidden = [*(name for names in extras().values() for name in names), "dask"]
    work = [[str(word) for word in words] for words in (*WORK, *REFUSED.values())]
    done = subprocess.run(
        [sys.executable, "-c", BASE], input=json.dumps([hidden, work]), capture_output=True, text=True, cwd=folder,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return [(code, told) for code, told in json.loads(done.stdout.splitlines()[-1])]


@pytest.mark.slow
def test_every_verb_works(ends):
    """Findings about the mechanism (1) are none about the installation."""
    assert {words[0] for words in WORK} | {"studio", "import"} == {one.name for one in VERBS}
    for words, (code, told) in zip(WORK, ends, strict=False):
        assert code in (0, 1), (words, told)
        assert "pip install" not in told, (words, told)


@pytest.mark.slow
def test_what_an_extra_brings_is_asked_for_by_its_name(ends):
    # SciPy writes NetCDF too, and a notebook has no command line
    assert REFUSED.keys() == extras().keys() - {"netcdf", "notebook"}
    for extra, (code, told) in zip(REFUSED, ends[len(WORK) :], strict=True):
        assert code == 2, (extra, told)
        assert f"pip install 'trunnion[{extra}]'" in told, (extra, told)
