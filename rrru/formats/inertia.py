"""Point masses of an Assembly's bodies, fixed in frames of the legs, for `rrru.formats.robot_file`.

Six points on a body's principal axes have its mass m, centre and inertia I:

    each m / 6, at +- sqrt(3 S_k / m) from the centre along axis k,   S_k = (trace I) / 2 - I_k

Of a bar only the distribution along it is known: two points have its mass, its centre's place along it and its inertia
across. Lengths in mm, masses in kg.
"""

import mujoco
import numpy as np

from rrru.formats.chains import Chains, Place
from rrru.formats.joint_graph import inverse_placement, placed, turn_of
from rrru.formats.mjcf_reader import MM
from rrru.formats.urdf_reader import NO_MASS_KG
from rrru.kinematics.chain import Twists, Walk, walk
from rrru.kinematics.legs import Bar, Leg, Legs, turn_about
from rrru.kinematics.point_masses import PLATFORM, PointMass


def points_of(model: mujoco.MjModel, body: int) -> np.ndarray:
    """Points (6, 3) in mm in a body's frame, each of a sixth of its mass, that have its centre and inertia."""
    mass, inertia = model.body_mass[body], model.body_inertia[body]
    # rounding may violate the triangle inequalities
    second = np.maximum(0.5 * inertia.sum() - inertia, 0.0)
    arms = turn_of(model.body_iquat[body]) * np.sqrt(3.0 * second / mass)
    return np.asarray(MM * (model.body_ipos[body] + np.concatenate([arms.T, -arms.T])))


def point_masses_of(chains: Chains, open_legs: Legs, legs: Legs) -> tuple[PointMass, ...]:
    """PointMasses of all bodies that move with Legs; open_legs: the same ones without bars."""
    assembly, result = chains.assembly, []
    for body in range(1, assembly.model.nbody):
        mass, holder = float(assembly.model.body_mass[body]), _holder(chains, body)
        if mass <= 2.0 * NO_MASS_KG or holder is None:
            continue
        part, there = assembly.frames[holder]
        home = inverse_placement(assembly.home_of(holder)) @ assembly.home_of(body)
        at = _transformed(there @ home, points_of(assembly.model, body))
        if part == assembly.frames[assembly.platform][0]:
            result += [PointMass(PLATFORM, mass / 6.0, point) for point in at]
            continue
        place = chains.parts[part]
        at, leg = _transformed(place.placement, at), legs.legs[place.leg]
        if leg.bar and place.joint >= len(leg.joints) - 1:
            result += _of_bar(open_legs, legs, place, leg.bar, mass, at)
        else:
            result += [PointMass(leg.joints[place.joint].name, mass / 6.0, point) for point in at]
    return tuple(result)


def _holder(chains: Chains, body: int) -> int | None:
    """The body, or the parent of it at home, that is part of a leg; None for a body that is fixed or loose."""
    assembly = chains.assembly
    while body and assembly.frames[body][0] not in (assembly.base, *chains.parts):
        body = int(assembly.model.body_parentid[body])
    return body if assembly.frames[body][0] in chains.parts else None


def _transformed(placement: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (n, 3) transformed by a placement."""
    return np.asarray(points @ placement[:3, :3].T + placement[:3, 3])


def _of_bar(open_legs: Legs, legs: Legs, place: Place, bar: Bar, mass: float, at: np.ndarray) -> list[PointMass]:
    """Two PointMasses of a body of a Bar whose points (6, 3) are at a Place of the leg without the bar."""
    chain, leg = open_legs.legs[place.leg], legs.legs[place.leg]
    actuators, passive = open_legs.home_drives[None], open_legs.home_passive[None]
    way = walk(open_legs, chain, actuators, passive, Twists(open_legs))
    near = walk(legs, leg, actuators, legs.home_passive[None], Twists(legs)).place[0]
    far = way.place[0] + way.turn[0] @ bar.platform_mm
    line = (far - near) / np.linalg.norm(far - near)
    body_points = _transformed(_behind(open_legs, chain, way, place.joint), at)
    slides = [k for k, joint in enumerate(chain.joints) if joint.kind == "P" and k >= len(leg.joints) - 1]
    moving = bool(slides) and place.joint >= slides[0]
    middle = body_points.mean(axis=0)
    along = (body_points - middle) @ line
    arm = np.sqrt(0.5 * (((body_points - middle) ** 2).sum(axis=1) + along**2).mean())
    centre = (middle - (far if moving else near)) @ line
    site = leg.bar_sites[1 if moving else 0]
    return [PointMass(site, 0.5 * mass, np.array([centre + side * arm, 0.0, 0.0])) for side in (1.0, -1.0)]


def _behind(legs: Legs, chain: Leg, way: Walk, number: int) -> np.ndarray:
    """Placement of the link that a joint of a chain moves, in the home pose; way: the chain's Walk."""
    joint, turn, place = chain.joints[number], way.turns[number][0], way.places[number][0]
    value = joint.home if joint.drive is None else legs.driven(legs.home_drives)[joint.drive]
    if joint.kind == "P":
        place = place + value * way.axes[number][0]
    return placed(place, turn @ turn_about(joint.axis, value) if joint.kind == "R" else turn)
