"""Products of a STEP file: names, units, densities, and where the parts of an assembly lie."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from trunnion.exchange.brep import Geometry, Part21, Ref, Solid
from trunnion.exchange.draft import Place, few, refused

MOST = 2000  # occurrences of parts
PREFIXES = {"KILO": 1e3, "DECI": 0.1, "CENTI": 1e-2, "MILLI": 1e-3, "MICRO": 1e-6, "NANO": 1e-9, None: 1.0}
SOLIDS = ("MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS", "FACETED_BREP")
SURFACES = ("SHELL_BASED_SURFACE_MODEL", "TESSELLATED_SOLID", "TESSELLATED_SHELL", "GEOMETRIC_SET")


@dataclass
class Occurrence:
    """A use of a product in an assembly: its own name, its place in the whole, and the parts in it.

    relation: the entity that holds its placement in its parent; 0 if it has none; forward: whether from it to the
    parent. parent: place of the parent.
    """

    name: str
    definition: int
    place: Place
    relation: int = 0
    forward: bool = True
    parent: Place = field(default_factory=Place)
    children: list[Occurrence] = field(default_factory=list)

    def parts(self) -> Iterator[Occurrence]:
        """It and all that is in it."""
        yield self
        for child in self.children:
            yield from child.parts()


class Assembly:
    """Products, their representations and uses.

    Parameters
    ----------
    file : the STEP file.
    unit : length unit of representations that state none, m.

    `missing` says whether a unit was missing.
    """

    def __init__(self, file: Part21, unit: float) -> None:
        self.file, self.unit, self.missing = file, unit, False
        self._geometries: dict[int, Geometry] = {}
        self._solids: dict[int, tuple[list[tuple[Solid, Place]], int]] = {}
        self.shapes: dict[int, list[int]] = defaultdict(list)  # representations by product definition
        shape_of = {shape: file[shape]["PRODUCT_DEFINITION_SHAPE"][2] for shape in file.of("PRODUCT_DEFINITION_SHAPE")}
        for relation in file.of("SHAPE_DEFINITION_REPRESENTATION"):
            shape, representation = file.args(relation, "SHAPE_DEFINITION_REPRESENTATION")[:2]
            if shape in shape_of:
                self.shapes[shape_of[shape]].append(representation)
        # representations that a relation without a transformation makes one belong to the same product
        equal: dict[int, set[int]] = defaultdict(set)
        for kind in ("SHAPE_REPRESENTATION_RELATIONSHIP", "REPRESENTATION_RELATIONSHIP"):
            for number in file.of(kind):
                entity = file[number]
                if "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION" not in entity and len(entity[kind]) == 4:
                    first, other = entity[kind][2:]
                    equal[first].add(other)
                    equal[other].add(first)
        for shapes in self.shapes.values():
            for shape in shapes:  # grows while it runs
                shapes += sorted(equal[shape] - set(shapes))
        self.places = {}  # of a use: the relation that holds it
        for placed in file.of("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION"):
            relation, shape = file.args(placed, "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION")[:2]
            self.places[shape_of.get(shape)] = relation
        self.uses: dict[int, list[tuple[int, int]]] = defaultdict(list)  # (use, child) by parent
        for use in file.of("NEXT_ASSEMBLY_USAGE_OCCURRENCE"):
            parent, child = file.args(use, "NEXT_ASSEMBLY_USAGE_OCCURRENCE")[3:5]
            self.uses[parent].append((use, child))

    def name(self, definition: int) -> str:
        """Name of a product."""
        formation = self.file[definition][self.file.kind(definition)][2]
        product = self.file[formation][self.file.kind(formation)][2]
        identity, name = self.file.args(product, "PRODUCT")[:2]
        return str(name or identity or "")

    def tree(self) -> list[Occurrence]:
        """The products that no other uses, with all that they use."""
        used = {child for uses in self.uses.values() for _, child in uses}
        every = dict.fromkeys([*self.shapes, *self.uses])
        roots = [root for root in every if root not in used]
        count, visited = 0, set[int]()

        def expanded(occurrence: Occurrence, above: tuple[int, ...]) -> Occurrence:
            nonlocal count
            count += 1
            visited.add(occurrence.definition)
            few(count, MOST, "parts")
            if occurrence.definition in above:
                raise refused(f"has the product {occurrence.name!r} inside itself")
            for index, (use, child) in enumerate(self.uses.get(occurrence.definition, [])):
                inner, relation, forward = self._placed(use, occurrence.definition, child, index)
                place = occurrence.place @ inner
                part = Occurrence(self.name(child), child, place, relation, forward, occurrence.place)
                occurrence.children.append(expanded(part, (*above, occurrence.definition)))
            return occurrence

        tree = [expanded(Occurrence(self.name(root), root, Place()), ()) for root in roots if self.is_product(root)]
        for left in (number for number in every if number not in visited and self.is_product(number)):
            raise refused(f"has the product {self.name(left)!r} inside itself")
        return tree

    def is_product(self, definition: Any) -> bool:
        """Whether a shape belongs to a product, not to a feature of it."""
        return isinstance(definition, Ref) and self.file.kind(definition).startswith("PRODUCT_DEFINITION")

    def _placed(self, use: int, parent: int, child: int, index: int) -> tuple[Place, int, bool]:
        """Place of a use in its parent, the relation that states it, and whether that runs from the child."""
        relation = self.places.get(use)
        if relation is None:  # as a mapped item of the parent's shape
            mapped = [
                place
                for shape in self.shapes.get(parent, [])
                for item in self.items(shape, "MAPPED_ITEM")
                for place, source in [self._mapped(item, shape)]
                if source in self.shapes.get(child, [])
            ]
            same = [use for use, other in self.uses[parent][:index] if other == child]
            if len(same) < len(mapped):
                return mapped[len(same)], 0, True
            raise refused(f"does not say where {self.name(child)!r} lies in {self.name(parent)!r}")
        entity = self.file[relation]
        operator = entity["REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION"][0]
        first, second = entity["REPRESENTATION_RELATIONSHIP"][2:4]
        forward = first in self.shapes.get(child, []) or second in self.shapes.get(parent, [])
        if self.file.kind(operator) == "ITEM_DEFINED_TRANSFORMATION":
            start, end = self.file[operator]["ITEM_DEFINED_TRANSFORMATION"][2:4]
            place = self.frame(end, second) @ self.frame(start, first).inverse
        else:
            place = self.frame(operator, second)
        return (place if forward else place.inverse), relation, forward

    def _mapped(self, item: int, shape: int) -> tuple[Place, int]:
        """Place and representation of a mapped item of a shape."""
        source, target = self.file.args(item, "MAPPED_ITEM")[1:3]
        origin, representation = self.file.args(source, "REPRESENTATION_MAP")[:2]
        return self.frame(target, shape) @ self.frame(origin, representation).inverse, representation

    def frame(self, item: Any, shape: int) -> Place:
        """A placement or transformation of a representation, in its units."""
        geometry, kind = self.geometry(shape), self.file.kind(item)
        if kind == "AXIS2_PLACEMENT_3D":
            frame, origin = geometry.placement(item)
            return Place(frame.T, origin)
        entity = self.file[item]
        if "CARTESIAN_TRANSFORMATION_OPERATOR" not in entity:
            args = self.file.args(item, "CARTESIAN_TRANSFORMATION_OPERATOR_3D")
            first, second, origin, scale, third = args[-5:]
        else:
            first, second, origin, scale = entity["CARTESIAN_TRANSFORMATION_OPERATOR"][-4:]
            third = entity["CARTESIAN_TRANSFORMATION_OPERATOR_3D"][0]
        x = np.array([1.0, 0, 0]) if first is None else geometry.direction(first)
        y = np.array([0, 1.0, 0]) if second is None else geometry.direction(second)
        z = np.cross(x, y) if third is None else geometry.direction(third)
        return Place(float(scale or 1.0) * np.column_stack([x, y, z]), geometry.point(origin))

    def items(self, shape: int, *kinds: str) -> list[int]:
        """Items of a representation that are of some kinds."""
        items = self.file[shape][self.file.kind(shape)][1] or []
        return [item for item in items if isinstance(item, Ref) and any(kind in self.file[item] for kind in kinds)]

    def geometry(self, shape: int) -> Geometry:
        """The geometry of a representation in its units."""
        context = self.file[shape][self.file.kind(shape)][2]
        if context not in self._geometries:
            entity = self.file[context] if isinstance(context, Ref) else {}
            length, angle = None, 1.0
            for unit in entity.get("GLOBAL_UNIT_ASSIGNED_CONTEXT", [[]])[0]:
                if "LENGTH_UNIT" in self.file[unit]:
                    length = self.size(unit)
                elif "PLANE_ANGLE_UNIT" in self.file[unit]:
                    angle = self.size(unit)
            self.missing |= length is None
            self._geometries[context] = Geometry(self.file, self.unit if length is None else length, angle)
        return self._geometries[context]

    def size(self, unit: Any) -> float:
        """A unit in SI."""
        entity = self.file[unit]
        if "SI_UNIT" in entity:
            prefix, name = entity["SI_UNIT"][-2:]
            if prefix not in PREFIXES:
                raise refused(f"has the unit {prefix} {name}, which is not read")
            return PREFIXES[prefix] * (1e-3 if name == "GRAM" else 1.0)
        source = self.file[entity["CONVERSION_BASED_UNIT"][1]] if "CONVERSION_BASED_UNIT" in entity else entity
        for args in source.values():
            if args and isinstance(args[0], tuple):
                return float(args[0][1][0]) * self.size(args[1])
        raise refused(f"has a unit at #{unit} that is not read")

    def solids(self, definition: int) -> tuple[list[tuple[Solid, Place]], int]:
        """The solids of a product in its frame, and the number of its surface bodies and meshes."""
        if definition not in self._solids:
            solids: list[tuple[Solid, Place]] = []
            surfaces = 0
            others = {shape for child, shapes in self.shapes.items() if child != definition for shape in shapes}
            still = Place()
            queue = [(shape, still) for shape in self.shapes.get(definition, [])]
            listed = set()  # equal representations may both list a solid
            for shape, place in queue:  # grows while it runs
                geometry = self.geometry(shape)
                new = [item for item in self.items(shape, *SOLIDS) if (item, id(place)) not in listed]
                listed |= {(item, id(place)) for item in new}
                solids += [(geometry.solid(item), place) for item in new]
                surfaces += len(self.items(shape, *SURFACES))
                for item in self.items(shape, "MAPPED_ITEM"):
                    inner, source = self._mapped(item, shape)
                    if source not in others and len(queue) < MOST:
                        queue.append((source, place @ inner))
            self._solids[definition] = solids, surfaces
        return self._solids[definition]

    def tolerances(self) -> dict[int, str | tuple[float, float]]:
        """Tolerances of diameters that the file states, by the number of the face: a class such as H7, or limits, m."""
        aspects = {}
        for entity in self.file.of("PLUS_MINUS_TOLERANCE"):
            limits, dimension = self.file.args(entity, "PLUS_MINUS_TOLERANCE")[:2]
            if "DIMENSIONAL_SIZE" in self.file[dimension]:
                aspects[self.file[dimension]["DIMENSIONAL_SIZE"][0]] = self._limits(limits)
        faces = {}
        for entity in self.file.of("GEOMETRIC_ITEM_SPECIFIC_USAGE"):
            _, _, aspect, _, item = self.file.args(entity, "GEOMETRIC_ITEM_SPECIFIC_USAGE")
            if aspect in aspects and isinstance(item, Ref):
                faces[int(item)] = aspects[aspect]
        return faces

    def _limits(self, number: Any) -> str | tuple[float, float]:
        """Limits of a dimension: a class of ISO 286, or its lower and upper deviation, m."""
        entity = self.file[number]
        if "LIMITS_AND_FITS" in entity:
            letter, _, grade = entity["LIMITS_AND_FITS"][:3]
            return f"{letter}{grade}"
        ends = []
        for bound in self.file.args(number, "TOLERANCE_VALUE"):
            for args in self.file[bound].values():
                measure = next((part for part in args if isinstance(part, tuple)), None)
                if measure is not None:
                    ends.append(float(measure[1][0]) * self.size(args[-1]))
        return (min(ends), max(ends)) if len(ends) == 2 else ""

    def density(self, definition: int) -> tuple[float | None, str]:
        """Density of a product, kg/m³, and the name of its material, as far as the file has them."""
        file, density, material = self.file, None, ""
        for relation in file.of("PROPERTY_DEFINITION_REPRESENTATION"):
            definition_of, representation = file.args(relation, "PROPERTY_DEFINITION_REPRESENTATION")[:2]
            owner = file[definition_of].get("PROPERTY_DEFINITION", [None] * 3)
            if owner[2] != definition:
                continue
            for item in file[representation][file.kind(representation)][1]:
                entity = file[item]
                if "DESCRIPTIVE_REPRESENTATION_ITEM" in entity and "material" in str(owner[0]).lower():
                    label, text = entity["DESCRIPTIVE_REPRESENTATION_ITEM"]
                    material = str(label or text)
                label = str(owner[1]) + str(next(iter(entity.values()))[0])
                if "density" in label.lower():
                    measure = next((args for args in entity.values() if isinstance(args[-2:][0], tuple)), None)
                    if measure is not None:
                        density = float(measure[-2][1][0])
                        for element in file.args(measure[-1], "DERIVED_UNIT")[0]:
                            base, exponent = file.args(element, "DERIVED_UNIT_ELEMENT")
                            density *= self.size(base) ** float(exponent)
        return density, material
