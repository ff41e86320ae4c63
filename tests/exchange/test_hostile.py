"""Files that are damaged, or made to harm: each is read or refused in a sentence, soon, whatever its format."""

import json
import logging
import random
import re
import struct
import time
import zipfile
from xml.etree import ElementTree

import ezdxf
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exchange.step_mechanisms import slider_crank
from exchange.step_mechanisms import written as step
from exchange.test_dxf import drawing
from exchange.test_dxf import four_bar as drawn
from exchange.test_freecad import ALIKE
from exchange.test_freecad import four_bar as joined
from exchange.test_linkages import FOUR_BAR, PMKS
from exchange.test_mesh import BOX, CORNERS, FACES, model_3mf, packed, solid, stl
from exchange.test_robots import MJCF, OLD_SDF, SDF, URDF
from trunnion.errors import MechanismError
from trunnion.exchange import import_file, linkages, model_text

logging.getLogger("ezdxf").disabled = True  # it quotes damaged text, which xdist cannot send
BOXED, ITEM = solid(1, BOX * CORNERS, FACES), '<item objectid="1"/>'


def saved(document, path):
    document.saveas(path)


SOUND = {  # writes a file that is read
    ".step": lambda path: step(path, slider_crank()),
    ".dxf": lambda path: saved(drawing(**drawn()), path),
    ".mjcf": lambda path: path.write_text(MJCF),
    ".sdf": lambda path: path.write_text(SDF),
    ".old.sdf": lambda path: path.write_text(OLD_SDF),
    ".urdf": lambda path: path.write_text(URDF),
    ".stl": lambda path: path.write_bytes(stl(BOX * CORNERS, FACES)),
    ".3mf": lambda path: packed(path.parent, model_3mf(BOXED, ITEM)).replace(path),
    ".FCStd": lambda path: joined(np.eye(4), ALIKE).save(path),
    ".json": lambda path: path.write_text(json.dumps(FOUR_BAR)),
    ".pmks": lambda path: path.write_text(PMKS["four-bar"]),
}


def sound(suffix, folder):
    path = folder / f"sound{suffix}"
    SOUND[suffix](path)
    return path


def refusal(path):
    """Why a file is not read; empty if it is."""
    try:
        model_text(import_file(path))
    except MechanismError as error:
        return str(error).encode().decode()  # any terminal takes it
    return ""


@settings(deadline=None, max_examples=150)
@given(
    suffix=st.sampled_from(sorted(SOUND)),
    damage=st.lists(
        st.tuples(
            st.floats(0, 0.999),
            st.binary(max_size=5) | st.sampled_from([b"'", b"(", b"#1", b"1.E400", b";", b"\0", b"nan", b"-1"]),
            st.integers(0, 5),
        ),
        min_size=1,
        max_size=4,
    ),
)
def test_damage_anywhere_is_no_traceback(suffix, damage, tmp_path_factory):
    path = sound(suffix, tmp_path_factory.mktemp("damage"))
    data = path.read_bytes()
    for share, inserted, lost in damage:
        at = int(share * len(data))
        data = data[:at] + inserted + data[at + lost :]
    path.write_bytes(data)
    refusal(path)


VALUES = ("", "0", "-1", "nan", "1e308", "x", "0 0 0", "1 2 3", "world", "A", "crank", "true", "__model__", "..", "a.1")


@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 2**31 - 1), suffix=st.sampled_from([".mjcf", ".sdf", ".old.sdf", ".urdf"]))
def test_other_values_in_xml_say_what_is_wrong(seed, suffix, tmp_path_factory):
    path = sound(suffix, tmp_path_factory.mktemp("values"))
    choose, root = random.Random(seed), ElementTree.fromstring(path.read_bytes())
    for _ in range(choose.randint(1, 3)):
        element = choose.choice(list(root.iter()))
        kind = choose.randint(0, 3)
        if element.attrib and kind == 0:
            element.set(choose.choice(list(element.attrib)), choose.choice(VALUES))
        elif element.attrib and kind == 1:
            del element.attrib[choose.choice(list(element.attrib))]
        elif len(element) and kind == 2:
            element.remove(choose.choice(list(element)))
        elif len(element) and kind == 3:
            element.append(choose.choice(list(element)))
        else:
            element.text = choose.choice(VALUES)
    path.write_bytes(ElementTree.tostring(root))
    assert "as its format has it" not in refusal(path)  # but in words of the reader, which parses it by itself


def points(count, x=b"1.0"):
    marks = b"  0\nPOINT\n  8\na\n 10\n" + x + b"\n 20\n2.0\n"
    return b"  0\nSECTION\n  2\nENTITIES\n" + marks * count + b"  0\nENDSEC\n  0\nEOF\n"


def blocks(path, count, **attributes):
    """A block in blocks: ten of each in the next, or in itself if the count is below 0."""
    document = ezdxf.new("R2010")
    document.blocks.new("b0").add_circle((0, 0), 1)
    for depth in range(1, abs(count) + 1):
        block = document.blocks.new(f"b{depth}")
        for k in range(10):
            block.add_blockref(f"b{depth - 1}" if count > 0 else f"b{depth}", (k, 0))
    document.modelspace().add_blockref(f"b{abs(count)}", (0, 0), dxfattribs=attributes)
    document.saveas(path)


def zipped(path, text, name):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(name, text)


def lying(path):
    """A zip that says its model is small, and unpacks to 60 MB."""
    zipped(path, b"<model>" + b" " * 60_000_000 + b"</model>", "3D/3dmodel.model")
    path.write_bytes(path.read_bytes().replace(struct.pack("<I", 60_000_015), struct.pack("<I", 1000)))


def nested(count):
    """Objects each of ten of the one before."""
    parts = [BOXED]
    for number in range(2, count + 2):
        component = f'<component objectid="{number - 1}"/>' * 10
        parts.append(f'<object id="{number}"><components>{component}</components></object>')
    return "".join(parts)


def of_step(change):
    return lambda path: path.write_text(change(step(path, slider_crank()).read_text()))


def of_3mf(objects=BOXED, build=ITEM, unit="millimeter", head=""):
    return lambda path: zipped(path, model_3mf(objects, build, unit, head), "3D/3dmodel.model")


BOMB = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;">]>'
OUTSIDE = '<!DOCTYPE r SYSTEM "file:///etc/passwd">'
JUNK = np.random.default_rng(1).bytes(50_000)
HEAD = "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n"
GLB = struct.pack("<4sII", b"glTF", 2, 100) + struct.pack("<I4s", 80, b"JSON") + b'{"asset":'
TRIANGLE = json.dumps({
    "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "buffers": [{"byteLength": 48}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 12}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                  {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
}).ljust(660).encode()  # fmt: skip
COMPONENT = '<object id="1"><components><component objectid="1"/></components></object>'
PART = '<D><Objects><Object type="App::Part" name="A"/></Objects><ObjectData><Object name="A"/></ObjectData></D>'
HOSTILE = {
    ".step": {
        "many": HEAD + "".join(f"#{n}=CARTESIAN_POINT('',(0.,0.,{n}.));\n" for n in range(1, 10**6)) + "ENDSEC;\n",
        "junk with a head": b"ISO-10303-21;" + bytes(range(256)) * 40 + b"ENDSEC;",
        "cut off": of_step(lambda text: text[: len(text) // 2]),
        "a missing entity": of_step(lambda text: re.sub(r"#40=.*\n", "", text)),
        "brackets": of_step(lambda text: text.replace("CLOSED_SHELL", "X(" * 5000 + "CLOSED_SHELL", 1)),
        "open comments": of_step(lambda text: text.replace("DATA;", "DATA;" + "#1=/*" * 300_000)),
        "open texts": of_step(lambda text: text.replace("DATA;", "DATA;" + "#1='" * 300_001)),
        "slashes": of_step(lambda text: text.replace("DATA;", "DATA;#1=" + "/ *" * 10**6 + "/*")),
        "a wrong kind": of_step(lambda text: text.replace("ADVANCED_FACE", "VERTEX_POINT")),
        "no numbers": of_step(lambda text: re.sub(r"\d\.\d+E", "nan", text)),
        "a list for a number": of_step(lambda text: text.replace("L_SURFACE('',", "L_SURFACE('',(),")),
        "no shapes": of_step(lambda text: text.replace("SHAPE_DEFINITION_REP", "OTHER_REP")),
        "zero axes": of_step(lambda text: re.sub(r"DIRECTION\('',\(.*?\)\)", "DIRECTION('',(0.,0.,0.))", text)),
        "inside itself": of_step(lambda text: re.sub(r"(OCCURRENCE\('\d+','','',)#\d+,(#\d+)", r"\1\2,\2", text)),
    },
    ".dxf": {
        "many": points(10**6),
        "some": points(10_000),
        "bomb": lambda path: blocks(path, 10),
        "circular": lambda path: blocks(path, -1),
        "array": lambda path: blocks(path, 1, row_count=30000, column_count=30000, row_spacing=1, column_spacing=1),
        "binary": b"AutoCAD Binary DXF\r\n\x1a\x00" + JUNK,
        "nan": points(2, b"nan"),
        "huge": points(1, b"1e308") + points(1),
        "letters": points(2, b"one"),
        "stack": lambda path: saved(drawing(**{f"l{i}": [("line", (0, i * 1e-9), (9, 0))] for i in range(900)}), path),
        "nothing": lambda path: saved(drawing(), path),
    },
    ".3mf": {
        "bomb": lambda path: zipped(path, b"<model>" + b" " * 60_000_000 + b"</model>", "3D/3dmodel.model"),
        "lying": lying,
        "entities": of_3mf(head=BOMB),
        "external": of_3mf(head=OUTSIDE),
        "no model": lambda path: zipped(path, b"<a/>", "readme.txt"),
        "no object": of_3mf(""),
        "nothing": of_3mf(build=""),
        "loop": of_3mf(COMPONENT),
        "many": of_3mf(nested(6), '<item objectid="7"/>'),
        "no corner": of_3mf(solid(1, BOX * CORNERS, FACES + 3)),
        "unit": of_3mf(unit="furlong"),
        "transform": of_3mf(build='<item objectid="1" transform="1 2 3"/>'),
        "numbers": of_3mf(BOXED.replace('x="0.0"', 'x="zero"')),
    },
    ".stl": {
        "cut": stl(BOX * CORNERS, FACES)[:300],
        "text": "solid für Gäste\nfacet\n".encode() * 100,
        "count": b"\0" * 80 + struct.pack("<I", 2**32 - 1) + b"\0" * 500,
    },
    ".glb": {
        "cut": GLB,
        "nothing": struct.pack("<4sIII4s", b"glTF", 2, 24, 4, b"JSON") + b"{}  ",
        "no corner": struct.pack("<4sIII4s", b"glTF", 2, 76 + len(TRIANGLE), len(TRIANGLE), b"JSON")
        + TRIANGLE
        + struct.pack("<I4s9f3I", 48, b"BIN\0", *range(9), 0, 1, 9),
    },
    ".FCStd": {
        "entities": lambda path: zipped(path, f"{BOMB}<D>&b;</D>", "Document.xml"),
        "open": lambda path: zipped(path, "<Document><Objects>", "Document.xml"),
        "binary": lambda path: zipped(path, "\x00\x01binary", "Document.xml"),
        "nothing": lambda path: zipped(path, "<Document/>", "Document.xml"),
        "no assembly": lambda path: zipped(path, PART, "Document.xml"),
        "no document": lambda path: zipped(path, "x", "other.xml"),
    },
    ".json": {"deep": "[" * 100_000, "a list": "[]", "a number": '{"joints": 3}', "no joints": '{"joints": []}'},
    ".pmks": {"long": "https://app.pmksplus.com/?" + "x" * 2_000_000},
}
for suffix, root, inner in ((".mjcf", "mujoco", "default"), (".sdf", "sdf", "model"), (".urdf", "robot", "link")):
    HOSTILE[suffix] = {
        "entities": f"{BOMB}<{root}>&b;</{root}>",
        "external": f'{OUTSIDE[:-1]} [<!ENTITY a SYSTEM "file:///etc/passwd">]><{root}>&a;</{root}>',
        "elements": f"<{root}>{'<link/>' * 10**6}</{root}>",
        "large": f"<{root}>{'<link />' * 2 * 10**6}</{root}>",
        "a long text": f'<{root} name="{"1 " * 4 * 10**6}"/>',
        "deep": f"<{root}>{f'<{inner}>' * 90_000}{f'</{inner}>' * 90_000}</{root}>",
        "open": f"<{root}><link name='a'>",
        "another root": "<html/>",
        "encoding": f'<?xml version="1.0" encoding="klingon"?><{root}/>',
        "nothing": f"<{root}/>",
    }
for kinds in HOSTILE.values():
    kinds |= {"empty": b"", "blank": b"\n\n\n", "junk": JUNK, "words": "Zeichnung für Gäste\n".encode() * 100}


@pytest.mark.sample(15)
@pytest.mark.spread(5)
@pytest.mark.parametrize(("suffix", "kind"), [(suffix, kind) for suffix, kinds in HOSTILE.items() for kind in kinds])
def test_a_hostile_file_is_one_sentence(suffix, kind, tmp_path):
    path, data = tmp_path / f"hostile{suffix}", HOSTILE[suffix][kind]
    if callable(data):
        data(path)
    else:
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
    start = time.monotonic()
    with pytest.raises(MechanismError) as error:
        import_file(path)
    assert time.monotonic() - start < 60  # some 6 s where nothing else runs; it must not hang
    (finding,) = error.value.findings
    assert str(finding).startswith(str(path))
    assert len(finding.what) < 400


def test_a_mistake_of_this_program_is_no_damage_of_the_file(tmp_path, monkeypatch):
    """It goes on as it is; what a library raises at a file is a sentence, with its cause."""
    path = sound(".pmks", tmp_path)
    monkeypatch.delattr(linkages, "CHECKS")
    with pytest.raises(NameError):
        import_file(path)
    monkeypatch.setattr(linkages, "CHECKS", None, raising=False)
    with pytest.raises(MechanismError, match="is damaged") as raised:
        import_file(path)
    assert isinstance(raised.value.__cause__, TypeError)
