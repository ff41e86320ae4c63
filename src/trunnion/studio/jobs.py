"""Studies that the page starts: the verbs of the command line, each a process of its own that can be stopped.

So a study has the settings and the figures of its verb, and what it writes is that verb's report.
"""

from __future__ import annotations

import json
import os
import re
import secrets
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

REPORT, MODEL, OUTPUT = "report.html", "model.yaml", "output.txt"
MOST_RUNNING, MOST_KEPT = 2, 30
TAIL = 20_000  # signs of the output that the page shows
PROGRESS = re.compile(r"\x1e(\d+)/(\d+|-)\n?")  # what `trunnion` writes where it is asked for its progress


@dataclass
class _Job:
    """A study that was started."""

    verb: str
    command: str
    folder: Path
    process: subprocess.Popen[bytes]
    begun: float
    code: str = field(default_factory=lambda: secrets.token_urlsafe(24))  # the name that its report is asked for by
    ended: float | None = None
    stopped: bool = False

    def told(self) -> dict[str, Any]:
        """What the page shows of it."""
        status = self.process.poll()
        if status is not None and self.ended is None:
            self.ended = time.monotonic()
        text = (self.folder / OUTPUT).read_text("utf-8", errors="replace")
        progress = PROGRESS.findall(text)
        has_report = status is not None and not self.stopped and (self.folder / REPORT).is_file()
        return {
            "verb": self.verb,
            "command": self.command,
            "seconds": round((self.ended or time.monotonic()) - self.begun, 1),
            "progress": [int(part) if part.isdigit() else None for part in progress[-1]] if progress else None,
            "running": status is None,
            "stopped": self.stopped,
            "status": status,
            "output": PROGRESS.sub("", text).replace(f"wrote {REPORT}\n", "")[-TAIL:],
            "report": f"/result/{self.code}" if has_report else None,
        }


class Jobs:
    """The studies of a studio.

    Parameters
    ----------
    forms : the verbs that can be started, with their options: {verb, mapping, report, fields: [{flag, kind, choices}]}.
    folder : of the models, where mappings of measured data are.
    """

    def __init__(self, forms: Sequence[Mapping[str, Any]], folder: Path) -> None:
        self.forms = {str(form["verb"]): form for form in forms}
        self.folder = folder
        self.jobs: dict[str, _Job] = {}
        self._place = tempfile.TemporaryDirectory(prefix="trunnion-studies-", ignore_cleanup_errors=True)

    def start(self, options_asked: Mapping[str, Any], name: str, mapping: Path | None) -> str:
        """Start a study of the text of a model; its number.

        options_asked: {text, verb, options: {flag: text or list of texts, true for one without a value}}. name: of the
        model in the command that is shown. ValueError in words if it is none of the forms.
        """
        form = self.forms.get(str(options_asked.get("verb")))
        if form is None:
            raise ValueError(f"there is no study '{str(options_asked.get('verb'))[:40]}'")
        if sum(job.process.poll() is None for job in self.jobs.values()) >= MOST_RUNNING:
            raise ValueError(f"{MOST_RUNNING} studies run already: wait for one, or stop it")
        if form["mapping"] and mapping is None:
            raise ValueError("name the mapping of the measured data, a file of the opened folder")
        options = _options(form, dict(options_asked.get("options") or {}))
        folder = Path(tempfile.mkdtemp(dir=self._place.name))
        (folder / MODEL).write_text(str(options_asked["text"]), encoding="utf-8", newline="\n")
        files = [str(mapping)] if form["mapping"] else []
        report = ["--report", REPORT] if form["report"] else []
        command = [sys.executable, "-m", "trunnion", form["verb"], MODEL, *files, *options, *report]
        shown = ["trunnion", form["verb"], name, *([mapping.name] if mapping and form["mapping"] else []), *options]
        with (folder / OUTPUT).open("wb") as output:
            process = subprocess.Popen(
                command, cwd=folder, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                env={**os.environ, "TRUNNION_PROGRESS": "1", "COLUMNS": "100"}, start_new_session=True,
            )  # fmt: skip
        job = _Job(form["verb"], shlex.join(shown), folder, process, time.monotonic())
        number = str(len(self.jobs) + 1)
        self.jobs[number] = job
        return number

    def told(self) -> list[dict[str, Any]]:
        """Every study that was started, the latest first."""
        return [{"id": number, **job.told()} for number, job in reversed(list(self.jobs.items())[-MOST_KEPT:])]

    def stop(self, number: str) -> None:
        """Stop a study as Ctrl-C would; ValueError if there is none of this number."""
        job = self.jobs.get(number)
        if job is None:
            raise ValueError(f"there is no study {number[:20]}")
        if job.process.poll() is None:
            job.stopped = True
            _end(job.process, "SIGINT")

    def report(self, code: str) -> str:
        """The report of a study by its secret name; ValueError if there is none."""
        for job in self.jobs.values():
            if secrets.compare_digest(job.code, code) and (job.folder / REPORT).is_file():
                return (job.folder / REPORT).read_text("utf-8")
        raise ValueError("there is no such report")

    def close(self) -> None:
        """Stop what runs, and remove what was kept."""
        for number in self.jobs:
            self.stop(number)
        for job in self.jobs.values():
            try:
                job.process.wait(5)
            except subprocess.TimeoutExpired:
                _end(job.process, "SIGKILL")
        self._place.cleanup()


def _end(process: subprocess.Popen[bytes], how: str) -> None:
    """Send a signal to a process and those it has started, where the system knows signals."""
    if hasattr(os, "killpg"):
        os.killpg(process.pid, getattr(signal, how))
    else:
        process.terminate()


def _options(form: Mapping[str, Any], options_asked: Mapping[str, Any]) -> list[str]:
    """The words of the command line: each value is one word with its flag, and so can be no other option."""
    fields, words = {str(item["flag"]): item for item in form["fields"]}, []
    for flag, value in options_asked.items():
        if flag not in fields:
            raise ValueError(f"{form['verb']} has no option {json.dumps(flag)[:40]}")
        if fields[flag]["kind"] == "flag":
            words += [flag] if value is True else []
            continue
        texts = [str(item).strip() for item in (value if isinstance(value, list) else [value])]
        texts = [text for text in texts if text]
        if len(texts) > 1 and not fields[flag]["several"]:
            raise ValueError(f"{flag} is given once")
        words += [f"{flag}={text}" for text in texts]
    return words
