"""Studies started from the page: the verbs of the command line, with their options, figures and reports."""

import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.main import get_command

from studio.asking import EXAMPLES
from trunnion.cli.app import app
from trunnion.cli.forms import forms
from trunnion.studio.jobs import Jobs

ROOT = Path(__file__).resolve().parents[2]
TOLERANCED = EXAMPLES["toleranced-fourbar"]
PLAYING = EXAMPLES["fourbar-with-play"]
MODELS, FORMS = {"four-bar": TOLERANCED}, forms()
WORDS = re.compile(r"<[^>]+>|\s+")


@pytest.fixture
def jobs(tmp_path):
    own = Jobs(forms(), tmp_path)
    yield own
    own.close()


def ended(jobs, number, longest=120.0):
    limit = time.monotonic() + longest
    while time.monotonic() < limit:
        (job,) = [one for one in jobs.told() if one["id"] == number]
        if not job["running"]:
            return job
        time.sleep(0.05)
    pytest.fail(f"still running: {job}")


def test_every_study_has_the_options_of_its_verb():
    """And none that writes a file."""
    commands = get_command(app).commands
    for form in forms():
        flags = {flag for option in commands[form["verb"]].params for flag in option.opts}
        assert form["fields"]
        assert {field["flag"] for field in form["fields"]} <= flags - {"--out", "--report", "--write", "--checkpoint"}


@pytest.mark.slow
def test_the_report_of_a_study_is_that_of_its_verb(jobs, tmp_path):
    number = jobs.start(
        {"text": PLAYING, "verb": "play", "options": {"--steps": "36", "--measure": ["effort:A", "rocker.C.x"]}},
        "model.yaml", None,
    )  # fmt: skip
    job = ended(jobs, number)
    assert job["status"] in (0, 1), job
    assert job["command"] == "trunnion play model.yaml --steps=36 --measure=effort:A --measure=rocker.C.x"
    (tmp_path / "model.yaml").write_text(PLAYING, "utf-8")
    command = [sys.executable, "-m", *job["command"].split(), "--report", "own.html"]
    subprocess.run(command, cwd=tmp_path, capture_output=True, check=False)
    pages = [jobs.report(job["report"].rpartition("/")[2]), (tmp_path / "own.html").read_text("utf-8")]
    own, other = (WORDS.sub(" ", page) for page in pages)
    assert own == other


def test_a_study_is_stopped_and_tells_how_far_it_is(jobs):
    options = {"--samples": "3000000", "--method": "monte-carlo"}
    number = jobs.start({"text": TOLERANCED, "verb": "tolerance", "options": options}, "model.yaml", None)
    limit = time.monotonic() + 60
    while time.monotonic() < limit and not (jobs.told()[0]["progress"] or [0])[0]:
        time.sleep(0.1)
    done, total = jobs.told()[0]["progress"]
    assert 0 < done < total == 3_000_000
    jobs.stop(number)
    job = ended(jobs, number)
    assert job["stopped"]
    assert job["report"] is None
    assert "\x1e" not in job["output"]


def test_what_is_wrong_with_a_model_is_its_output(jobs):
    asked = {"text": "trunnion: 1\nlinks: {}\n", "verb": "play", "options": {}}
    job = ended(jobs, jobs.start(asked, "model.yaml", None))
    assert job["status"] == 2
    assert "error" in job["output"]
    assert job["report"] is None


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"verb": "rm"}, "no study"),
        ({"verb": "play", "options": {"--out": "/etc/passwd"}}, "no option"),
        ({"verb": "play", "options": {"--report": "x.html"}}, "no option"),
        ({"verb": "play", "options": {"--steps": ["36", "72"]}}, "given once"),
        ({"verb": "compare"}, "mapping"),
    ],
)
def test_nothing_but_the_options_of_a_form_is_started(jobs, asked, words):
    with pytest.raises(ValueError, match=words):
        jobs.start({"text": TOLERANCED, **asked}, "model.yaml", None)
    assert jobs.told() == []


def test_a_value_is_never_an_option(jobs):
    asked = {"text": PLAYING, "verb": "play", "options": {"--at": "--report=/tmp/x.html"}}
    job = ended(jobs, jobs.start(asked, "model.yaml", None))
    assert job["status"] == 2
    assert "at: " in job["output"]


@pytest.mark.slow
def test_a_chip_opens_its_study_and_the_report_is_read_in_the_page(user):
    user.until("s.solved.value")
    page = user.page
    page.locator(".chip", has_text="tolerance").click()
    page.get_by_label("samples", exact=True).fill("0")
    page.get_by_label("steps", exact=True).fill("36")
    page.get_by_role("button", name="Run", exact=True).click()
    page.get_by_role("button", name="Open the report").click(timeout=60_000)
    page.frame_locator("iframe.report").get_by_text("Four-bar with tolerances").first.wait_for()
    page.get_by_role("button", name="Back to the studies").click()
    assert "trunnion tolerance four-bar.yaml --samples=0 --steps=36" in page.locator(".job code").text_content()
