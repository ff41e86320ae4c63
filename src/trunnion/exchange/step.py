"""STEP files (ISO 10303-21, AP203 to AP242): solids become links, their pins, holes and guides joints.

Written are the skeleton of a mechanism at a position, or the parts of the file that it came from, moved there.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.exchange.brep import Face, Part21, Solid, mass_of, moments_of, moved, quoted
from trunnion.exchange.draft import (
    MATERIALS,
    Array,
    Body,
    Draft,
    ImportOptions,
    Place,
    Positions,
    faults_of,
    free_name,
    refused,
)
from trunnion.exchange.mating import joined
from trunnion.exchange.model_file import complete, flat_frame
from trunnion.exchange.step_assembly import Assembly, Occurrence

PATIENCE = 60.0  # s, for the mesh of a free-form solid
DEFLECTION = 1e-3  # of a mesh from its surface, of the unit of the file; and angle, rad
SIZE = 0.02  # of the mechanism: length of an axis of a skeleton that has no bearing
FIT = 1e-6  # of the size: between the points of a model and of the file it is moved in
Entry = tuple[Occurrence, Solid, Place]  # the part that a solid belongs to, and its place in the whole


def read(path: Path, options: ImportOptions) -> Draft:
    """The parts of a STEP file and the joints between them.

    Parameters
    ----------
    path : the file. options : density of parts without one, gap of pins in their holes, unit if the file has none.

    Returns
    -------
    Draft : a body for each part, or rigid sub-assembly, right below the top.

    Raises
    ------
    MechanismError : if it is no STEP file, is cut off, too large or has no solids.
    """
    return _drafted(Part21(path), options)[0]


def _drafted(file: Part21, options: ImportOptions) -> tuple[Draft, Assembly, dict[str, Occurrence]]:
    """The draft of a file, with the occurrence that each body comes from."""
    assembly = Assembly(file, options.unit)
    links = assembly.tree()
    name = links[0].name if len(links) == 1 else ""
    while len(links) == 1 and links[0].children:
        top = links[0]
        itself = [replace(top, children=[])] if assembly.solids(top.definition)[0] else []
        links = itself + top.children
    draft, faces, parts, tolerances = Draft(name), {}, {}, assembly.tolerances()
    for link in links:
        solids = _solids(assembly, link, draft)
        label = link.name or "part"
        if len(links) == 1 and len(solids) > 1:  # a file of bodies without an assembly
            names = [str(file[solid.number][file.kind(solid.number)][0] or "") for _, solid, _ in solids]
            names = [label if text in ("", "NONE") else text for text in names]
            what = f"is the only part, with {len(solids)} solids: each is taken as a link"
            draft.warn("exchange.solids", f"links.{label}", what, "export an assembly", count=len(solids))
            groups = [(text, [entry]) for text, entry in zip(names, solids, strict=True)]
        else:
            groups = [(label, solids)] if solids else []
        for text, entries in groups:
            body = _body(assembly, free_name(text, draft.bodies), entries, options, draft)
            draft.bodies[body.name], parts[body.name] = body, link
            faces[body.name] = [_placed(face, place, tolerances) for _, solid, place in entries for face in solid.faces]
            if len(entries) > 1:
                kind = "sub-assembly" if link.children else "part"
                what = f"is a {kind} of {len(entries)} solids, taken as one rigid link"
                remedy = "export it dissolved, its parts right below the top, if they move"
                draft.warn("exchange.rigid", f"links.{body.name}", what, remedy)
    if not draft.bodies:
        raise refused("has no solids", remedy="export solids, as AP214 or AP242 with exact geometry")
    if assembly.missing:
        draft.assumed_unit(options)
    draft.ground = options.ground if options.ground in draft.bodies else ""
    joined(draft, faces, options.gap)
    still = complete(draft)
    for name, pair in still.pairs.items():
        if pair.type == "revolute" and pair.links[1] == still.ground:  # its coordinate is then that of the moving link
            draft.pairs[name].links = draft.pairs[name].links[::-1]
    if not draft.pairs and len(draft.bodies) > 1:
        what = "no pin lies in a hole and no two walls guide a part: there are no joints"
        draft.warn("exchange.joints", "", what, "state a larger --gap, or the unit with --unit")
    return draft, assembly, parts


def _solids(assembly: Assembly, link: Occurrence, draft: Draft) -> list[Entry]:
    """The solids of a link with the parts that they belong to and their places in the whole."""
    solids = []
    for leaf in link.parts():
        solids_here, surfaces = assembly.solids(leaf.definition)
        solids += [(leaf, solid, leaf.place @ place) for solid, place in solids_here]
        if surfaces or not (solids_here or leaf.children):
            draft.lose("surfaces and meshes" if surfaces else "parts without a solid", leaf.name or "part")
    return solids


def _body(assembly: Assembly, name: str, entries: Sequence[Entry], options: ImportOptions, draft: Draft) -> Body:
    """A link of solids: mass, centre and inertia in the global frame."""
    body, total = Body(name), np.zeros((4, 4))
    for leaf, solid, place in entries:
        density, material = assembly.density(leaf.definition)
        origin = "of the file"
        if density is None and material.lower() in MATERIALS:
            density, origin = MATERIALS[material.lower()], f"of {material}"
        elif density is None:
            density, origin = options.density, "of the import"
            if material:
                what = f"is of {material!r}, whose density the file does not state: {density:g} kg/m³ is taken"
                draft.warn("exchange.material", f"links.{name}", what, "state it with --material or --density")
        moments, how = solid.moments, "exact by its faces"
        if solid.doubts:
            moments, how = _meshed(assembly.file, solid)
            doubts = "; ".join(dict.fromkeys(solid.doubts))
            what = f"has a solid (#{solid.number}) that is not integrated by its faces: {doubts}; its mass is {how}"
            draft.warn("exchange.mesh", f"links.{name}", what, "compare it with that of the CAD program")
        total = total + density * moved(moments, place)
        body.comments.append(f"{leaf.name or name}, solid #{solid.number}: {density:g} kg/m³ {origin}, {how}")
    if total[0, 0] > 0:
        body.mass, body.centre, body.inertia = mass_of(total)
    return body


def _placed(face: Face, place: Place, tolerances: Mapping[int, str | tuple[float, float]]) -> Face:
    """A face of a part in the global frame, with the tolerance that the file states of it."""
    scale = abs(float(np.linalg.det(place.matrix))) ** (1 / 3)
    frame, outline = face.frame @ place.matrix.T / scale, face.outline @ place.matrix.T + place.shift
    made = replace(face, frame=frame, origin=place.at(face.origin), outline=outline)
    made.radius, made.area, made.tolerance = scale * face.radius, scale**2 * face.area, tolerances.get(face.number, "")
    return made


# ---- solids with free-form faces ------------------------------------------------------------------------------

_MESH = """
import io, json, sys
import cascadio, numpy as np, trimesh
raw = open(sys.argv[1], "rb").read()
for part in (1.0, 0.25):
    glb = cascadio.load(raw, tol_linear=part * float(sys.argv[2]), tol_angular=0.2 * part, use_parallel=False)
    scene = trimesh.load(io.BytesIO(glb), file_type="glb")
    corners = np.vstack([mesh.triangles for mesh in scene.dump()])
    volumes = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    sums = corners.sum(axis=1)
    second = np.einsum("i,ij,ik->jk", volumes, sums, sums) + np.einsum("i,icj,ick->jk", volumes, corners, corners)
    print(json.dumps([volumes.sum(), (volumes @ sums / 4).tolist(), (second / 20).tolist()]))
"""


def _meshed(file: Part21, solid: Solid) -> tuple[Array, str]:
    """The moments of a solid by two meshes of OpenCASCADE, and how far they agree.

    In a process of its own, for a foreign library that reads foreign files may hang or crash.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "solid.step"
        path.write_text(_alone(file, solid.number), encoding="utf-8")
        command = [sys.executable, "-c", _MESH, str(path), str(DEFLECTION)]
        try:
            done = subprocess.run(command, capture_output=True, timeout=PATIENCE, check=True)
            coarse, fine = (
                moments_of(volume, np.array(first), np.array(second))
                for volume, first, second in map(json.loads, done.stdout.splitlines()[-2:])
            )
        except (subprocess.SubprocessError, ValueError):
            return np.zeros((4, 4)), "not found: it needs the extra 'cad', or has no mesh within a minute"
    if not fine[0, 0] > 0:
        return np.zeros((4, 4)), "not found: its mesh encloses no volume"
    return fine, f"by a mesh, to about {abs(coarse[0, 0] / fine[0, 0] - 1) / 3:.1g}"


def _alone(file: Part21, number: int) -> str:
    """The text of a STEP file with one solid of another."""
    shape = next(
        shape
        for kind in ("ADVANCED_BREP_SHAPE_REPRESENTATION", "SHAPE_REPRESENTATION", "FACETED_BREP_SHAPE_REPRESENTATION")
        for shape in file.of(kind)
        if number in file.references(shape)
    )
    context = file[shape][file.kind(shape)][2]
    needed, queue = {number, int(context)}, [number, int(context)]
    while queue:
        new = file.references(queue.pop()) - needed
        needed |= new
        queue += new
    text = _Text(max(file.spans) + 1)
    text.lines = [f"#{entity}={file.text[slice(*file.spans[entity])]};" for entity in sorted(needed)]
    text.product("solid", [number], "ADVANCED_BREP_SHAPE_REPRESENTATION", int(context))
    return text.text()


# ---- writing --------------------------------------------------------------------------------------------------


class _Text:
    """Entities of a STEP file that is written: each call adds one and returns its number."""

    def __init__(self, first: int = 1) -> None:
        self.next, self.lines = first, list[str]()

    def __call__(self, text: str) -> int:
        self.lines.append(f"#{self.next}={text};")
        self.next += 1
        return self.next - 1

    def point(self, place: Array) -> int:
        """A CARTESIAN_POINT, in mm."""
        return self(f"CARTESIAN_POINT('',({_reals(1e3 * place)}))")

    def placement(self, place: Place, unit: float = 1e-3) -> int:
        """An AXIS2_PLACEMENT_3D in a unit of length."""
        point = self(f"CARTESIAN_POINT('',({_reals(place.shift / unit)}))")
        z, x = (self(f"DIRECTION('',({_reals(place.matrix[:, column])}))") for column in (2, 0))
        return self(f"AXIS2_PLACEMENT_3D('',#{point},#{z},#{x})")

    def product(self, name: str, items: Sequence[int], kind: str, context: int) -> tuple[int, int]:
        """A product with a representation of items: the numbers of its definition and its representation."""
        application = self("APPLICATION_CONTEXT('automotive design')")
        scope = self(f"PRODUCT_CONTEXT('',#{application},'mechanical')")
        product = self(f"PRODUCT({quoted(name)},{quoted(name)},'',(#{scope}))")
        formation = self(f"PRODUCT_DEFINITION_FORMATION('','',#{product})")
        stage = self(f"PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')")
        definition = self(f"PRODUCT_DEFINITION('design','',#{formation},#{stage})")
        shape = self(f"PRODUCT_DEFINITION_SHAPE('','',#{definition})")
        representation = self(f"{kind}({quoted(name)},({_numbers(items)}),#{context})")
        self(f"SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})")
        return definition, representation

    def context(self) -> int:
        """A context of mm and rad."""
        length = self("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
        angle = self("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
        solid = self("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
        close = self(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),#{length},'distance_accuracy_value','')")
        return self(
            f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{close}))"
            f"GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{solid}))REPRESENTATION_CONTEXT('','3D'))"
        )

    def text(self) -> str:
        """The text of the file."""
        header = (
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'Trunnion','','');\n"
            "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n"
        )
        return header + "\n".join(self.lines) + "\nENDSEC;\nEND-ISO-10303-21;\n"


def _reals(values: Array) -> str:
    return ",".join(f"{float(value) + 0.0:.16E}" for value in values)


def _numbers(items: Sequence[int]) -> str:
    return ",".join(f"#{item}" for item in items)


def write(positions: Positions, path: Path) -> list[Finding]:
    """Write the skeleton of a mechanism at a position: points, axes and lines of its links."""
    draft = positions.draft()
    text = _Text()
    context = text.context()
    size = float(np.ptp([pair.at for pair in draft.pairs.values()], axis=0).max()) or 1.0
    parts = []
    for name, body in draft.bodies.items():
        place = Place(positions.rotations[name][0], positions.origins[name][0])
        origin = text.placement(Place())
        drawn = text.placement(place)
        wires = _wires(text, draft, body, place.inverse, size)
        kind = "GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION"
        parts.append((name, *text.product(name, [origin, wires], kind, context), origin, drawn))
    placements = [drawn for *_, drawn in parts]
    root = text.product(draft.name or "mechanism", placements, "SHAPE_REPRESENTATION", context)
    for name, definition, representation, origin, drawn in parts:
        use = text(f"NEXT_ASSEMBLY_USAGE_OCCURRENCE({quoted(name)},{quoted(name)},'',#{root[0]},#{definition},$)")
        shape = text(f"PRODUCT_DEFINITION_SHAPE('','',#{use})")
        shifted = text(f"ITEM_DEFINED_TRANSFORMATION('','',#{origin},#{drawn})")
        relation = text(_relation(representation, root[1], shifted))
        text(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{relation},#{shape})")
    path.write_text(text.text(), encoding="ascii")
    draft.note("exchange.skeleton", "", "points, axes and lines are written, without masses, joints and friction")
    return draft.findings


def _relation(first: int, second: int, operator: int) -> str:
    return (
        f"(REPRESENTATION_RELATIONSHIP('','',#{first},#{second})"
        f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{operator})SHAPE_REPRESENTATION_RELATIONSHIP())"
    )


def _wires(text: _Text, draft: Draft, body: Body, inside: Place, size: float) -> int:
    """A link as its points, the lines between them and the axes of its joints, in its own frame."""
    places = {pair.name: pair.element(body.name)[0] for pair in draft.pairs_of(body.name)} | body.points
    local = {name: inside.at(place) for name, place in places.items()}
    points = [text(f"CARTESIAN_POINT({quoted(name)},({_reals(1e3 * place)}))") for name, place in local.items()]
    ring = [*local, *([next(iter(local))] if len(local) > 2 else [])]
    lines = [(f"{a}-{b}", local[a], local[b]) for a, b in pairwise(ring)]
    for pair in draft.pairs_of(body.name):
        axis = pair.element(body.name)[1]
        half = inside.matrix @ axis / np.linalg.norm(axis) * (pair.length or SIZE * size) / 2
        if pair.type != "spherical":
            lines.append((f"axis {pair.name}", local[pair.name] - half, local[pair.name] + half))
    curves = [
        text(f"POLYLINE({quoted(name)},({_numbers([text.point(start), text.point(end)])}))")
        for name, start, end in lines
        if np.linalg.norm(end - start) > 0
    ]
    return text(f"GEOMETRIC_CURVE_SET({quoted(body.name)},({_numbers(points + curves)}))")


def write_moved(positions: Positions, path: Path, original: Path) -> list[Finding]:
    """Write the file that a model was imported from, with the parts of its links where they are at a position."""
    with faults_of(original):
        draft, assembly, parts = _drafted(Part21(original), ImportOptions(ground=positions.mechanism.fixed_link))
    file = assembly.file
    turn = _model_frame(positions, draft)
    changes: dict[int, str] = {}
    text = _Text(max(file.spans) + 1)
    leader = draft.leaders()
    links = {leader[link]: link for link in positions.mechanism.effective_links if link in leader}
    for name, part in parts.items():
        link = links.get(leader[name], "") if name in leader else ""
        if not link:
            what = f"is a part of {original.name!r} and no link of the model"
            remedy = "--from takes what the usual --gap and --unit read; import it with these"
            raise MechanismError(Finding(what, f"links.{name}", remedy))
        rotation, origin = positions.rotations[link][0], positions.origins[link][0]
        if not np.isfinite(rotation).all():
            what = f"has no solution at {positions.drive(0)}"
            raise MechanismError(Finding(what, "--at", "choose another position; `trunnion analyse` says why"))
        move = Place(turn.T @ rotation @ turn, turn.T @ origin)
        if part.relation:
            _move(assembly, part, move, text, changes)
        elif np.abs(move.matrix - np.eye(3)).max() > FIT or np.abs(move.shift).max() > FIT:
            what = f"has no placement of its own in {original.name!r}"
            raise MechanismError(Finding(what, f"links.{name}", "export the parts from CAD as an assembly"))
    changed = file.text
    for number in sorted(changes, key=lambda number: -file.spans[number][0]):  # from the end: earlier places stay
        start, end = file.spans[number]
        changed = changed[:start] + changes[number] + changed[end:]
    data, _, rest = changed.rpartition("ENDSEC")
    added = "\n".join(text.lines)
    path.write_text(f"{data}{added}\nENDSEC{rest}", encoding="utf-8")
    return []


def _move(assembly: Assembly, part: Occurrence, move: Place, text: _Text, changes: dict[int, str]) -> None:
    """Write a new placement of a part, and change the relation that states it."""
    file = assembly.file
    entity = file[part.relation]
    operator = entity["REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION"][0]
    first, second = entity["REPRESENTATION_RELATIONSHIP"][2:4]
    inner = part.parent.inverse @ move @ part.place  # the part's new place in its parent
    if not part.forward:
        inner = inner.inverse
    if file.kind(operator) != "ITEM_DEFINED_TRANSFORMATION":
        what = f"places {part.name!r} by an operator, which is not rewritten"
        raise refused(what, remedy="export it again as AP214")
    start = file[operator]["ITEM_DEFINED_TRANSFORMATION"][2]
    end = text.placement(inner @ assembly.frame(start, first), assembly.geometry(second).length)
    new = text(f"ITEM_DEFINED_TRANSFORMATION('','',#{start},#{end})")
    changes[part.relation] = _relation(first, second, new)


def _model_frame(positions: Positions, draft: Draft) -> Array:
    """The rotation from the file to the model; MechanismError if the model's links do not have the file's points.

    The model's links must have the file's frame, as the import wrote them: only then is their motion that of the parts.
    """
    spatial = positions.mechanism.space == "spatial"
    drawn = complete(draft, positions.mechanism.fixed_link if positions.mechanism.fixed_link in draft.bodies else "")
    normal = None if spatial else drawn.plane_normal()
    turn = np.eye(3) if normal is None else flat_frame(normal)
    values: Any = positions.mechanism.parameters()
    size = max((float(np.linalg.norm(pair.at)) for pair in drawn.pairs.values()), default=1.0)
    for pair in drawn.pairs.values():
        for link in pair.links:
            for axis, place in zip("xyz" if spatial else "xy", turn @ pair.at, strict=False):
                value = values.get(f"links.{link}.points.{pair.name}.{axis}")
                value = values.get(f"links.{link}.points.{pair.name}.at.{axis}") if value is None else value
                if value is None or abs(float(np.ravel(value)[0]) - place) > FIT * size:
                    what = f"has other points than the file it is to move: {pair.name}"
                    raise MechanismError(Finding(what, f"links.{link}", "import the file again, and keep its points"))
    return turn
