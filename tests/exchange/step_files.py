"""STEP files of parts and assemblies for the tests, written as text, with moments in closed form beside them.

A `Shape` is a prism with features on its flat faces (pins, holes) or a turned part. Profiles of features and turned
parts are walked in (r, z) with the material on the left. Lengths are in the unit of the file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

UNITS = {"mm": 1e-3, "in": 25.4e-3, "m": 1.0}


def frame_of(axis, x=None):
    """Rows x, y, z of a right-handed frame with z along an axis."""
    z = np.array(axis, float) / np.linalg.norm(axis)
    base = np.eye(3)[int(np.argmin(abs(z)))] if x is None else np.array(x, float)
    x = base - (base @ z) * z
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])


def turn(axis, angle):
    """Rotation matrix about an axis."""
    return Rotation.from_rotvec(angle * np.array(axis, float) / np.linalg.norm(axis)).as_matrix()


@dataclass
class Shape:
    """A solid: its faces as written, and (volume, first, second moment) in closed form."""

    faces: list = field(default_factory=list)
    volume: float = 0.0
    first: np.ndarray = field(default_factory=lambda: np.zeros(3))
    second: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    split: str = "seam"
    planes: dict = field(default_factory=dict)

    def gain(self, volume, first, second):
        self.volume += volume
        self.first = self.first + first
        self.second = self.second + second

    def moments(self, scale=1e-3, density=7850.0):
        """Mass, centre and inertia about it, SI."""
        centre = self.first / self.volume
        about = self.second - self.volume * np.outer(centre, centre)
        inertia = np.trace(about) * np.eye(3) - about
        return density * self.volume * scale**3, centre * scale, density * inertia * scale**5

    def feature(self, face, point, profile, leaves=None):
        """Add a pin or hole at a point of a flat face: a profile (r, z) from the face, z along its outer normal.

        It ends on the axis, or on the face `leaves`. A third entry of a profile point is the centre (r, z) of the arc
        that leads to it.
        """
        normal = self.planes[face]["surface"][2]
        self.planes[face]["loops"].append([_circle(np.array(point, float), normal, *profile[0][:2], -1)])
        if leaves is not None:
            self.planes[leaves]["loops"].append([_circle(np.array(point, float), normal, *profile[-1][:2], 1)])
        revolve(self, np.array(point, float), normal, profile)
        return self

    def placed(self, matrix, shift):
        """The same shape elsewhere; a matrix of determinant -1 mirrors it."""
        matrix, shift = np.array(matrix, float), np.array(shift, float)
        mirrored = np.linalg.det(matrix) < 0

        def edge(item):
            if item[0] == "line":
                ends = matrix @ item[1] + shift, matrix @ item[2] + shift
                return ("line", *(ends[::-1] if mirrored else ends))
            kind, centre, axis, radius, *ends = item
            ends = [matrix @ end + shift for end in (ends[::-1] if mirrored else ends)]
            return (kind, matrix @ centre + shift, matrix @ axis, radius, *ends)

        result = Shape(split=self.split)
        for face in self.faces:
            kind, origin, axis, *sizes = face["surface"]
            loops = [[edge(item) for item in (loop[::-1] if mirrored else loop)] for loop in face["loops"]]
            surface = (kind, matrix @ origin + shift, matrix @ axis, *sizes)
            result.faces.append({"surface": surface, "sense": face["sense"], "loops": loops})
        first = matrix @ self.first
        cross = np.outer(first, shift)
        result.volume, result.first = self.volume, first + self.volume * shift
        second = matrix @ self.second @ matrix.T
        result.second = second + cross + cross.T + self.volume * np.outer(shift, shift)
        return result


def prism(polygon, low, high, split="seam"):
    """A polygon in x, y, counter-clockwise, extruded along z; faces: bottom, top and the number of a side."""
    shape = Shape(split=split)
    bottom = [np.array([x, y, low], float) for x, y in polygon]
    top = [np.array([x, y, high], float) for x, y in polygon]

    def flat(name, points):
        normal = sum(np.cross(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True))
        loop = [("line", a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
        surface = ("PLANE", points[0], normal / np.linalg.norm(normal))
        shape.planes[name] = {"surface": surface, "sense": True, "loops": [loop]}
        shape.faces.append(shape.planes[name])

    flat("bottom", bottom[::-1])
    flat("top", top)
    for i in range(len(polygon)):
        j = (i + 1) % len(polygon)
        flat(i, [bottom[i], bottom[j], top[j], top[i]])
    a = np.array(polygon, float)
    b = np.roll(a, -1, axis=0)
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area, plane_first = cross.sum() / 2, cross @ (a + b) / 6
    plane_second = ((cross * (a + b).T) @ (a + b) + (cross * a.T) @ a + (cross * b.T) @ b) / 24
    z1, z2, z3 = high - low, (high**2 - low**2) / 2, (high**3 - low**3) / 3
    second = np.zeros((3, 3))
    second[:2, :2] = plane_second * z1
    second[:2, 2] = second[2, :2] = plane_first * z2
    second[2, 2] = area * z3
    shape.gain(area * z1, np.array([*plane_first * z1, area * z2]), second)
    return shape


def box(low, high, split="seam"):
    """A block; sides 0 to 3 face -y, +x, +y, -x."""
    (a, b, c), (d, e, f) = low, high
    return prism([(a, b), (d, b), (d, e), (a, e)], c, f, split)


def turned(profile, axis=(0, 0, 1), origin=(0, 0, 0), split="seam"):
    """A solid of revolution."""
    shape = Shape(split=split)
    revolve(shape, np.array(origin, float), np.array(axis, float) / np.linalg.norm(axis), profile)
    return shape


def revolve(shape, origin, axis, profile):
    """Add the faces and moments of a profile [(r, z), (r, z, centre of the arc before it), …] about an axis."""
    frame = frame_of(axis)
    for (r1, z1, *_), (r2, z2, *arc) in pairwise(profile):
        centre = arc[0] if arc else None
        shape.faces += _swept(shape.split, origin, frame, (r1, z1), (r2, z2), centre)
        if z1 == z2 and not arc:
            continue
        if arc:
            s1, s2 = (math.atan2(z - centre[1], r - centre[0]) for r, z in ((r1, z1), (r2, z2)))
            s2 = s1 + (s2 - s1 + math.pi) % (2 * math.pi) - math.pi
            size = math.hypot(r1 - centre[0], z1 - centre[1])

            def course(t, s1=s1, s2=s2, size=size, centre=centre):
                s = s1 + t * (s2 - s1)
                return centre[0] + size * math.cos(s), centre[1] + size * math.sin(s), size * math.cos(s) * (s2 - s1)
        else:

            def course(t, a=(r1, z1), b=(r2, z2)):
                return a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), b[1] - a[1]

        def power(k, m, course=course):
            def integrand(t):
                r, z, dz = course(t)
                return math.pi * r**k * z**m * dz

            return quad(integrand, 0, 1, epsabs=0, epsrel=1e-13)[0]

        volume, level, high, across = power(2, 0), power(2, 1), power(2, 2), power(4, 0) / 4
        first = volume * origin + level * axis
        own = frame.T @ np.diag([across, across, high]) @ frame
        cross = level * np.outer(origin, axis)
        shape.gain(volume, first, own + cross + cross.T + volume * np.outer(origin, origin))


def _swept(split, origin, frame, start, end, centre):
    """Faces of a piece of a profile: its circle at the start runs about the axis, that at the end against it."""
    axis = frame[2]
    (r1, z1), (r2, z2) = start, end

    def at(r, z, angle=0.0):
        return origin + z * axis + r * (math.cos(angle) * frame[0] + math.sin(angle) * frame[1])

    if centre is not None:
        size = math.hypot(r1 - centre[0], z1 - centre[1])
        kind = "SPHERICAL_SURFACE" if centre[0] == 0 else "TOROIDAL_SURFACE"
        sizes = (size,) if centre[0] == 0 else (centre[0], size)
        surface = (kind, origin + centre[1] * axis, axis, *sizes)
        middle = ((r1 + r2) / 2 - centre[0], (z1 + z2) / 2 - centre[1])
        sense = middle[0] * (z2 - z1) - middle[1] * (r2 - r1) > 0
    elif z1 == z2:
        surface, sense = ("PLANE", at(0, z1), axis * (-1 if r2 > r1 else 1)), True
    elif r1 == r2:
        surface, sense = ("CYLINDRICAL_SURFACE", at(0, z1), axis, r1), z2 > z1
    else:
        low, growth = ((r1, z1), (z2 - z1) / (r2 - r1)) if r1 > 0 else ((r2, z2), (z2 - z1) / (r2 - r1))
        angle = math.atan(1 / abs(growth))
        surface, sense = ("CONICAL_SURFACE", at(0, low[1]), axis * np.sign(growth), low[0], angle), z2 > z1

    def meridian(angle, up):
        ends = [at(r1, z1, angle), at(r2, z2, angle)]
        ends = ends if up else ends[::-1]
        if centre is None:
            return ("line", *ends)
        across = -math.sin(angle) * frame[0] + math.cos(angle) * frame[1]
        turns = (r1 - centre[0]) * (z2 - centre[1]) - (z1 - centre[1]) * (r2 - centre[0])
        normal = -across if (turns > 0) == up else across  # e_r turns to z about -e_u
        return ("arc", at(centre[0], centre[1], angle), normal, math.hypot(r1 - centre[0], z1 - centre[1]), *ends)

    if split == "none" or (z1 == z2 and centre is None):
        circles = [_circle(origin, axis, r, z, s) for r, z, s in ((r1, z1, 1), (r2, z2, -1)) if r > 0]
        return [{"surface": surface, "sense": sense, "loops": [[circle] for circle in circles]}]
    if split == "seam":
        loop = [_circle(origin, axis, r1, z1, 1)] if r1 > 0 else []
        loop += [meridian(0.0, True)]
        loop += [_circle(origin, axis, r2, z2, -1)] if r2 > 0 else []
        loop += [meridian(0.0, False)]
        return [{"surface": surface, "sense": sense, "loops": [loop]}]
    faces = []
    for a in (0.0, math.pi):
        b = a + math.pi
        loop = [("arc", at(0, z1), axis, r1, at(r1, z1, a), at(r1, z1, b))] if r1 > 0 else []
        loop += [meridian(b, True)]
        loop += [("arc", at(0, z2), -axis, r2, at(r2, z2, b), at(r2, z2, a))] if r2 > 0 else []
        loop += [meridian(a, False)]
        faces.append({"surface": surface, "sense": sense, "loops": [loop]})
    return faces


class StepFile:
    """Lines of a STEP file; `part` and `assembly` add products, `write` writes it."""

    def __init__(self, unit="mm", degrees=False, splines=False):
        self.lines, self.unit, self.splines = [], unit, splines
        self.application = self("APPLICATION_CONTEXT('automotive design')")
        self.product_context = self(f"PRODUCT_CONTEXT('',#{self.application},'mechanical')")
        self.definition_context = self(f"PRODUCT_DEFINITION_CONTEXT('part definition',#{self.application},'design')")
        metre = self("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.))")
        radian = self("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
        steradian = self("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
        length, angle = metre, radian
        if unit in ("mm", "in"):
            length = self("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
        if unit == "in":
            size = self(f"LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#{length})")
            power = self("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)")
            length = self(f"(CONVERSION_BASED_UNIT('INCH',#{size})LENGTH_UNIT()NAMED_UNIT(#{power}))")
        self.degrees = degrees
        if degrees:
            size = self(f"PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE({math.radians(1)!r}),#{radian})")
            power = self("DIMENSIONAL_EXPONENTS(0.,0.,0.,0.,0.,0.,0.)")
            angle = self(f"(CONVERSION_BASED_UNIT('DEGREE',#{size})NAMED_UNIT(#{power})PLANE_ANGLE_UNIT())")
        units = f"GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{steradian}))" if unit else ""
        closeness = self(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),#{length},'accuracy','')")
        self.context = self(
            f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{closeness})){units}"
            "REPRESENTATION_CONTEXT('','3D'))"
        )

    def __call__(self, text):
        self.lines.append(text)
        return len(self.lines)

    def vector(self, kind, values):
        return self(f"{kind}('',({','.join(_real(value) for value in values)}))")

    def placement(self, origin, axis, x=None):
        frame = frame_of(axis, x)
        at, z = self.vector("CARTESIAN_POINT", origin), self.vector("DIRECTION", frame[2])
        return self(f"AXIS2_PLACEMENT_3D('',#{at},#{z},#{self.vector('DIRECTION', frame[0])})")

    def spline_circle(self, centre, axis, start):
        """A full circle as a rational B-spline of degree 2 with nine poles."""
        x = start - centre
        y = np.cross(axis, x)
        ring = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
        poles = [self.vector("CARTESIAN_POINT", centre + a * x + b * y) for a, b in ring]
        weights = ",".join(_real(1 if n % 2 == 0 else math.sqrt(0.5)) for n in range(9))
        return self(
            f"(BOUNDED_CURVE()B_SPLINE_CURVE(2,({_list(poles)}),.UNSPECIFIED.,.T.,.F.)"
            "B_SPLINE_CURVE_WITH_KNOTS((3,2,2,2,3),(0.,0.25,0.5,0.75,1.),.UNSPECIFIED.)CURVE()"
            f"GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE(({weights}))REPRESENTATION_ITEM(''))"
        )

    def solid(self, shape, name=""):
        """Write a solid; its edges are shared by the two faces that they bound."""
        vertices, edges = {}, {}

        def vertex(point):
            key = tuple(np.round(point, 9) + 0.0)
            if key not in vertices:
                vertices[key] = self(f"VERTEX_POINT('',#{self.vector('CARTESIAN_POINT', point)})")
            return vertices[key]

        def oriented(item):
            if item[0] == "line":
                kind, start, end = item
                key, centre = ("line", *sorted([vertex(start), vertex(end)])), None
            else:
                kind, centre, axis, radius, *ends = item
                start, end = ends
                middle = centre if kind == "circle" else centre + radius * _unit(np.cross(axis, start - centre))
                if kind == "arc" and np.linalg.norm(start + end - 2 * centre) > 1e-9:
                    middle = centre + radius * _unit(start + end - 2 * centre)
                key = (kind, tuple(np.round(middle, 6) + 0.0), round(radius, 6))
            along = key not in edges
            if along:
                if kind == "line":
                    to = self.vector("DIRECTION", _unit(end - start))
                    at = self.vector("CARTESIAN_POINT", start)
                    curve = self(f"LINE('',#{at},#{self(f'VECTOR({chr(39) * 2},#{to},1.)')})")
                else:
                    place = self.placement(centre, axis, start - centre)
                    curve = self(f"CIRCLE('',#{place},{_real(radius)})")
                    if self.splines and kind == "circle":
                        curve = self(f"SURFACE_CURVE('',#{self.spline_circle(centre, axis, start)},(),.CURVE_3D.)")
                edges[key] = self(f"EDGE_CURVE('',#{vertex(start)},#{vertex(end)},#{curve},.T.)")
                edges[key, "start"] = vertex(start), None if kind == "line" else np.array(axis)
            else:
                first, about = edges[key, "start"]
                along = vertex(start) == first if kind == "line" else np.array(axis) @ about > 0
            return self(f"ORIENTED_EDGE('',*,*,#{edges[key]},.{'T' if along else 'F'}.)")

        faces = []
        for face in shape.faces:
            kind, origin, axis, *sizes = face["surface"]
            if kind == "CONICAL_SURFACE" and self.degrees:
                sizes[1] = math.degrees(sizes[1])
            bounds = []
            for number, loop in enumerate(face["loops"]):
                loop = [part for item in loop for part in _halves(item, shape.split)]
                made = self(f"EDGE_LOOP('',({','.join(f'#{oriented(item)}' for item in loop)}))")
                bounds.append(self(f"FACE_{'OUTER_' if number == 0 else ''}BOUND('',#{made},.T.)"))
            numbers = "".join(f",{_real(size)}" for size in sizes)
            surface = self(f"{kind}('',#{self.placement(origin, axis)}{numbers})")
            faces.append(self(f"ADVANCED_FACE('',({_list(bounds)}),#{surface},.{'T' if face['sense'] else 'F'}.)"))
        shell = self(f"CLOSED_SHELL('',({_list(faces)}))")
        return self(f"MANIFOLD_SOLID_BREP('{name}',#{shell})")

    def product(self, name, items, kind="ADVANCED_BREP_SHAPE_REPRESENTATION"):
        """A product with a representation of items: (definition, representation, its origin)."""
        product = self(f"PRODUCT('{name}','{name}','',(#{self.product_context}))")
        formation = self(f"PRODUCT_DEFINITION_FORMATION('','',#{product})")
        definition = self(f"PRODUCT_DEFINITION('design','',#{formation},#{self.definition_context})")
        shape = self(f"PRODUCT_DEFINITION_SHAPE('','',#{definition})")
        origin = self.placement((0, 0, 0), (0, 0, 1), (1, 0, 0))
        representation = self(f"{kind}('{name}',({_list([origin, *items])}),#{self.context})")
        self(f"SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})")
        return definition, representation, origin

    def part(self, name, *shapes):
        return self.product(name, [self.solid(shape) for shape in shapes])

    def assembly(self, name, *components, swapped=False):
        """Components: (part, rotation matrix, shift); swapped: the parent is the first of each relation."""
        places = [self.placement(shift, matrix[:, 2], matrix[:, 0]) for _, matrix, shift in components]
        parent = self.product(name, places, "SHAPE_REPRESENTATION")
        for (part, _, _), place in zip(components, places, strict=True):
            use = self(f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('{place}','','',#{parent[0]},#{part[0]},$)")
            shape = self(f"PRODUCT_DEFINITION_SHAPE('','',#{use})")
            (first, start), (second, end) = ((parent[1], place), (part[1], part[2]))[:: 1 if swapped else -1]
            moved = self(f"ITEM_DEFINED_TRANSFORMATION('','',#{start},#{end})")
            relation = self(
                f"(REPRESENTATION_RELATIONSHIP('','',#{first},#{second})"
                f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{moved})SHAPE_REPRESENTATION_RELATIONSHIP())"
            )
            self(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{relation},#{shape})")
        return parent

    @property
    def text(self):
        lines = "\n".join(f"#{number}={line};" for number, line in enumerate(self.lines, 1))
        return (
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
            f"FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\nDATA;\n{lines}\nENDSEC;\n"
            "END-ISO-10303-21;\n"
        )

    def write(self, path):
        path.write_text(self.text)
        return path


def _real(value):
    return f"{float(value):.16E}"


def _list(numbers):
    return ",".join(f"#{number}" for number in numbers)


def _unit(vector):
    return vector / np.linalg.norm(vector)


def _halves(item, split):
    """A circle as two arcs where cylinders are written in two halves."""
    if item[0] != "circle" or split != "halves":
        return [item]
    _, centre, axis, radius, start, _ = item
    far = 2 * centre - start
    return [("arc", centre, axis, radius, start, far), ("arc", centre, axis, radius, far, start)]


def _circle(origin, axis, radius, level, sign):
    """A circle about an axis, or against it, from where the seam of its cylinder is."""
    centre = origin + level * np.array(axis)
    start = centre + radius * frame_of(axis)[0]
    return ("circle", centre, sign * np.array(axis), radius, start, start)
