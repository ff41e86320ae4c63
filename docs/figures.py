"""The figures and reports that the pages refer to: which they are, and how they are drawn.

- `figures/MODEL/KIND.svg` and `figures/MODEL/report.html`: KIND is a plot, `assemblies` or `assemble`; MODEL is a file
  of `examples/`, a block of a page titled `MODEL.yaml`, or an entry of `VARIANTS`.
- `figures/sweeps/NAME.svg`, `figures/plays/NAME.svg` and so on for every verb of `COMMANDS`: what the command of a
  page, `trunnion sweep … --out NAME.svg`, draws.

What was drawn is kept in `.docs-cache/` under a hash of the model, of the command and of the whole source of Trunnion,
so that a second build draws only what could have changed.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import re
import shlex
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any
from unittest.mock import patch

from mkdocs.exceptions import PluginError

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"
KEPT = ROOT / ".docs-cache"

TEXT_ONLY = os.environ.get("TRUNNION_DOCS") == "text"
EMPTY = b'<svg xmlns="http://www.w3.org/2000/svg"/>'
STEPS = 360  # positions of the figures and reports of pages, as `analyse` has them
# folders of figures that a command draws
COMMANDS = ("sweeps", "plays", "lockings", "assembles", "tolerances", "allocates", "compares")

# model: (the model it is made from, what is replaced in it)
VARIANTS: dict[str, tuple[str, dict[str, float | str]]] = {
    "long-crank": ("durango-fourbar", {"AB": "2.6 m"}),
    "press-long-guide": ("press", {"S.guide.length": "150 mm"}),
    "lever-loaded": ("lever", {"joint_defaults.seat": "loaded"}),
}


def drawn(pages: Iterable[str], gallery: Any) -> Iterator[tuple[str, bytes]]:
    """Place and content of every figure and report that the pages and the gallery refer to."""
    pages = list(pages)
    models, text = models_of(pages), "\n".join(pages)
    told = set(re.findall(r"figures/([\w-]+)/([\w-]+)\.(svg|html)", text))
    for verbs, name, _ in sorted(found for found in told if found[0] in COMMANDS):
        yield f"figures/{verbs}/{name}.svg", by_command(verbs.removesuffix("s"), name, text, models)
    told = {found for found in told if found[0] not in COMMANDS}
    for steps, some in ((STEPS, told), (gallery.STEPS, gallery.wanted() - told)):
        for model in sorted({name for name, _, _ in some}):
            base, values = _base_of(model, models)
            files = sorted(f"{kind}.{suffix}" for name, kind, suffix in some if name == model)
            made: Callable[[], dict[str, bytes]] = _Drawing(base, models[base], values, steps, files, gallery).files
            for file in files:
                content = kept((models[base], values, steps, file), lambda made=made, file=file: made()[file])
                yield f"figures/{model}/{file}", content


def models_of(pages: Iterable[str]) -> dict[str, str]:
    """Model files by name: the examples, and the blocks of the pages titled as a file."""
    models = {path.stem: path.read_text("utf-8") for path in EXAMPLES.glob("*.yaml")}
    for text in pages:
        models |= dict(re.findall(r'^```yaml title="([\w-]+)\.yaml"\n(.*?)^```', text, re.DOTALL | re.MULTILINE))
    return models


def _base_of(model: str, models: dict[str, str]) -> tuple[str, dict[str, float | str]]:
    """The model file that figures are made from, and what is replaced in it."""
    base, values = VARIANTS.get(model, (model, {}))
    if base not in models:
        raise PluginError(f"figures/{model}: there is no model '{base}'")
    return base, values


# ---- what was drawn before --------------------------------------------------------------------------------------


def kept(key: Any, make: Callable[[], bytes]) -> bytes:
    """What `make` gives; from an earlier build if neither the key nor the source has changed. Empty for text alone."""
    if TEXT_ONLY:
        return EMPTY
    file = KEPT / hashlib.sha256(json.dumps([_source(), key]).encode()).hexdigest()
    if not file.is_file():
        KEPT.mkdir(exist_ok=True)
        draft = file.with_suffix(".draft")
        draft.write_bytes(make())
        draft.replace(file)
    return file.read_bytes()


@cache
def _source() -> str:
    """A hash of what all figures depend on: the code of package, pages and gallery, and two libraries."""
    found = hashlib.sha256(f"{version('numpy')} {version('matplotlib')}".encode())
    folders = (ROOT / "src" / "trunnion", ROOT / "tests" / "gallery", ROOT / "docs")
    suffixes = (".py", ".js", ".css", ".j2")
    for path in sorted(path for folder in folders for path in folder.rglob("*") if path.suffix in suffixes):
        found.update(path.read_bytes())
    return found.hexdigest()


# ---- figures of a cycle -----------------------------------------------------------------------------------------


class _Drawing:
    """The figures and the report of one model, from one analysis with friction and at most one without."""

    def __init__(
        self, base: str, text: str, values: dict[str, float | str], steps: int, files: list[str], gallery: Any
    ) -> None:
        self.base, self.text, self.values, self.steps = base, text, values, steps
        self.wanted, self.gallery = files, gallery
        self.found: dict[str, bytes] = {}

    def files(self) -> dict[str, bytes]:
        """Content by file name; drawn when first asked for."""
        if not self.found:
            with tempfile.TemporaryDirectory() as folder:
                self.found = self._draw(Path(folder))
        return self.found

    def _draw(self, folder: Path) -> dict[str, bytes]:
        from trunnion import analyse, assemble, plot, read, report
        from trunnion.views.draw import save
        from trunnion.views.mode_drawings import ways

        if (EXAMPLES / f"{self.base}.yaml").is_file():
            mechanism = self.gallery.model(self.base)
        else:
            file = folder / f"{self.base}.yaml"
            file.write_text(self.text, encoding="utf-8")
            mechanism = read(file)
        mechanism = mechanism.with_values(self.values) if self.values else mechanism

        shared = self.steps == self.gallery.STEPS and not self.values
        # only these show means over the cycle, which ask for most positions
        result_of = analyse if {"report.html", "friction-power.svg"} & {*self.wanted} else self.gallery.brief

        @cache
        def real() -> Any:
            if shared and result_of is self.gallery.brief:
                return self.gallery.shown(self.base)
            return result_of(mechanism, self.steps)

        @cache
        def ideal() -> Any:
            return result_of(mechanism.with_friction("off"), self.steps)

        special = {
            "assemblies": lambda: ways(mechanism),
            "assemble": lambda: plot(assemble(mechanism, self.steps)),
        }
        contents = {}
        for name in self.wanted:
            kind, path = Path(name).stem, folder / name
            if name == "report.html":
                contents[name] = report(real(), ideal()).encode()
                continue
            draw = special.get(kind) or (
                lambda kind=kind: plot(real(), kind, ideal=ideal() if kind in COMPARED else None)
            )
            contents[name] = bytes(save(draw(), path).read_bytes())
        return contents


COMPARED = ("torque", "friction-power", "reactions", "power")  # plots that show the run without friction beside it


# ---- figures of a command ---------------------------------------------------------------------------------------


def by_command(verb: str, name: str, text: str, models: dict[str, str]) -> bytes:
    """The figure that a page's own command draws, so that the two cannot differ."""
    command = re.search(rf"^trunnion ({verb} .*--out {re.escape(name)}\.svg.*)$", text, re.MULTILINE)
    if command is None:
        raise PluginError(f"figures/{verb}s/{name}.svg: no page has a command that writes {name}.svg")
    source = _measured(text, command[1]) if verb == "compare" else ""
    used = {model: content for model, content in models.items() if f"{model}.yaml" in f"{source} {command[1]}"}
    return kept((source, command[1], used), lambda: _run(source, _figure_only(command[1], name), name, models))


def _run(source: str, command: str, name: str, models: dict[str, str]) -> bytes:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        _lay(folder, models)
        if source:
            data = shlex.split(source)[-1]
            (folder / data).symlink_to(_lab(source, tuple(models.items())) / data)
        _call(command, folder)
        return (folder / f"{name}.svg").read_bytes()


def _figure_only(command: str, name: str) -> str:
    """The command without the other files that it writes: they would be thrown away."""
    words = shlex.split(command, comments=True)
    written = [k for k, word in enumerate(words) if word in ("--out", "--report", "--write")]
    left = {k + step for k in written if words[k + 1] != f"{name}.svg" for step in (0, 1)}
    return shlex.join(word for k, word in enumerate(words) if k not in left)


_PLACES: list[tempfile.TemporaryDirectory[str]] = []  # held until the build ends


@cache
def _lab(source: str, models: tuple[tuple[str, str], ...]) -> Path:
    """A folder with the data that a command of a virtual rig writes; several figures may show the same data."""
    _PLACES.append(tempfile.TemporaryDirectory())
    folder = Path(_PLACES[-1].name)
    _lay(folder, dict(models))
    _call(source, folder)
    return folder


def _lay(folder: Path, models: dict[str, str]) -> None:
    (folder / "examples").mkdir()
    for model, content in models.items():
        for place in ("", "examples"):
            (folder / place / f"{model}.yaml").write_text(content, encoding="utf-8")


def _call(command: str, folder: Path) -> None:
    """Run a command of Trunnion in this process: a process of its own takes seconds to load everything again."""
    from trunnion.cli.app import main
    from trunnion.studies import sweep as study

    said, status = io.StringIO(), 0
    streams = contextlib.redirect_stdout(said), contextlib.redirect_stderr(said)
    with (
        contextlib.chdir(folder),
        patch.object(sys, "argv", ["trunnion", *shlex.split(command)]),
        patch.object(study, "sweep", partial(_swept, study.sweep)),
        streams[0],
        streams[1],
    ):
        try:
            main()
        except SystemExit as end:
            status = int(end.code or 0)
    if status not in (0, 1):
        raise PluginError(f"trunnion {command}: {said.getvalue()}")


_SWEEPS: dict[str, Any] = {}


def _swept(sweep: Callable[..., Any], mechanism: Any, *given: Any, **options: Any) -> Any:
    """A sweep, run once for all figures that show it in different ways."""
    own = {name: value for name, value in options.items() if name != "progress"}
    key = repr((mechanism.digest, given, own))
    if key not in _SWEEPS:
        _SWEEPS[key] = sweep(mechanism, *given, **options)
    return _SWEEPS[key]


def _measured(text: str, command: str) -> str:
    """The command that writes the data that another reads: `FOLDER/mapping.yaml` is of `rig … --out FOLDER`."""
    folder = shlex.split(command)[2].partition("/")[0]
    found = re.search(rf"^trunnion (rig .*--out {re.escape(folder)})$", text, re.MULTILINE)
    return found[1] if found else ""
