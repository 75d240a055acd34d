"""The person's behaviour: arms on springs, arms that follow the garment, or motions of its own.

    PassivePerson | ActivePerson ──set-point──▶ ArmMuscles ──┐
                       dummy: constant tone ────────────────┴▶ (+ tremor, spasm, stirring) ──▶ plant
    ActivePerson | zeros ──intent──▶ log

The controller receives none of this.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Literal

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder, InputPort, LeafSystem, OutputPort
from pydrake.systems.primitives import Adder, ConstantVectorSource, Gain

from drake_dress.diagrams.person import Person, angles_of
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.active import ActiveParameters
from drake_dress.models.human.arm import Arms
from drake_dress.models.human.body import ArmPose
from drake_dress.models.human.lowering import Lowering
from drake_dress.models.human.motions import Motion, Turn
from drake_dress.models.human.shape import CHAIR
from drake_dress.models.human.spasm import SpasmParameters
from drake_dress.models.human.stirring import DRIVE, StirringParameters
from drake_dress.models.human.tremor import TremorParameters, driving_torque, tremor_torque
from drake_dress.models.human.wheelchair import distance_of_arms
from drake_dress.models.sides import SIDES
from drake_dress.systems.active_person import ActivePerson
from drake_dress.systems.arm_lowering import ArmLowering, Around
from drake_dress.systems.arm_muscles import ArmMuscles
from drake_dress.systems.arm_spasm import ArmSpasm
from drake_dress.systems.arm_stirring import ArmStirring
from drake_dress.systems.hand_tremor import HandTremor
from drake_dress.systems.passive_person import PassivePerson

Kind = Literal["dummy", "passive", "active"]
# Plant steps between updates of an active person's set-points; people do not react faster.
_WILL_STEPS = 3


@dataclass(frozen=True)
class Behaviour:
    """Behaviour of a person.

    Attributes:
        kind: a dummy's arms are springs about the rest pose; a passive person follows the garment;
            an active one has motions of its own and follows between them.
        active: parameters of passive and active persons; a passive one only uses `following`.
        motions: of an active person.
        tremor: of any kind of person; None for steady hands.
        spasm: of any kind of person; None for an arm without.
        seed: of tremor and spasms.
        lowering: of the arms once both sleeves are on. A dummy's arms are lowered by somebody.
        stirring: small motions once the coat is let go.
    """

    kind: Kind = "dummy"
    active: ActiveParameters = field(default_factory=ActiveParameters)
    motions: tuple[Motion, ...] = ()
    tremor: TremorParameters | None = None
    spasm: SpasmParameters | None = None
    seed: int = 0
    lowering: Lowering = Lowering()
    stirring: StirringParameters = StirringParameters()

    @property
    def turns(self) -> bool:
        """Whether the person turns at all."""
        return self.kind == "active" and any(isinstance(m, Turn) for m in self.motions)


def add_behaviour(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    person: Person,
    arms: Arms,
    behaviour: Behaviour,
    mesh: GarmentMesh,
    garment_position: OutputPort,
    grippers_open: OutputPort,
) -> tuple[OutputPort, InputPort | None]:
    """Adds the systems that move the person, wired to the plant.

    Args:
        builder: of the station.
        plant: finalized.
        person: in the plant; made with `turns` if `behaviour.turns`.
        arms: those that `person_arms` returns for the person.
        behaviour: of the person.
        mesh: the true garment.
        garment_position: port (3n,) of the true garment, m.
        grippers_open: port (1,): 1 once the grippers have let go.

    Returns:
        A port (2,): 1 if the left, the right arm moves by the person's own will, else 0; and the
        input (1,) that tells the person to lower the arms, None if that has no effect.
    """
    will: LeafSystem | None = None
    lowering = None
    if behaviour.lowering.duration > 0.0:
        pose = np.clip(angles_of(behaviour.lowering.pose), *np.moveaxis(arms.limits, 1, 0))
        pose = np.where(np.array(arms.has_tone)[:, None], pose, arms.rest)
        lowering = _add_lowering(builder, plant, person, arms, pose, behaviour.lowering.duration)
    if behaviour.kind == "dummy":
        source: LeafSystem = ConstantVectorSource(person.tone_torque(plant))
        force = builder.AddSystem(source).get_output_port()
        if lowering is not None:
            force = _lowered_dummy(builder, plant, person, arms, lowering, force)
    else:
        force, will = _muscles(
            builder, plant, person, arms, behaviour, mesh, garment_position, lowering
        )
    if behaviour.tremor is not None and behaviour.tremor.amplitude > 0.0:
        force = _trembling(builder, plant, person, arms, behaviour, force)
    if behaviour.spasm is not None and behaviour.spasm.torque > 0.0:
        dofs = person.arm_dofs(plant)
        spasm = ArmSpasm(behaviour.spasm, behaviour.seed, plant.num_velocities(), dofs)
        builder.AddNamedSystem("arm_spasm", spasm)
        force = _added(builder, force, spasm.get_output_port())
    if behaviour.stirring.amplitude > 0.0:
        force = _stirring(builder, plant, person, arms, behaviour.stirring, force, grippers_open)
    builder.Connect(force, plant.get_applied_generalized_force_input_port())
    told = None if lowering is None else lowering.GetInputPort("told")
    if will is not None and will.HasOutputPort("intent"):
        return will.GetOutputPort("intent"), told
    none = builder.AddNamedSystem("no_intent", ConstantVectorSource(np.zeros(len(SIDES))))
    return none.get_output_port(), told


def _add_lowering(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    person: Person,
    arms: Arms,
    pose: FloatArray,
    duration: float,
) -> ArmLowering:
    """Adds the system that lowers the arms to `pose` (2,4), rad; around a chair, if any."""
    around, chair = None, [c for c in person.capsules if c.part == CHAIR]
    if chair:
        mine = _arms_among_own(plant, person)
        measures = arms.arms[0].measures

        def room(angles: FloatArray) -> FloatArray:
            poses = {side: ArmPose(*q.tolist()) for side, q in zip(SIDES, angles, strict=True)}
            return np.array(distance_of_arms(chair, measures, poses))

        around = Around(room, mine, 2 * len(person.own_dofs(plant)))
    lowering: ArmLowering = builder.AddNamedSystem(
        "arm_lowering", ArmLowering(pose, duration, plant.time_step(), around)
    )
    if around is not None:
        state = plant.get_state_output_port(person.model)
        builder.Connect(state, lowering.GetInputPort("person_state"))
    return lowering


def _arms_among_own(plant: MultibodyPlant, person: Person) -> IndexArray:
    """Returns the indices (8,) of the arms' joints in the person's own velocities."""
    own = person.own_dofs(plant)
    return np.array([np.flatnonzero(own == d)[0] for d in person.arm_dofs(plant)], dtype=np.intp)


def _muscles(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    person: Person,
    arms: Arms,
    behaviour: Behaviour,
    mesh: GarmentMesh,
    garment_position: OutputPort,
    lowering: ArmLowering | None,
) -> tuple[OutputPort, LeafSystem]:
    """Returns the port of the muscles' forces, and the system that outputs their set-points."""
    own, dofs = person.own_dofs(plant), person.arm_dofs(plant)
    mine = _arms_among_own(plant, person)
    muscles = builder.AddNamedSystem("arm_muscles", ArmMuscles(arms, plant.num_velocities(), dofs))
    period = plant.time_step()
    if behaviour.kind == "passive":
        will: LeafSystem = PassivePerson(arms, len(own), mine, behaviour.active.following, period)
    else:
        yaw = int(np.setdiff1d(np.arange(len(own)), mine)[0]) if person.turns else None
        will = ActivePerson(
            arms,
            len(own),
            mine,
            yaw,
            person.origin,
            mesh,
            behaviour.motions,
            behaviour.active,
            _WILL_STEPS * period,
        )
    builder.AddNamedSystem(f"{behaviour.kind}_person", will)
    builder.Connect(plant.get_state_output_port(person.model), will.GetInputPort("person_state"))
    rates = ["set_point_rate"] if behaviour.kind == "active" else []
    for name in ("set_point", *rates):
        if lowering is None:
            builder.Connect(will.GetOutputPort(name), muscles.GetInputPort(name))
        else:
            builder.Connect(will.GetOutputPort(name), lowering.GetInputPort(name))
    if lowering is not None:
        _drive(builder, lowering, muscles)
    if behaviour.kind == "active":
        builder.Connect(garment_position, will.GetInputPort("garment_position"))
    if person.turns:
        builder.Connect(
            will.GetOutputPort("stance"), plant.get_desired_state_input_port(person.model)
        )
    return muscles.get_output_port(), will


def _drive(builder: DiagramBuilder, lowering: ArmLowering, muscles: ArmMuscles) -> None:
    """Makes muscles follow the lowered set-point."""
    for name in ("set_point", "set_point_rate"):
        builder.Connect(lowering.GetOutputPort(f"lowered_{name}"), muscles.GetInputPort(name))


def _lowered_dummy(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    person: Person,
    arms: Arms,
    lowering: ArmLowering,
    force: OutputPort,
) -> OutputPort:
    """Returns a dummy's `force` plus that which lowers its arms; 0 until it is told to.

    It is the difference between the muscles' forces at the lowered set-point and at rest.
    """
    parts = []
    rest = builder.AddSystem(ConstantVectorSource(arms.rest.ravel()))
    builder.Connect(rest.get_output_port(), lowering.GetInputPort("set_point"))
    for name in ("lowering_muscles", "resting_muscles"):
        muscles = ArmMuscles(arms, plant.num_velocities(), person.arm_dofs(plant))
        parts.append(builder.AddNamedSystem(name, muscles))
    _drive(builder, lowering, parts[0])
    builder.Connect(rest.get_output_port(), parts[1].GetInputPort("set_point"))
    minus = builder.AddSystem(Gain(-1.0, plant.num_velocities()))
    builder.Connect(parts[1].get_output_port(), minus.get_input_port())
    change = _added(builder, parts[0].get_output_port(), minus.get_output_port())
    return _added(builder, force, change)


def _trembling(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    person: Person,
    arms: Arms,
    behaviour: Behaviour,
    force: OutputPort,
) -> OutputPort:
    """Returns `force` with the tremor's torques added."""
    assert behaviour.tremor is not None
    torque = _of_muscles(plant, person, arms, partial(tremor_torque, behaviour.tremor))
    tremor = builder.AddNamedSystem(
        "hand_tremor",
        HandTremor(
            torque,
            behaviour.tremor.frequency,
            behaviour.seed,
            plant.num_velocities(),
            person.arm_dofs(plant),
        ),
    )
    return _added(builder, force, tremor.get_output_port())


def _stirring(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    person: Person,
    arms: Arms,
    p: StirringParameters,
    force: OutputPort,
    grippers_open: OutputPort,
) -> OutputPort:
    """Returns `force` with the torques added by which a dressed person stirs."""
    driving = partial(driving_torque, DRIVE, p.amplitude, p.frequency)
    torque = _of_muscles(plant, person, arms, driving)
    stirring = builder.AddNamedSystem(
        "arm_stirring",
        ArmStirring(
            torque,
            p.frequency,
            plant.num_velocities(),
            person.arm_dofs(plant),
            plant.time_step(),
        ),
    )
    builder.Connect(grippers_open, stirring.get_input_port())
    return _added(builder, force, stirring.get_output_port())


def _of_muscles(
    plant: MultibodyPlant, person: Person, arms: Arms, driving: Callable[..., FloatArray]
) -> FloatArray:
    """Returns torques of both arms (8,), N·m; 0 of an arm that has no muscle tone.

    Args:
        plant: finalized.
        person: in the plant.
        arms: of the person.
        driving: torques (4,) of one arm from what `_swinging` returns of it.
    """
    swinging = zip(_swinging(plant, person, arms), arms.has_tone, strict=True)
    return np.concatenate([driving(*of_arm) * works for of_arm, works in swinging])


def _swinging(
    plant: MultibodyPlant, person: Person, arms: Arms
) -> list[tuple[FloatArray, FloatArray, FloatArray, FloatArray]]:
    """Returns mass, damping, stiffness and hand's Jacobian of each arm at rest."""
    dofs = person.arm_dofs(plant)
    mass = plant.CalcMassMatrix(plant.CreateDefaultContext())
    found = []
    for i, arm in enumerate(arms.arms):
        mine, rest = dofs[4 * i : 4 * i + 4], arms.rest[i]
        stiffness = np.diag(arms.stiffness[i]) + arm.gravity_stiffness(rest)
        found.append((mass[np.ix_(mine, mine)], arms.damping[i], stiffness, arm.jacobian(rest)))
    return found


def _added(builder: DiagramBuilder, first: OutputPort, second: OutputPort) -> OutputPort:
    """Returns a port with the sum of two ports."""
    both = builder.AddSystem(Adder(2, first.size()))
    builder.Connect(first, both.get_input_port(0))
    builder.Connect(second, both.get_input_port(1))
    return both.get_output_port()
