"""The exact adjoint of a batch's step, with contact types held, in the order of pulling back."""

from __future__ import annotations

import warp as wp

from drake_dress.models.cloth.batch import adjoint_kernels as kernels
from drake_dress.models.cloth.batch.adjoint_kernels import Backward
from drake_dress.models.cloth.batch.arrays import array_out
from drake_dress.models.cloth.batch.element_kernels import (
    hinge_stiffness,
    subtract_gathered,
    triangle_stiffness,
)
from drake_dress.models.cloth.batch.engine import Engine, solve_kinds
from drake_dress.models.cloth.batch.material_kernels import (
    Adjoints,
    bending_shares,
    density_shares,
    make_adjoints,
    stretch_shares,
)
from drake_dress.models.cloth.batch.oblique import make_bonds
from drake_dress.models.cloth.batch.projected_cg import SKIP, iterate_where, skip_where
from drake_dress.models.cloth.batch.reduction import add_sums, steps_for
from drake_dress.models.cloth.batch.tape import Gradient, Tape

# How far a node moves in the central difference of the stiffness along v, m.
_DISPLACEMENT = 1e-6


def pull_back(
    engine: Engine,
    tape: Tape,
    x_bar: wp.array,
    v_bar: wp.array,
    reaction_bar: wp.array,
    by_fabric: bool,
) -> Gradient:
    """Returns the derivative of L by the inputs of the taped step.

    Args:
        engine: of the step.
        tape: of the step.
        x_bar: (B,n) ∂L/∂ of the step's positions.
        v_bar: (B,n) ∂L/∂ of the step's velocities.
        reaction_bar: (B,k) ∂L/∂ of the reaction at the held nodes.
        by_fabric: whether also by the fabrics.
    """
    t, h = tape, engine.time_step
    p_of = [engine.system, t.parameters]
    square = h * h
    launch = engine.launch

    # the solves of Δx and Δv, transposed; the reaction of the held nodes is (2/h²)(P Δx − g)
    seed, motion_in = engine.vectors(), engine.vectors()
    launch(kernels.seed_reaction, [engine.held_index, reaction_bar, square, seed])
    launch(kernels.seed_motion, [*p_of, x_bar, seed, motion_in])
    backward = kernels.make_backward(motion_in, v_bar)
    kinds = t.base_solve if t.contact is None else skip_where(t.contact.touches, t.base_solve)
    for rhs, z in ((motion_in, backward.motion), (v_bar, backward.change)):
        engine.solver.solve(t.parameters, kinds, t.base_mode, rhs, z)
    if t.contact is not None:
        near, friction = t.contact.near, t.contact.friction
        for mode, rhs, z in (
            (friction.mode, motion_in, backward.motion),
            (friction.velocity_mode, v_bar, backward.change),
        ):
            bonds = make_bonds(mode, near.normal, friction.push, backward=True)
            engine.oblique.solve(t.parameters, t.contact.touches, bonds, rhs, z)

    # what is prescribed to held and touching nodes, and what that follows from
    prescribed_in, target_in, x_in = engine.vectors(), engine.vectors(), wp.clone(x_bar)
    launch(
        kernels.pull_held,
        [*p_of, engine.held_index, h, motion_in, v_bar, backward.motion, backward.change]
        + [prescribed_in, target_in],
    )
    back_stick, friction_in = engine.vectors(zero=True), None
    if t.contact is not None:
        friction_in = _pull_contact(engine, t, backward, prescribed_in, target_in, back_stick, x_in)
    held_in = wp.empty((engine.batch, len(engine.held)), dtype=wp.vec3d, device=engine.device)
    launch(kernels.take_held, [engine.held, prescribed_in, held_in], len(engine.held))

    # right-hand sides and forces
    motion_weight, g_in, force_in, v_in = (engine.vectors() for _ in range(4))
    launch(
        kernels.pull_right_hand_side,
        [t.parameters, engine.mesh.node_area, h, v_bar, seed, backward.motion, backward.change]
        + [back_stick, target_in, motion_weight, g_in, force_in, v_in],
    )
    to_v, to_x = engine.element_vectors(), engine.element_vectors()
    engine.launch_elements(
        triangle_stiffness,
        hinge_stiffness,
        [engine.mesh, t.parameters, t.x, t.v, steps_for(t.v, _DISPLACEMENT), backward.change]
        + [force_in, 0.5 * square, to_v, to_x],
    )
    launch(subtract_gathered, [engine.mesh, to_v, to_x, v_in, x_in])
    results = [x_in, v_in, held_in]
    if not by_fabric:
        return Gradient(*(array_out(r, t.kind) for r in results))

    adjoints = make_adjoints(
        x=t.x,
        v=t.v,
        force_in=force_in,
        pull_in=backward.change,
        g_in=g_in,
        change=t.change,
        motion_weight=motion_weight,
        motion=t.motion,
        stick_weight=back_stick,
        stick_motion=t.motion if t.contact is None else t.contact.stick_motion,
    )
    by_friction = wp.zeros(engine.batch, dtype=wp.float64, device=engine.device)
    if friction_in is not None:
        add_sums(friction_in, by_friction)
    results += [*_by_fabric(engine, adjoints), by_friction]
    return Gradient(*(array_out(r, t.kind) for r in results))


def _pull_contact(
    engine: Engine,
    tape: Tape,
    backward: Backward,
    prescribed_in: wp.array,
    target_in: wp.array,
    back_stick: wp.array,
    x_in: wp.array,
) -> wp.array:
    """Pulls back the bonds of touching nodes; returns (B,n) shares by the coefficient of friction.

    Friction follows the force of sticking, what is prescribed and normals follow the nodes. Adds to
    `prescribed_in`, `target_in` and `x_in`, writes `back_stick`.
    """
    contact = tape.contact
    assert contact is not None
    p_of = [engine.system, tape.parameters]
    near, friction = contact.near, contact.friction
    forward = kernels.make_forward(
        prescribed=contact.prescribed,
        target_change=contact.target_change,
        motion=tape.motion,
        change=tape.change,
        multiplier=contact.multiplier,
        change_multiplier=contact.change_multiplier,
    )
    normal_in, friction_in = engine.vectors(), engine.scalars()
    engine.launch(
        kernels.pull_bonds,
        [*p_of, near, friction, forward, backward]
        + [prescribed_in, target_in, normal_in, back_stick, friction_in],
    )
    kinds = iterate_where(contact.slips, solve_kinds(engine, SKIP))
    nothing = engine.vectors(zero=True)
    engine.solver.solve(tape.parameters, kinds, contact.stick_mode, nothing, back_stick)
    engine.launch(
        kernels.pull_sticking,
        [*p_of, contact.slips, contact.stick_mode, back_stick, prescribed_in],
    )
    engine.launch(
        kernels.pull_contact,
        [tape.bodies, near, engine.time_step, tape.x] + [prescribed_in, target_in, normal_in, x_in],
    )
    return friction_in


def _by_fabric(engine: Engine, adjoints: Adjoints) -> tuple[wp.array, wp.array, wp.array]:
    """Returns (B,) the derivatives by stretch stiffness, bending stiffness and density."""
    h, e = engine.time_step, engine.elements
    results = []
    for kernel, more, count in (
        (stretch_shares, [h], len(e.triangle)),
        (bending_shares, [h], len(e.hinge)),
        (density_shares, [engine.gravity, h], engine.node_count),
    ):
        shares = engine.scalars(count)
        engine.launch(kernel, [engine.mesh, adjoints, *more, shares], count)
        out = wp.zeros(engine.batch, dtype=wp.float64, device=engine.device)
        add_sums(shares, out)
        results.append(out)
    return results[0], results[1], results[2]
