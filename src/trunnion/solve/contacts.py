"""The contacts with friction of each pair: what presses on them, which way they slip, what friction does.

A contact is a normal load, a slip speed and the wrench of a friction force of 1 N along the slip. In space a
cylindrical pair slips along the vector (r θ̇, ṡ), so its friction is one force along that, not a full torque and a full
force beside each other; the model `pezzuti` has both [P 17, 19]. A helical pair slips along its thread. A universal
pair is two pins. A ball's friction moment opposes the relative angular velocity with the lever of the radius: what a
ball has that bears on its great circle across that velocity, and the most for any other place of the contact.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.algebra import plane
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Wrench
from trunnion.algebra.space import Frame, Screw, about, moment_at
from trunnion.algebra.vector import Vector3, cross, dot, minus, plus, scaled
from trunnion.joints.contact_loads import BearingLoad, GuideLoad, PinLoad
from trunnion.solve.forward import Forward, SpatialWalk
from trunnion.solve.friction import Rubbing

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

NULL: Vector3 = (0.0, 0.0, 0.0)


def bearing_middle(walk: SpatialWalk, joint: str) -> Vector3:
    """Middle of a joint's bearing: its point on the second link, moved along the axis by the offset of the pin, m."""
    second = walk.ends(joint)[1]
    offset = walk.values.get(f"joints.{joint}.pin.offset")
    return second.place if offset is None else plus(second.place, scaled(offset, second.z))


def bearing_ends(mechanism: Mechanism, joint: str) -> int:
    """How many ends of bearings a joint has: two of a bearing or guide whose length is stated, four of a cross; in the
    plane a pin bears its load in its middle."""
    joint_entry = mechanism.effective_joints[joint]
    pair, spatial = joint_entry.pair, mechanism.space == "spatial"
    if pair.guided:
        return 2 if joint_entry.guide and joint_entry.guide.length is not None else 0
    has_length = joint_entry.pin is not None and (
        joint_entry.pin.bearing is not None or joint_entry.pin.length is not None
    )
    return (4 if pair.crossed else 2) if has_length and spatial and (pair.one_axis or pair.crossed) else 0


def has_pressure(mechanism: Mechanism, joint: str) -> bool:
    """Whether the projected area of a joint's pin is stated."""
    joint_entry = mechanism.effective_joints[joint]
    pin, pair = joint_entry.pin, joint_entry.pair
    sized = pin is not None and pin.radius is not None and (pin.bearing is not None or pin.length is not None)
    return sized and pair.turns and not pair.ball and not pair.threaded


def loads_on_ends(walk: Forward, joint: str, reaction: Any, friction: Any) -> list[Vector3]:
    """Load on each end of a joint's bearing or guide of length L along u, N: F⊥/2 ∓ M⊥ × u/L, global axes.

    Friction with two contacts counts these. End 1 is that at −u. On the pins of a cross, that of the first link before
    that of the second, the friction of each bears on the other.
    """
    path, pair = f"joints.{joint}", walk.system.joints[joint].pair
    length = walk.values[f"{path}.guide.length" if pair.guided else f"{path}.pin.bearing"]
    if not isinstance(walk, SpatialWalk):
        axis, second = walk.ends(joint)
        couple = plane.moment_at(reaction, plane.place_of(second)) / length
        half = 0.5 * (axis.c * reaction.y - axis.s * reaction.x)
        return [scaled(load, (-axis.s, axis.c, 0.0)) for load in (half - couple, half + couple)]
    wrench = walk.algebra.added(reaction, friction) if pair.crossed else reaction
    force, moment = wrench.u, moment_at(wrench, bearing_middle(walk, joint))
    loads: list[Vector3] = []
    for pin in walk.ends(joint) if pair.crossed else walk.ends(joint)[1:]:
        half = scaled(0.5, minus(force, scaled(dot(force, pin.z), pin.z)))
        couple = scaled(1 / length, cross(moment, pin.z))
        loads += [minus(half, couple), plus(half, couple)]
    return loads


def contacts_of(walk: Forward, joint: str) -> Iterator[Rubbing]:
    """The contacts of a joint."""
    return _in_space(walk, joint) if isinstance(walk, SpatialWalk) else _in_plane(walk, joint)


def _in_plane(walk: Forward, joint: str) -> Iterator[Rubbing]:
    """The one contact of a joint: a pin in its hole, or a guide, whose middle is at its point on the second link.

    The joint in which a screw turns stands for its thread.
    """
    turns, path = walk.system.turns(joint), f"joints.{joint}"
    speed = walk.speed(joint)
    zero = np.abs(primal(speed)) <= walk.noise(joint, turns)
    if turns:
        if joint in walk.system.screws:
            lever = walk.values[f"{path}.pin.radius"]
            for name in walk.system.screws[joint]:  # a square thread at its mean radius r, tan λ = lead/(2 π r):
                lead = walk.system.ratio(walk.values, name)  # F sec λ presses, friction acts along it
                xp = namespace(lead, lever)
                helix = xp.sqrt(lever * lever + lead * lead)
                secant = helix / lever / (xp.abs(lead) if name in walk.system.turned_round else 1.0)
                # the load is of what the gear pair puts into its second joint, the force F along the screw or its
                # torque; a guide of length 2/s under a moment M alone presses with |M| s
                load, moment = GuideLoad((1.0, 0.0), 2.0 / secant), lever * lever / helix
                yield Rubbing(load, helix * speed, Wrench(0.0, 0.0, moment), zero, amount=moment)
            return
        lever, turning = _lever(walk, joint)
        yield Rubbing(PinLoad(), lever * speed, Wrench(0.0, 0.0, lever), zero, amount=lever, turning=turning)
        return
    axis, second = walk.ends(joint)
    middle = plane.place_of(second)
    guide = GuideLoad((-axis.s, axis.c), walk.values[f"{path}.guide.length"], middle)
    yield Rubbing(guide, speed, plane.about((axis.c, axis.s), 0.0, middle), zero)


def _lever(walk: Forward, joint: str) -> tuple[Number, Number | None]:
    """The lever of friction in a pin, m, and how it turns the seat: a rolling one has its arm, and does not."""
    path = f"joints.{joint}"
    arm = walk.values.get(f"{path}.friction.arm")
    return (walk.values[f"{path}.pin.radius"], 1.0) if arm is None else (arm, None)


def _in_space(walk: SpatialWalk, joint: str) -> Iterator[Rubbing]:
    """Of a joint in space."""
    pair, middle, values, path = walk.pair(joint), bearing_middle(walk, joint), walk.values, f"joints.{joint}"
    second = walk.ends(joint)[1]
    axis = second.z
    if pair.ball:
        spin, radius = walk.against(joint).u, values[f"{path}.pin.radius"]
        square = dot(spin, spin)
        speed, share = _speed(square, primal(square) > 0)
        unit = Screw(NULL, scaled(radius, scaled(share, spin)))
        still = walk.speed(joint) <= walk.noise(joint, turns=True)
        yield Rubbing(PinLoad(), radius * speed, unit, still, amount=radius, turning=1.0)
        return
    if pair.crossed:  # each pin is a revolute bearing; friction of one is carried by the other as a moment across it
        lever, speed = values[f"{path}.pin.radius"], walk.speed(joint)
        share = lever / np.where(speed > 0, speed, np.inf)  # its friction is told as a torque about the relative spin
        for pin, rate in zip(walk.ends(joint), walk.pin_rates(joint), strict=True):
            still = np.abs(primal(rate)) <= walk.noise(joint, turns=True)
            load = BearingLoad(pin._replace(place=middle), values[f"{path}.pin.bearing"], walk.system.summed(joint))
            unit = Screw(NULL, scaled(lever, pin.z))
            yield Rubbing(load, lever * rate, unit, still, amount=share * rate, felt=True)
        return
    load = _bearing(walk, joint, second._replace(place=middle))
    turn, slide = walk.rates(joint)
    turned, slid = np.abs(primal(turn)) <= walk.noise(joint, True), np.abs(primal(slide)) <= walk.noise(joint, False)
    if pair.guided:
        yield Rubbing(load, slide, about(axis, NULL, middle), slid)
        return
    lever, turning = _lever(walk, joint)
    moment = Screw(NULL, scaled(lever, axis))
    if pair.threaded:
        lead = walk.system.lead(walk.values, joint)
        helix = namespace(lead, lever).sqrt(lever * lever + lead * lead)
        unit = _mixed(axis, middle, lever, lever / helix, lead / helix)
        yield Rubbing(load, helix * turn, unit, turned, amount=lever * lever / helix)
    elif pair.slides and not walk.system.summed(joint):
        # along the vector of the slip; where there is none, about the axis
        around, zero = lever * turn, turned & slid
        square = around * around + slide * slide
        moves = (primal(square) > 0) & np.logical_not(zero)
        speed, share, xp = *_speed(square, moves), namespace(square)
        cosine, sine = xp.where(moves, around * share, 1.0), xp.where(moves, slide * share, 0.0)
        unit = _mixed(axis, middle, lever, cosine, sine)
        yield Rubbing(load, speed, unit, zero, amount=lever * cosine, turning=xp.abs(cosine))
    else:
        yield Rubbing(load, lever * turn, moment, turned, amount=lever, turning=turning)
        if pair.slides:
            yield Rubbing(load, slide, about(axis, NULL, middle), slid, amount=0.0)


def _speed(square: Number, moves: Number) -> tuple[Number, Number]:
    """A speed from its square and 1 over it, where something moves; elsewhere 0 and 1."""
    xp = namespace(square)
    speed = xp.where(moves, xp.sqrt(xp.where(moves, square, 1.0)), 0.0)
    return speed, 1 / xp.where(moves, speed, 1.0)


def _mixed(axis: Vector3, middle: Vector3, lever: Number, cosine: Number, sine: Number) -> Screw:
    """A unit friction force, its part across the axis with a lever."""
    return about(scaled(sine, axis), scaled(lever * cosine, axis), middle)


def _bearing(walk: SpatialWalk, joint: str, frame: Frame) -> BearingLoad:
    values, path, pair = walk.values, f"joints.{joint}", walk.pair(joint)
    if pair.guided:
        length = values[f"{path}.guide.length"]
        return BearingLoad(frame, length, walk.system.summed(joint), values.get(f"{path}.guide.width"))
    flank = None
    if pair.threaded:
        slope = walk.system.lead(values, joint) / values[f"{path}.pin.radius"]
        flank = namespace(slope).sqrt(1 + slope * slope)
    return BearingLoad(frame, values[f"{path}.pin.bearing"], walk.system.summed(joint), flank=flank)
