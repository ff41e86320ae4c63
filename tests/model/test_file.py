"""Model files: what is read is what is written and what the schema has; a file that is none does no harm."""

import copy
import json
import os
import random
import time
from collections.abc import Callable
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from model_samples import DURANGO, EXAMPLES, RSSP, VARIED

from trunnion import read
from trunnion.errors import Finding, MechanismError
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.checks.check import check_model
from trunnion.model.file import MAX_DEPTH
from trunnion.model.mechanism import Mechanism, read_mechanism
from trunnion.model.rewrite import rewrite_mechanism
from trunnion.model.schema import SCHEMA_FILE, json_schema, schema_text
from trunnion.rig.reading.mapping import read_mapping
from trunnion.rig.virtual.rig_file import Rig

FindingsOf = Callable[..., tuple[Finding, ...]]


@pytest.mark.spread(32)
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
@pytest.mark.parametrize("extension", ["yaml", "json"])
def test_examples_are_read_and_written_without_loss(example, extension, tmp_path):
    """As a model with every section is, below: what is written is what was read."""
    mechanism = read_mechanism(example)
    # the pins of Pezzuti et al. are shorter than their diameter, which counts where they lean in their holes
    short = example.stem == "pezzuti-cardan-as-built"
    assert all(short and "less than its diameter" in finding.what for finding in check_model(mechanism))
    (tmp_path / "copies").mkdir()
    written_and_read(mechanism, tmp_path / "copies" / f"copy.{extension}")
    assert os.listdir(tmp_path / "copies") == [f"copy.{extension}"]  # no temporary file stays behind


def written_and_read(mechanism, path):
    """What is written is what was read."""
    mechanism.write(path)
    again = Mechanism.read(path)
    assert again == mechanism
    assert again.digest == mechanism.digest
    assert again.data() == mechanism.data()


@pytest.mark.parametrize("text", [VARIED, RSSP])
@pytest.mark.parametrize("extension", ["yaml", "json"])
def test_a_model_with_every_section_is_read_and_written_without_loss(text, extension, tmp_path):
    (tmp_path / "model.yaml").write_text(text, encoding="utf-8")
    written_and_read(read_mechanism(tmp_path / "model.yaml"), tmp_path / f"copy.{extension}")


TOML = """
trunnion = 1
[links]
ground = { points = { A = [0, 0] } }
crank = { points = { A = [0, 0], B = ["2 m", 0] } }
[joints]
A = { type = "revolute", links = ["ground", "crank"] }
[drivers.A]
speed = "10 rad/s"
"""


def test_toml_and_json_with_tabs_and_their_lines(tmp_path, findings_of):
    path, data = tmp_path / "good.toml", read_mechanism(DURANGO).data()
    path.write_text(TOML)
    assert read_mechanism(path).parameters()["links.crank.points.B.x"] == 2.0
    found = findings_of(TOML.replace("speed =", "sped ="), "model.toml")
    assert {(one.where, one.line) for one in found} >= {("drivers.A.sped", None)}
    with pytest.raises(MechanismError, match=r"TOML is read but not written — write \.yaml or \.json"):
        read_mechanism(path).write(tmp_path / "other.toml")
    text = json.dumps(data, indent="\t", ensure_ascii=True)
    (tmp_path / "model.json").write_text(text)
    assert read_mechanism(tmp_path / "model.json").data() == data
    found = findings_of(text.replace('"mass"', '"mas"', 1), "model.json")
    assert found[0].line == 1 + text[: text.index('"mass"')].count("\n")


BOMB = "a: &a [x, x, x]\nb: &b [*a, *a, *a]\nc: &c [*b, *b, *b]\nd: [*c, *c, *c]\n"
BAD_FILES = [
    ("", 1, "is empty", "examples"), ("\n  \n", 1, "is empty", "examples"),
    ("# only a remark\n", 1, "not a group of entries", "examples"),
    ("- 1\n- 2\n", 1, "not a group of entries", "examples"), ("hello", 1, "not a group of entries", "examples"),
    (b"\xff\xfe\x00\x01", 1, "is not UTF-8 text (byte 0)", "UTF-8"),
    (b"trunnion: 1\nname: caf\xe9\n", 2, "is not UTF-8 text (byte 21)", "UTF-8"),
    (b"\x00\x01\x02\x03" * 100, None, "is not YAML", "check"),
    ("trunnion: 1\nlinks: [1, 2\njoints: 3\n", 3, "is not YAML", "brackets"),
    ("trunnion: 1\n  links: 2\n", 2, "is not YAML: mapping values are not allowed here (column 8)", "indentation"),
    ("trunnion: 1\n\tlinks: 2\n", 2, "is not YAML", "indentation"),
    ("trunnion: 1\nname: 'open\n", None, "is not YAML", "quotes"),
    ("trunnion: 1\n---\ntrunnion: 1\n", 2, "is not YAML", ""),
    ("trunnion: 1\nname: a\nname: b\n", 3, "the key 'name' is given twice, first in line 2", "remove"),
    ("trunnion: 1\n? [a, b]\n: 3\n", 2, "a key is not a text", "key: value"),
    (BOMB, 2, "the alias *a is not allowed", "write it out"),
    ("trunnion: 1\nlinks: &l {a: *l}\n", 2, "the alias *l is not allowed", ""),
    ("a: &a {b: 1}\nc:\n  <<: *a\n", 3, "the alias *a is not allowed", ""),
    ("trunnion: 1\nname: !!python/object/apply:os.system [ls]\n", 2, "the tag", "remove the tag"),
    ("trunnion: 1\nname: !secret x\n", 2, "the tag !secret is not allowed", "remove the tag"),
    ("trunnion: 1\nname: !!float x\n", 2, "'x' is not a number", "12.5"),
    ("trunnion: 1\nx: " + "[" * 5000 + "\n", None, "", ""),
    ("trunnion: 1\nx: " + "[" * 100 + "]" * 100 + "\n", None, "nested too deeply", "brackets"),
    ("trunnion: 1\nx: " + "{a: " * 100 + "1" + "}" * 100 + "\n", None, "nested too deeply", "brackets"),
    ("trunnion: 1\n", 1, "there are no links", "state"),
    ("trunnion: 1\n3: x\n", 2, "the key '3' is unknown", "known: "),
    ("trunnion: 1\nlinks:\n", 2, "is empty", "value or remove"),
    ("model.json", "{", 1, "is not JSON", ""), ("model.json", '{"trunnion": 1, "trunnion": 1}', 1, "given twice", ""),
    ("model.json", "[1]", 1, "not a group of entries", ""), ("model.json", '{"trunnion": 1, "name": NaN}', 1, "", ""),
    ("model.toml", "a = [", None, "is not TOML", ""), ("model.toml", "a = 1\na = 2\n", 2, "", ""),
]  # fmt: skip


@pytest.mark.parametrize("row", BAD_FILES)
def test_files_that_are_no_model(findings_of, row):
    *name, content, line, what, remedy = row
    started = time.process_time()
    found = findings_of(content, *name)
    assert time.process_time() - started < 3
    fitting = [one for one in found if what in one.what and remedy in one.remedy]
    assert fitting, "\n".join(map(str, found))
    assert line is None or fitting[0].line == line


@pytest.mark.parametrize("name", ["model.yaml", "model.json", "model.toml"])
@pytest.mark.parametrize("depth", [MAX_DEPTH - 1, MAX_DEPTH, MAX_DEPTH + 1, MAX_DEPTH + 2])
def test_nesting_up_to_the_limit(findings_of, name, depth):
    """The file itself is the first group; at the limit it is read, and what it says is refused for what it is."""
    value = "[" * (depth - 1) + "]" * (depth - 1)
    texts = {"yaml": f"trunnion: 1\nx: {value}\n", "json": f'{{"trunnion": 1, "x": {value}}}',
             "toml": f"trunnion = 1\nx = {value}\n"}  # fmt: skip
    found = findings_of(texts[name.partition(".")[2]], name)
    assert any("nested" in one.what for one in found) == (depth > MAX_DEPTH)
    assert any("'x' is unknown" in one.what for one in found) == (depth <= MAX_DEPTH)


@pytest.mark.parametrize(
    ("name", "what"),
    [("missing.yaml", "cannot be read: No such file or directory"), ("folder.yaml", "is not a file"),
     ("model.txt", "the extension '.txt' is not one of YAML, JSON or TOML"), ("model", "the extension '' is not one")],
)  # fmt: skip
def test_paths_that_are_no_file(tmp_path, name, what):
    (tmp_path / "folder.yaml").mkdir()
    with pytest.raises(MechanismError) as error:
        read_mechanism(tmp_path / name)
    (finding,) = error.value.findings
    assert what in finding.what
    assert finding.remedy
    assert finding.file == str(tmp_path / name)


def test_a_huge_file_is_refused_at_once(tmp_path):
    path = tmp_path / "huge.yaml"
    with path.open("wb") as stream:
        stream.truncate(50_000_000)
    started = time.process_time()
    with pytest.raises(MechanismError, match=r"has 50\.0 MB, a model file at most 1\.0 MB"):
        read_mechanism(path)
    assert time.process_time() - started < 0.5


def test_writing_fails_whole(tmp_path):
    mechanism = read_mechanism(DURANGO)
    with pytest.raises(MechanismError, match="cannot be written: No such file or directory"):
        mechanism.write(tmp_path / "none" / "model.yaml")
    folder = tmp_path / "model.yaml"
    folder.mkdir()
    with pytest.raises(MechanismError, match="cannot be written"):
        mechanism.write(folder)
    assert os.listdir(tmp_path) == ["model.yaml"]


VALUES = st.one_of(
    st.floats(-1e6, 1e6, allow_nan=False).map(lambda x: x or 0.5),
    st.integers(-(10**6), 10**6).map(lambda x: x or 1),
    st.tuples(st.floats(0.001, 1e6), st.sampled_from(["m", "mm", "um", "inch"])).map(lambda x: f"{x[0]!r} {x[1]}"),
    st.sampled_from(["60 mm ± 0.05 mm", "2 * AB", "+60 mm +0.02/-0.01 mm", "AB - 1 mm", "yes * 1 mm"]),
)


@pytest.mark.slow
@settings(deadline=None, max_examples=50)
@given(VALUES, st.sampled_from(["yaml", "json"]))
def test_any_value_is_read_back_as_written(tmp_path_factory, value, kind):
    base = read_mechanism(DURANGO).data()
    base["dimensions"] = {**base["dimensions"], "yes": 2, "extra": value}
    mechanism = Mechanism(**base)
    path = tmp_path_factory.mktemp("written") / f"model.{kind}"
    mechanism.write(path)
    again = read_mechanism(path)
    assert again == mechanism
    assert type(again.dimensions["extra"].source) is type(value)


# Of each example; `python -m benchmarks.fuzz` damages them, and all other files, by the ten thousand.
MUTANTS = int(os.environ.get("TRUNNION_MUTANTS", "12"))


ODD = [
    None, True, 0, -1, 1e308, 10**400, float("nan"), "", "A", "AB", "-5 mm", "1/0", [], {}, [1], [[1]], {"a": 1},
    "x" * 600, {"at": 3}, [0, 0, 0], {"law": "x"}, {1: 2}, ("a", "b"), b"x", object(),
]  # fmt: skip


def _holders(data):
    """Every place in plain data that a value can be put at."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    return [place for key, value in items for place in [(data, key), *_holders(value)]]


@pytest.mark.sample(10)
@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_no_odd_value_anywhere_gives_anything_but_findings(example):
    draw = random.Random(f"odd value in {example.stem}")
    whole = read_mechanism(example).data()
    for _ in range(MUTANTS * 5):
        data = copy.deepcopy(whole)
        for _ in range(draw.randint(1, 3)):
            holder, key = draw.choice(_holders(data))
            if draw.random() < 0.2:
                del holder[key]
            else:
                holder[key] = copy.deepcopy(draw.choice(ODD))  # the next may go into it
        with suppress(MechanismError):
            Mechanism(**data).parameters()


def test_anchors_mean_nothing(tmp_path):
    """Nothing may refer to them, so two of one name are no matter; and the text stays as it is written."""
    source = next(path for path in EXAMPLES if path.stem == "slider-crank")
    text = source.read_text(encoding="utf-8")
    anchored = text.replace("\nlinks:", "\nlinks: &a", 1).replace("\ndrivers:", "\ndrivers: &a", 1)
    assert anchored.count("&a") == 2
    (tmp_path / "anchored.yaml").write_text(anchored, encoding="utf-8")
    mechanism = read_mechanism(tmp_path / "anchored.yaml")
    assert mechanism.data() == read_mechanism(source).data()
    name = next(iter(mechanism.dimensions))
    for values in ({name: "1.5 m"}, {f"errors.{name}": "1 mm"}):
        rewrite_mechanism(mechanism.with_values(values), tmp_path / "anchored.yaml", tmp_path / "other.yaml")
        assert read_mechanism(tmp_path / "other.yaml").data() == mechanism.with_values(values).data()


DEEP = 20_000
BOMBS = {
    "dotted key": (".toml", "x." * DEEP + "x = 1"), "dotted table": (".toml", "[" + "x." * DEEP + "x]"),
    "TOML brackets": (".toml", "x = " + "[" * DEEP + "]" * DEEP),
    "TOML groups": (".toml", "x = " + "{a = " * DEEP + "1" + "}" * DEEP),
    "tables in tables": (".toml", "".join(f"[[{'.'.join('x' * k)}]]\n" for k in range(1, 300))),
    "TOML whole number": (".toml", "x = " + "9" * 5000), "long word": (".toml", 'name = """' + "x" * 900_000 + '"""'),
    "YAML brackets": (".yaml", "x: " + "[" * DEEP + "]" * DEEP), "YAML lists": (".yaml", "- " * DEEP),
    "YAML aliases": (".yaml", "a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]"),
    "YAML whole number": (".yaml", "trunnion: " + "9" * 5000), "a key twice": (".yaml", ".nan: 1\n.nan: 2"),
    "JSON groups": (".json", '{"x": ' * DEEP + "1" + "}" * DEEP),
    "half a sign": (".json", r'{"trunnion": 1, "name": "\ud800"}'),
}  # fmt: skip


@pytest.mark.spread(29)
@pytest.mark.parametrize("bomb", BOMBS)
@pytest.mark.parametrize("reader", [read, Rig.read, read_mapping])
def test_what_never_ends_is_a_finding(bomb, reader, tmp_path):
    suffix, text = BOMBS[bomb]
    path = tmp_path / f"bomb{suffix}"
    path.write_text(text)
    begin = time.process_time()
    with pytest.raises(MechanismError):
        reader(path)
    assert time.process_time() - begin < 10


def test_the_shipped_schema_is_up_to_date():
    assert SCHEMA_FILE.read_text(encoding="utf-8") == schema_text(), "run python -m trunnion.model.schema"


@pytest.mark.spread(15)
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_satisfy_the_schema(example):
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(json_schema())
    data = read_mechanism(example).data()
    validator.validate(data)
    assert not validator.is_valid({**data, "linkz": {}})
    assert not validator.is_valid({**data, "links": {"a": {"points": {"A": {"axis": [1, 0]}}}}})


def test_the_schema_has_the_tables_their_limits_and_their_files():
    parts, text = json_schema()["$defs"], json.dumps(json_schema())
    names = {*PAIRS, *FRICTION_LAWS, *(key for law in FRICTION_LAWS.values() for key in law.parameters)}
    assert not [name for name in names if f'"{name}"' not in text]
    assert parts["Link"]["properties"]["mass"]["minimum"] == 0
    assert parts["Driver"]["properties"]["period"]["exclusiveMinimum"] == 0
    efficiency = parts["Motor"]["properties"]["efficiency"]
    assert (efficiency["exclusiveMinimum"], efficiency["maximum"]) == (0, 1)
    jsonschema = pytest.importorskip("jsonschema")
    data = read_mechanism(next(path for path in EXAMPLES if path.stem == "slider-crank")).data()
    data["tables"]["pressure"] = {"file": "gas.csv", "period": "360 deg"}
    jsonschema.Draft202012Validator(json_schema()).validate(data)


@pytest.mark.parametrize("verb", ["analyse", "data"])
def test_a_file_of_another_kind_is_named_in_one_finding(tmp_path, verb):
    """As where model and mapping stand in the wrong order; not every key that the other kind has."""
    path = tmp_path / "rig.yaml"
    path.write_text("trunnion-rig: 1\nsensors: {}\nschedule: {}\n", "utf-8")
    with pytest.raises(MechanismError) as failure:
        read(path) if verb == "analyse" else read_mapping(path)
    (finding,) = failure.value.findings
    assert "but a rig file" in finding.what
    assert finding.line == 1
