"""The wheel as a user installs it: typed, with its examples and its browser modules, run as a command and a module."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from types import SimpleNamespace

import pytest

import trunnion
from browsing import CHROMIUM, QUIET, User

ROOT = Path(__file__).parents[2]
SCRIPT = Path(__file__).with_name("every_name.py")


def run(*command, **environment):
    """What a command prints; the test fails with all of it where the command does."""
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "MYPYPATH")}
    done = subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, timeout=600, env={**kept, **environment}
    )
    if done.returncode:
        pytest.fail((done.stdout + done.stderr)[-4000:])
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", folder, ROOT)
    (made,) = folder.glob("*.whl")
    return made


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    folder = tmp_path_factory.mktemp("installed")
    run(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", folder, wheel)
    return folder


def test_the_script_has_every_public_name():
    text = SCRIPT.read_text("utf-8")
    names = [f"trunnion.{name}" for name in trunnion.__all__ if name not in ("exchange", "rig")]
    names += [f"trunnion.exchange.{name}" for name in trunnion.exchange.__all__]
    names += [f"trunnion.rig.{name}" for name in trunnion.rig.__all__]
    assert [name for name in names if not re.search(rf"\b{re.escape(name)}\b", text)] == []


@pytest.mark.slow
def test_the_wheel_holds_what_is_read_at_run_time(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    for name in ("py.typed", "examples/durango-fourbar.yaml", "views/web/report.js", "views/web/animation.html.j2"):
        assert f"trunnion/{name}" in names


@pytest.mark.slow
def test_a_strict_type_checker_sees_every_name(installed, tmp_path):
    settings = tmp_path / "mypy.ini"
    settings.write_text("[mypy]\nstrict = true\n", encoding="utf-8")
    said = run(
        sys.executable, "-m", "mypy", "--config-file", settings, "--cache-dir", tmp_path / "cache", SCRIPT,
        PYTHONPATH=str(installed), MYPYPATH=str(installed),
    )  # fmt: skip
    assert "Success" in said
    revealed = re.findall(r'Revealed type is "(.*)"', said)
    assert len(revealed) == SCRIPT.read_text("utf-8").count("reveal_type(")
    assert not any("Any" in one for one in revealed)


@pytest.mark.slow
def test_it_runs_as_a_module_and_completes_in_a_shell(installed, tmp_path):
    at = {"PYTHONPATH": str(installed)}
    assert trunnion.__version__ in run(sys.executable, "-m", "trunnion", "--version", **at)
    assert "durango-fourbar" in run(sys.executable, "-m", "trunnion", "examples", **at)
    command = installed / "bin" / "trunnion"
    at["_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION"] = "1"  # take the shell that is named, not the one above us
    shown = run(sys.executable, command, "--show-completion", "bash", **at)
    assert "_TRUNNION_COMPLETE=complete_bash" in shown
    asked = {"_TRUNNION_COMPLETE": "complete_bash", "COMP_WORDS": "trunnion analyse --st", "COMP_CWORD": "2"}
    assert run(sys.executable, command, **at, **asked).split() == ["--steps"]
    run(sys.executable, command, "--install-completion", "bash", **at, HOME=str(tmp_path))
    assert list(tmp_path.rglob("*trunnion*"))


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no browser here")
def test_the_studio_is_served_without_node(installed, tmp_path):
    """With nothing on the PATH: every module that the browser asks for is in the wheel, and the answers come."""
    from playwright.sync_api import sync_playwright

    (tmp_path / "m.yaml").write_text((ROOT / "examples" / "durango-fourbar.yaml").read_text("utf-8"), encoding="utf-8")
    command = [sys.executable, "-m", "trunnion", "studio", "m.yaml", "--no-open", "--port", "0"]
    bare = {"PYTHONPATH": str(installed), "PATH": "", "HOME": str(tmp_path)}
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True, env=bare) as process:
        try:
            address = process.stdout.readline().split()[-1]
            with sync_playwright() as playwright:
                browser = playwright.chromium.launch(executable_path=CHROMIUM, args=QUIET)
                user = User(browser.new_page(), SimpleNamespace(address=address))
                user.open()
                user.page.wait_for_selector(".motion .player")
                browser.close()
        finally:
            process.terminate()  # else leaving waits for it
    assert user.wrong == []
