"""The part of a batch's step that deals with contact, in the order of the step.

See `explicit_bias`: all nodes in reach stick, by the forces of which they take off, slip or stick;
the motion is solved, and again where its forces ask for other types; then velocities.
"""

from __future__ import annotations

import warp as wp

from drake_dress.models.cloth.batch import contact_kernels, friction_kernels
from drake_dress.models.cloth.batch.bodies import Bodies
from drake_dress.models.cloth.batch.contact_kernels import Proximity, make_proximity
from drake_dress.models.cloth.batch.engine import Engine, solve_kinds
from drake_dress.models.cloth.batch.friction_kernels import Friction, make_friction
from drake_dress.models.cloth.batch.oblique import make_bonds
from drake_dress.models.cloth.batch.parameters import Parameters
from drake_dress.models.cloth.batch.projected_cg import SKIP, iterate_where
from drake_dress.models.cloth.batch.reduction import add_sums
from drake_dress.models.cloth.batch.tape import Contact, ContactTypes
from drake_dress.models.cloth.contact.friction import most_revisions


def find_contact(
    engine: Engine,
    parameters: Parameters,
    bodies: Bodies,
    x: wp.array,
    free_motion: wp.array,
    g: wp.array,
    mode: wp.array,
    types: ContactTypes | None,
) -> tuple[Proximity, wp.array, wp.array | None] | None:
    """Sets touching nodes to stick; returns what they touch, and (B,) flags of garments that do.

    And, (B,n), the body of each node that was let be, -1 for the others; None where none was.

    Args:
        engine: of the step.
        parameters: the fabrics.
        bodies: to touch.
        x: (B,n) positions.
        free_motion: (B,n) Δx without contact.
        g: (B,n) right-hand side of Δx.
        mode: (B,n) HELD or FREE, changed.
        types: contact to take, or None.

    Returns:
        None if nothing touches in any garment.
    """
    if bodies.count == 0:
        return None
    touches = engine.flags()
    if types is None:
        near = make_proximity(engine.integers())
        engine.launch(
            contact_kernels.find_touching,
            [bodies, parameters, x, free_motion, engine.time_step, near, mode, touches],
        )
    else:
        near = make_proximity(wp.array(types.owner, dtype=wp.int32, device=engine.device))
        engine.launch(contact_kernels.take_touching, [bodies, parameters, x, near, mode, touches])
    if not touches.numpy().any():
        return None
    spared = None
    if types is None:
        spared = _let_be(engine, parameters, near, free_motion, g, mode)
    return near, touches, spared


def _let_be(
    engine: Engine,
    parameters: Parameters,
    near: Proximity,
    free_motion: wp.array,
    g: wp.array,
    mode: wp.array,
) -> wp.array | None:
    """Takes nodes from `near` and `mode` that stay out once what lies on a surface is held."""
    count = wp.zeros((engine.batch, 2), dtype=wp.int32, device=engine.device)
    engine.launch(contact_kernels.count_touching, [near, mode, count])
    doubtful = engine.flags()
    wp.launch(contact_kernels.doubt_contact, engine.batch, [count, doubtful], device=engine.device)
    if not doubtful.numpy().any():
        return None
    h, lying_mode, motion = engine.time_step, engine.integers(), wp.clone(free_motion)
    engine.launch(contact_kernels.hold_lying, [near, h, mode, lying_mode, motion])
    kinds = iterate_where(doubtful, solve_kinds(engine, SKIP))
    engine.solver.solve(parameters, kinds, lying_mode, g, motion, cold=False)
    spared = engine.integers()
    engine.launch(contact_kernels.let_be, [doubtful, h, motion, near, mode, spared])
    return spared


def take_back(
    engine: Engine,
    near: Proximity,
    motion: wp.array,
    spared: wp.array,
    mode: wp.array,
    everyone: bool,
) -> bool:
    """Lets nodes touch after all that were let be and enter; returns whether there are any.

    Args:
        engine: of the step.
        near: what nodes touch.
        motion: (B,n) Δx with contact.
        spared: (B,n) of `find_contact`.
        mode: (B,n) of all touching nodes sticking.
        everyone: of a garment with such nodes all that were let be.
    """
    h, entered = engine.time_step, engine.flags()
    engine.launch(contact_kernels.find_entered, [near, h, motion, spared, entered])
    if not entered.numpy().any():
        return False
    inputs = [near, h, motion, entered, int(everyone), spared, mode]
    engine.launch(contact_kernels.take_back, inputs)
    return True


def bind_motion(
    engine: Engine,
    parameters: Parameters,
    near: Proximity,
    touches: wp.array,
    stick_mode: wp.array,
    prescribed: wp.array,
    v: wp.array,
    g: wp.array,
    motion: wp.array,
    types: ContactTypes | None,
) -> tuple[Contact, wp.array]:
    """Returns the garments in contact, velocities not yet bound, and Δx (B,n).

    Args:
        engine: of the step.
        parameters: the fabrics.
        near: of `find_contact`.
        touches: likewise.
        stick_mode: (B,n) HELD, FREE or, of all touching nodes, STICK.
        prescribed: (B,n) motions of held nodes; those of touching ones are added.
        v: (B,n) velocities.
        g: (B,n) right-hand side of Δx.
        motion: (B,n) Δx without contact; becomes that with all touching nodes sticking.
        types: contact types to take, or None.
    """
    system = [engine.system, parameters]
    h = engine.time_step
    target_change = engine.vectors(zero=True)
    engine.launch(
        contact_kernels.prescribe_touching,
        [near, h, v, stick_mode, prescribed, motion, target_change],
    )
    kinds = iterate_where(touches, solve_kinds(engine, SKIP))
    engine.solver.solve(parameters, kinds, stick_mode, g, motion, cold=False)
    stick_motion = motion

    friction = _friction(engine, types)
    slips, active = engine.flags(), engine.flags()
    engine.launch(
        friction_kernels.find_modes,
        [*system, near, g, h, stick_motion, stick_mode, target_change, int(types is None)]
        + [friction, slips, active],
    )
    motion = wp.clone(stick_motion)
    bonds = make_bonds(friction.mode, near.normal, friction.push)
    most = most_revisions(engine.solver.tolerance)
    for solves in range(1, most + 1):
        engine.oblique.solve(parameters, active, bonds, g, motion, cold=False)
        if types is not None or solves == most:
            break
        # Letting nodes slip settles once: letting go what that draws is all that is left.
        active = _revise(
            engine, parameters, near, g, motion, active, friction, slips, slide=solves == 1
        )
        if not active.numpy().any():
            break
    contact = Contact(
        near,
        touches,
        slips,
        stick_mode,
        stick_motion,
        prescribed,
        target_change,
        friction,
        multiplier=engine.scalars(),
        change_multiplier=engine.scalars(),
    )
    return contact, motion


def bind_change(
    engine: Engine,
    parameters: Parameters,
    contact: Contact,
    pull: wp.array,
    change: wp.array,
) -> None:
    """Solves Δv of the garments that touch; writes its multipliers.

    Args:
        engine: of the step.
        parameters: the fabrics.
        contact: of the motion.
        pull: (B,n) right-hand side of Δv.
        change: (B,n) Δv of held nodes and zero; becomes Δv.
    """
    near, friction = contact.near, contact.friction
    engine.launch(friction_kernels.start_change, [near, friction, contact.target_change, change])
    bonds = make_bonds(friction.velocity_mode, near.normal, friction.push)
    engine.oblique.solve(parameters, contact.touches, bonds, pull, change)
    engine.launch(
        friction_kernels.slip_multiplier,
        [engine.system, parameters, near, friction.velocity_mode, pull, change]
        + [contact.change_multiplier],
    )


def _friction(engine: Engine, types: ContactTypes | None) -> Friction:
    """Returns memory for contact types, with those that are given."""
    if types is None:
        return make_friction(engine.integers(), engine.integers())
    given = (types.mode, types.velocity_mode)
    return make_friction(*(wp.array(m, dtype=wp.int32, device=engine.device) for m in given))


def _revise(
    engine: Engine,
    parameters: Parameters,
    near: Proximity,
    g: wp.array,
    motion: wp.array,
    active: wp.array,
    friction: Friction,
    slips: wp.array,
    slide: bool,
) -> wp.array:
    """Corrects the types of active garments by their forces; returns (B,) flags of changed ones."""
    changes = engine.flags()
    bound, excess = engine.scalars(), engine.scalars()
    engine.launch(
        friction_kernels.let_go,
        [engine.system, parameters, near, g, motion, active, friction, bound, excess, changes],
    )
    if slide:
        sums = [wp.zeros(engine.batch, dtype=wp.float64, device=engine.device) for _ in range(2)]
        add_sums(bound, sums[0])
        add_sums(excess, sums[1])
        engine.launch(
            friction_kernels.let_slip,
            [parameters, active, excess, *sums, friction, slips, changes],
        )
    return changes
