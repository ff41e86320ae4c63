"""Questions of the page and their answers: one pure function from bytes to bytes, whatever carries them.

No threads, files or sockets behind it. A question is JSON, `{"ask": …, "revision": …}`; an answer is a header with
columns, see `packed`. The state is the text of the model, which every question brings with it; what was read and
prepared of a text is kept for the next question about the same.
"""

from __future__ import annotations

import copy
import io
import json
import struct
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.cycle.locking import locks_of, margins_without
from trunnion.errors import Finding, MechanismError, Status
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.measures.measures import chosen, outputs
from trunnion.model.file import text_of
from trunnion.model.mechanism import Mechanism
from trunnion.model.rewrite import changed_text
from trunnion.results.attributes import findings_of
from trunnion.results.dataset import Column, without_noise
from trunnion.results.quantities import quantity
from trunnion.solve.assembly_modes import choices
from trunnion.solve.run import prepare
from trunnion.solve.shifts import play_of
from trunnion.studies.design import instant_centres, transmission_angles
from trunnion.studio import changing, drawing
from trunnion.studio.findings import cures, figures, margin_of, missing, reached, readiness, remedied, sentence, spoken
from trunnion.studio.live import Live, columns, live_in_space, places_at, thumbnail, tracks, uncollected
from trunnion.studio.loaded import MOST_STEPS, STEPS, Asked, Loaded, columns_of
from trunnion.studio.sketch import Sketch, refused
from trunnion.studio.wiring import block
from trunnion.version import __version__
from trunnion.views.as_built import seated
from trunnion.views.bodies import gathered
from trunnion.views.scene import blocks_of, scene

if TYPE_CHECKING:
    import xarray as xr

MOST_OTHERS = 3  # assemblies
FILES = {"csv": "text/csv", "report": "text/html", "png": "image/png", "svg": "image/svg+xml"}
MOST_LINKS = 12  # whose instant centres against each other are told; of more only those against the ground
MOST_BLOCKS = 24  # whose share of the margin is told: each takes an analysis


def answer(request: bytes, turn: AbstractContextManager[object] | None = None) -> bytes:
    """The answer to a question; one that cannot be answered says why in a sentence. turn: of what is answered in turn;
    what takes long is answered beside, for nobody is to wait for it, and what a hand waits for."""
    head: dict[str, Any] = {}
    try:
        question = json.loads(request)
        if not isinstance(question, dict):
            raise ValueError("not a group of entries")
        question_asked = Asked(question)
        kind, revision = question_asked.get("ask"), question_asked.get("revision")
        head = {"ask": str(kind)[:40], "revision": revision if isinstance(revision, int) else None}
        about = ANSWERS.get(str(kind))
        if about is None:
            raise ValueError(f"nothing is known of '{head['ask']}'")
        with nullcontext() if turn is None or about in BESIDE else turn:
            return packed(head | about(question_asked))
    except MechanismError as error:
        return packed(head | {"error": "; ".join(sentence(finding) for finding in error.findings[:3])})
    except Exception as error:  # whatever it is: whoever asked gets a sentence, and can go on asking
        why = f"{type(error).__name__}: {str(error)[:300]}"
        return packed(head | {"error": f"The question cannot be answered ({why})"})


# ---- answers as bytes ---------------------------------------------------------------------------------------------

SHORTEST = 16  # numbers: shorter lists stay in the header


@dataclass(frozen=True)
class Exact:
    """A column whose numbers are to arrive with more digits than a float32 has."""

    numbers: np.ndarray


def packed(header: Mapping[str, Any]) -> bytes:
    """A header with its arrays, long lists of numbers and bytes moved into columns.

    uint32 n (little-endian), n bytes of header (a multiple of 4), columns. In the header a column is `{"column":
    [first, count]}`, in numbers from the end of the header; NaN stands where there is none. `{"sum": [first,
    count]}` is the sum of two columns, one behind the other, which has 48 binary digits. `{"grid": [first, count],
    "names": …, "keys": …}` are columns of so many numbers for each name of each key, or for each key where `names`
    is null. A file is `{"bytes": [first, count]}`, in bytes from there.
    """
    columns: list[np.ndarray] = []
    files: list[bytes] = []
    count = 0
    places: list[dict[str, Any]] = []  # of files: they are counted from the end of the columns

    def column(numbers: np.ndarray) -> dict[str, Any]:
        nonlocal count
        columns.append(np.ravel(numbers))
        count += numbers.size
        return {"column": [count - numbers.size, int(numbers.size)]}

    def plain(value: Any) -> Any:
        if isinstance(value, Mapping):
            rows = list(value.values())
            if (alike := _columns_of(rows)) is not None:
                first, size = column(np.array(alike))["column"]
                names = list(rows[0]) if isinstance(rows[0], dict) else None
                return {"grid": [first, size // len(alike)], "names": names, "keys": list(map(str, value))}
            return {str(key): plain(item) for key, item in value.items()}
        if isinstance(value, np.ndarray):
            return column(value)
        if isinstance(value, Exact):
            high = value.numbers.astype("<f4").astype(float)
            first, size = column(np.concatenate([high, value.numbers - high]))["column"]
            return {"sum": [first, size // 2]}
        if isinstance(value, bytes):
            files.append(value)
            places.append({"bytes": [0, len(value)]})
            return places[-1]
        if isinstance(value, (list, tuple)):
            if len(value) >= SHORTEST and set(map(type, value)) <= {int, float, type(None)}:
                return column(np.array(value, float))
            return [plain(item) for item in value]
        if isinstance(value, float) and not np.isfinite(value):
            return None
        return value.item() if isinstance(value, np.generic) else value

    head = plain(header)
    body = np.concatenate(columns).astype("<f4").tobytes() if columns else b""
    first = len(body)
    for place in places:
        place["bytes"][0] = first
        first += place["bytes"][1]
    text = json.dumps(head, allow_nan=False).encode()  # ASCII: half a character of the page's text comes back as it was
    text += b" " * (-len(text) % 4)
    return struct.pack("<I", len(text)) + text + body + b"".join(files)


def _columns_of(rows: list[Any]) -> list[np.ndarray] | None:
    """The columns of many entries that are alike, a column each or some by name; None of others."""
    if len(rows) < SHORTEST:
        return None
    columns = rows
    if isinstance(rows[0], dict):
        if not all(isinstance(row, dict) and row.keys() == rows[0].keys() for row in rows):
            return None
        columns = [column for row in rows for column in row.values()]
    alike = all(type(column) is np.ndarray and column.shape == columns[0].shape for column in columns)
    return columns if columns and alike else None


# ---- what there is to begin with --------------------------------------------------------------------------------


def _start(question: Asked) -> dict[str, Any]:
    rows = [{"name": name, "title": _stated(text, "name"), "space": _stated(text, "space") or "planar"}
            for name, text in _examples().items()]  # fmt: skip
    return {"version": __version__, "examples": rows, "laws": list(FRICTION_LAWS)}


def _stated(text: str, key: str) -> str:
    """What a line of the file states."""
    return next((line.partition(":")[2].strip() for line in text.splitlines() if line.startswith(f"{key}:")), "")


@lru_cache(maxsize=1)
def _examples() -> dict[str, str]:
    """The example models that stand alone in one file, by name."""
    shipped = files("trunnion") / "examples"
    if not shipped.is_dir():  # a working tree
        shipped = files("trunnion") / ".." / ".." / "examples"
    paths = sorted((path for path in shipped.iterdir() if path.name.endswith(".yaml")), key=lambda path: path.name)
    texts = {path.name[:-5]: path.read_text(encoding="utf-8") for path in paths}
    return {name: text for name, text in texts.items() if "\nlinks:" in text or "\nloop:" in text}


def _example(question: Asked) -> dict[str, Any]:
    """The text of an example; asked as "picture" its small picture."""
    name = str(question["name"])
    if name not in _examples():
        raise MechanismError(Finding(f"there is no example '{name}'", remedy="choose one of the list"))
    return thumbnail(_examples()[name]) if question["ask"] == "picture" else {"text": _examples()[name]}


# ---- a model ------------------------------------------------------------------------------------------------------


@uncollected()
def _model(question: Asked) -> dict[str, Any]:
    """Findings, numbers, motion and forces of a text; the figures of its cycle are asked for by `cycle`."""
    state = question.state
    result, answer_so_far = _solved(question, lambda: question.cycle.motion)
    numbers: Mapping[str, Any] = {}
    with suppress(MechanismError):  # of what is half drawn those that can be read
        numbers = state.mechanism.parameters() if state.mechanism else Sketch(dict(state.entries or {})).numbers
    head = answer_so_far | {
        "numbers": {path: float(np.ravel(primal(value))[0]) for path, value in numbers.items()},
        "entries": state.entries, "solved": result is not None, "bare": state.bare, "scene": None,
    }  # fmt: skip
    if result is None:
        return head
    drawn_scene, system = scene(result, max_positions=MOST_STEPS), state.run.system
    mechanism = system.mechanism
    # what has a worst corner: none where nothing has a tolerance or a play; joints whose pins lie nowhere in their play
    loose = [name for name, joint in system.joints.items()
             if play_of(mechanism.space, joint.type, state.run.values, name) is not None]  # fmt: skip
    varies = loose or mechanism.tolerated()
    measures = (chosen(mechanism, None, state.run.values) or outputs(system)) if varies else []
    return head | {
        "scene": drawn_scene,
        "places": {key: place for key, track in drawn_scene["points"].items()
                   if None not in (place := [track[axis][0] for axis in "xy"])},
        **margin_of(result, question.rubs),
        "locks": locks_of(state.run, result["time"].values, result["status"].values),
        **({"margin_why": "friction lacks something"} if state.bare and question.friction else {}),
        "facts": [["structure", str(result.attrs.get("formula", ""))]],
        "worst": [measure.name for measure in measures],
        "unseated": [name for name in loose if name not in mechanism.seated],
    }  # fmt: skip


@uncollected()
def _cycle(question: Asked) -> dict[str, Any]:
    """Findings and figures of the whole cycle of a text, which take longer than its motion."""
    result, answer_so_far = _solved(question, lambda: question.cycle.result)
    if result is None:
        return answer_so_far
    rows = [[figure["label"], figure["text"]] for figure in figures(question)]
    least = margin_of(result, question.rubs)["margin_least"]
    return answer_so_far | {"figures": rows, "margin_least": least}


def _solved(question: Asked, solve: Callable[[], xr.Dataset]) -> tuple[xr.Dataset | None, dict[str, Any]]:
    """The result of a text, None where it has none, and what there is to say of it."""
    state, findings, result = question.state, list(question.state.findings), None
    if state.mechanism is not None:
        try:
            result = solve()
            more = state.placed(tuple(findings_of(result)))
            findings = [*findings, *more] if state.bare else more or findings
        except MechanismError as error:
            findings += state.placed(error.findings)
    lacks = missing(Sketch(dict(state.entries or {})), findings)
    ready = readiness(state.mechanism, result, findings, lacks)
    rows = [_row(state, finding, result) for finding in findings]
    return result, {"findings": rows, "missing": lacks, "ready": ready}


def _row(state: Loaded, finding: Finding, result: xr.Dataset | None) -> dict[str, Any]:
    """A finding as the page has it: with the part that it is about, its line, and a position at which it holds."""
    section, _, names = finding.where.replace(" ", ".", 1).partition(".")  # "links coupler, rocker"
    joint = finding.figures.get("decides") or next(iter(finding.figures.get("joints") or ()), None)
    part = f"joints.{joint}" if joint else f"{section}.{names.split(', ')[0]}" if names else finding.where
    of_part = state.placed((replace(finding, where=part, line=None),))[0]
    return {
        "code": finding.code, "what": finding.what, "where": finding.where, "severity": finding.severity.value,
        "place": finding.kind_of_part or spoken(finding.where), "remedy": remedied(finding.remedy), "part": part,
        "line": (finding if finding.where.startswith(part) else of_part).line,
        "index": None if result is None else reached(finding, result),
        "cures": [] if result is None else cures(state, finding),
    }  # fmt: skip


# ---- dragging -----------------------------------------------------------------------------------------------------


@uncollected()
def _drag(question: Asked) -> dict[str, Any]:
    """The cycle with a joint or point dragged `to` a place, a pin on the ground with `keep` by its links; in space
    `by` metres along the axes.
    """
    point, index = str(question["point"]), question.index
    numbers, fine = question.state.run.system.mechanism.parameter_set.nominal, float(question.get("fine") or 0.0)
    sketch = Sketch(dict(question.state.entries or {}), fine=fine)
    sketch.numbers = numbers
    if question.get("by") is not None:
        by = [float(part) for part in question["by"]]
        return _live(question, sketch.shifted(point, by, _turns(question.state, index)), index)
    sketch.places, to = places_at(question), drawing.vector(question["to"])
    values = sketch.moved(point, to, bool(question.get("keep")))
    live = Live(question.cycle.run, values, question.steps)
    near = live.nearest(*drawing.located(sketch, point), to, index, 1e-6 * sketch.size)
    rows = []
    for path, value in values.items():
        section, name, *inner = path.split(".")
        name = f"{inner[2]} of {inner[1]} on {name}" if section == "links" else name
        rows.append([name, sketch.length(float(numbers[path])), sketch.length(value)])
    return {"changes": rows} | _live(question, values, near, live)


@uncollected()
def _try(question: Asked) -> dict[str, Any]:
    """The cycle with some numbers replaced, `values` in SI by path, and the margin at the position `index`."""
    values = {str(path): float(value) for path, value in dict(question["values"]).items()}
    return _live(question, values, question.index)


def _live(question: Asked, values: Mapping[str, float], index: int, live: Live | None = None) -> dict[str, Any]:
    """Columns of a mechanism that is being changed, with its margin and what locks at the position that is shown."""
    run, locked = question.state.run, {}
    if run.system.spatial:
        columns = live_in_space(question.cycle.run, values, question.steps, index)
    else:
        columns = (live or Live(question.cycle.run, values, question.steps)).told(index)
    at = index if len(columns["status"]) > 1 else 0
    status = np.array(columns["status"][at : at + 1])
    if status[0] == Status.LOCKED:
        numbers = run.system.mechanism.parameters(values)
        locked = locks_of(run, run.cycle.times(question.steps)[[index]], status, numbers)
    locks = {joint: float(column[0]) for joint, column in locked.items()}
    return {"solved": True, "index": index, **columns, "locks": locks}


# ---- editing ------------------------------------------------------------------------------------------------------


def _edit(question: Asked) -> dict[str, Any]:
    """The text of the model after some gestures, and where its points are shown."""
    text, state = str(question["text"]), question.state
    if state.entries is None:
        raise MechanismError(state.findings)
    places = {str(key): complex(float(x), float(y)) for key, (x, y) in dict(question.get("places") or {}).items()}
    entries = copy.deepcopy(dict(state.entries))
    if not text.strip():
        entries = {"trunnion": 1, "name": "New mechanism", "space": "planar"}
    sketch = Sketch(entries, places, fine=float(question.get("fine") or 0.0), turns=partial(_turns, state))
    says = [_done(sketch, gesture) for gesture in question["gestures"]]
    empty = ("links", "drivers", "loads", "springs", "gears", "assembly", "dimensions", "joints")
    after = {key: entry for key, entry in sketch.entries.items() if entry or key not in empty}
    changed = changed_text(text, after) if text.strip() else text_of(after)
    points = {f"{link}.{point}" for link in sketch.of("links") for point in sketch.points(link)}
    return {
        "text": changed,
        "places": {key: [place.real, place.imag] for key, place in sketch.places.items() if key in points},
        "says": ", ".join(says),
        "made": sketch.made,
    }


GESTURES: dict[str, Callable[[Sketch, Mapping[str, Any]], str]] = {
    "link": drawing.link, "pin": drawing.pinned, "join": drawing.join, "slide": drawing.slide,
    "add-point": drawing.add_point, "driver": drawing.driver, "load": drawing.load, "spring": drawing.spring,
    "gear": drawing.gear, "block": block, "bar-mass": drawing.bar_mass, "centre": drawing.centre, "move": drawing.move,
    "group": changing.group, "set": changing.put_value, "delete": changing.delete, "rename": changing.rename,
    "add-row": changing.add_row,
}  # fmt: skip


def _done(sketch: Sketch, request: Mapping[str, Any]) -> str:
    """Do a gesture; what it is called. MechanismError if it cannot be done."""
    gesture = GESTURES.get(str(request.get("do")))
    if gesture is None:
        raise refused(f"'{request.get('do')}' is no gesture", "studio", f"use {', '.join(GESTURES)}")
    try:
        words = gesture(sketch, request)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        if isinstance(error, MechanismError):
            raise
        what = f"the gesture '{request['do']}' does not fit the model ({error})"
        raise refused(what, "studio", "undo, or correct the text of the model") from error
    sketch.forget()
    return words


def _turns(state: Loaded, index: int) -> dict[str, Any]:
    """Rotation of every moving link in space, (3, 3), at a position of the cycle; MechanismError where it has none."""
    poses = gathered(state.cycle(STEPS, True).motion).poses
    turns = {link: pose.matrix[:, :, index % STEPS] for link, pose in poses.items()}
    if not all(np.isfinite(turn).all() for turn in turns.values()):
        raise refused("cannot be assembled at the position that is shown", "", "go to another position")
    return turns


def _assemblies(question: Asked) -> dict[str, Any]:
    """The other assemblies of a model in the plane, a few at most, with the gestures that take them.

    Each is that of one group, named in place of the hints inside it; the groups after it follow by their own hints.
    """
    entries, rows = dict(question.state.entries or {}), list[dict[str, Any]]()
    if question.state.run.system.mechanism.space != "planar":
        return {"others": rows}
    stated = dict(entries.get("assembly") or {})
    ways = [(modes, mode) for modes in choices(question.state.run) for mode in modes.ways if not mode.taken]
    for modes, mode in ways[:MOST_OTHERS]:
        changes = {name: None for name in stated if name in (*mode.joints, *modes.links)} | {modes.link: mode.name}
        hints = {name: hint for name, hint in (stated | changes).items() if hint is not None}
        with suppress(MechanismError):  # what is stated elsewhere in the model may forbid this one
            run = prepare(Mechanism(**{**entries, "assembly": hints}))
            gestures = [{"do": "set", "path": ["assembly", name], "value": hint} for name, hint in changes.items()]
            with np.errstate(all="ignore"):
                points = tracks(run.walk(run.cycle.times(question.steps)), question.steps)
            name = f"{' and '.join(modes.links)} assembled the other way ({mode.name})"
            rows.append({"name": name, "gestures": gestures, "points": points})
    return {"others": rows}


# ---- what is laid over ---------------------------------------------------------------------------------------------


def _layers(question: Asked) -> dict[str, Any]:
    """What the sheet shows over the mechanism, of what is wanted: columns of the table by their names, and in the plane
    instant centres, transmission angles, pins in their holes.
    """
    cycle, run, layers_wanted = question.cycle, question.state.run, set(question.get("wanted") or ())
    layers: dict[str, Any] = _columns(cycle.columns, question)
    if run.system.mechanism.space == "planar":
        if "seats" in layers_wanted:  # at each end offset of the pin from the middle of its hole and force on that
            layers["seats"] = [
                {"joint": seat.joint, "kind": seat.kind, "clearance": seat.clearance, "length": seat.length,
                 "ends": [{what: {axis: Exact(row) for axis, row in zip("xy", rows, strict=True)}
                           for what, rows in (("offset", offset), ("force", force))}
                          for offset, force in zip(seat.offsets, seat.forces, strict=True)]}
                for seat in seated(cycle.motion)
            ]  # fmt: skip
        with np.errstate(all="ignore"):
            walk = run.walk(run.cycle.times(question.steps))
            if "centres" in layers_wanted:
                layers["centres"] = [
                    {**vars(row), "ground": run.system.mechanism.fixed_link in row.pair,
                     "far": row.far and dict(zip("xy", row.far, strict=True))}
                    for row in instant_centres(walk, question.steps, MOST_LINKS)
                ]  # fmt: skip
            if "transmission" in layers_wanted:  # at the middle joint of each dyad
                middle = {"-".join(module.joints): module.joints[1:2] for module in run.system.plan.modules}
                angles = transmission_angles(walk)
                rows = zip(angles, columns(list(angles.values()), question.steps), strict=True)
                layers["transmission"] = [{"name": name, "joint": joint, "angle": angle}
                                          for name, angle in rows for joint in middle[name]]  # fmt: skip
    return layers


def _blocks(question: Asked) -> dict[str, Any]:
    """The mechanism as blocks wired by their pins, with what passes the wires at each position."""
    return blocks_of(question.state.run.system, without_noise(question.cycle.motion))


def _margins(question: Asked) -> dict[str, Any]:
    """For each block, the ground but not, the locking margin without its friction; none without friction."""
    run = question.state.run
    if not question.friction or len(run.system.plan.modules) > MOST_BLOCKS:
        return {"without": [None] * len(run.system.plan.modules) if question.friction else []}
    return {"without": margins_without(run, question.steps)}


def _curves(question: Asked) -> dict[str, Any]:
    """Names and units of all columns of the table of a cycle, and those that are wanted."""
    return _columns(columns_of(question.cycle.result), question)


def _columns(columns: Mapping[str, Column], question: Asked) -> dict[str, Any]:
    """Names and units of columns, and those of the `names` that are asked for, in SI."""
    names = [str(name) for name in question.get("names") or () if str(name) in columns]
    return {
        "names": [[column.name, column.unit] for column in columns.values()],
        "columns": {name: {"unit": columns[name].unit, "values": columns[name].values} for name in names},
    }


def _compare(question: Asked) -> dict[str, Any]:
    """Figures of the present result, and other variants, `{text, friction}` each, to lay over it: with their figures,
    or why they have none.
    """
    others = list[dict[str, Any]]()
    for other in question["others"]:
        variant = Asked({**other, "steps": question.steps})
        try:
            result = variant.cycle.result
        except MechanismError as error:
            others.append({"scene": None, "why": f"cannot be solved: {sentence(error.findings[0])}", "figures": []})
            continue
        others.append({
            "scene": scene(result, max_positions=MOST_STEPS), "why": None, "figures": figures(variant),
            "margin": margin_of(result, variant.rubs)["margin"],
            "columns": _columns(columns_of(result), question)["columns"],
        })  # fmt: skip
    return {"figures": figures(question), "others": others}


def _export(question: Asked) -> dict[str, Any]:
    """A file of the solved cycle, its table, report or a picture of the position `index`: name, type and bytes."""
    from trunnion.results.save import frame
    from trunnion.views.cycle import mechanism
    from trunnion.views.report import report

    state, what, steps = question.state, str(question["what"]), question.steps
    if state.bare:  # its file would be one without friction
        raise MechanismError(state.findings)
    if what not in FILES:
        raise MechanismError(Finding(f"'{what}' is no file of the studio", remedy=f"use {', '.join(FILES)}"))
    result = state.cycle(steps, True).result
    if what == "csv":
        content = str(frame(result, units="model").to_csv(index=False, lineterminator="\n")).encode()
    elif what == "report":
        content = report(result, state.cycle(steps, False).result).encode()
    else:
        stream = io.BytesIO()
        mechanism(result, index=question.index).savefig(stream, format=what)
        content = stream.getvalue()
    stem = "".join(sign if sign.isalnum() else "-" for sign in str((state.entries or {}).get("name") or ""))
    name = f"{stem[:60].strip('-') or 'mechanism'}.{'html' if what == 'report' else what}"
    return {"name": name, "mime": FILES[what], "bytes": content}


@np.errstate(all="ignore")
def _corner(question: Asked) -> dict[str, Any]:
    """The worst corner of the tolerances and plays for a measure, on the stated side or the worse of both.

    Returns
    -------
    dict
        values: least and largest deviation, SI, and their texts; side: the shown one, 0 or 1; index, at: position
        nearest to where it stands, and that in words, None of a figure of the whole cycle; rows: numbers that matter,
        [name, nominal, change]; scene: of the mechanism there, its errors being those against the nominal one, with its
        holes as wide as they are. Its places alone count: it is solved without friction, with which it might lock.
    """
    from trunnion.cycle.positions import positions
    from trunnion.cycle.summary import result_of
    from trunnion.studies.tolerance.linear import worst_corner  # it takes long to load

    def signed(value: float, unit: str) -> str:
        return f"{'−' if value < 0 else '+'}{quantity(abs(float(value)), unit)}"

    steps, mechanism = question.steps, question.cycle.run.system.mechanism
    corner = worst_corner(mechanism, str(question["measure"]), question.get("side"))
    run, time, inputs = corner.prepared.run, corner.time, corner.prepared.inputs
    over_cycle, bare = not np.isfinite(time), prepare(mechanism.with_friction("off"))
    there = replace(bare, values={**bare.values, **corner.numbers})
    # its pins lie where the corner has them
    there.__dict__.update(ideal=replace(there, values=inputs.nominal), erring=True, seats=[])
    result = result_of(there, positions(there, steps, margin=False, averaged=False)).dataset
    drawn_scene = scene(result, max_positions=steps)
    for joint in inputs.loose:
        play, links = inputs.play(joint, corner.numbers), run.system.joints[joint].links
        guide = play.model.size is not None and play.model.size[0] == "guide"
        drawn_scene["built"]["seats"].append({
            "joint": joint, "kind": "guide" if guide else "pin", "clearance": float(np.ravel(primal(play.radii[0]))[0]),
            "length": float(np.ravel(primal(play.length))[0]) if guide else None, "links": list(links), "ends": [],
        })  # fmt: skip
    return {
        "values": list(corner.deviations),
        "texts": [signed(value, corner.unit) for value in corner.deviations],
        "side": corner.side,
        "index": None if over_cycle else int(np.argmin(np.abs(run.cycle.times(steps) - time))),
        "at": None if over_cycle else run.system.dial(run.values, np.array([time])).at(0),
        "rows": [[path, quantity(nominal, unit), signed(value - nominal, unit)]
                 for path, unit, nominal, value in corner.rows],
        "scene": drawn_scene,
    }  # fmt: skip


ANSWERS: dict[str, Callable[[Asked], dict[str, Any]]] = {
    "start": _start, "example": _example, "picture": _example, "model": _model, "cycle": _cycle,
    "drag": _drag, "try": _try, "edit": _edit, "export": _export, "assemblies": _assemblies, "layers": _layers,
    "blocks": _blocks, "margins": _margins, "curves": _curves, "compare": _compare, "corner": _corner,
}  # fmt: skip
BESIDE = (_drag, _try, _cycle, _margins, _corner)
