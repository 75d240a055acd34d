"""The person's behaviour: arms on springs, arms that follow the garment, or motions of its own.

    PassivePerson | ActivePerson ──set-point──▶ ArmMuscles ──┐
                       dummy: constant tone ────────────────┴▶ (+ HandTremor) ──▶ plant
    ActivePerson | zeros ──intent──▶ log

The controller receives none of this.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder, LeafSystem, OutputPort
from pydrake.systems.primitives import Adder, ConstantVectorSource

from drake_dress.diagrams.person import Person
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.active import ActiveParameters
from drake_dress.models.human.arm import Arms
from drake_dress.models.human.motions import Motion, Turn
from drake_dress.models.human.tremor import TremorParameters, tremor_torque
from drake_dress.models.sides import SIDES
from drake_dress.systems.active_person import ActivePerson
from drake_dress.systems.arm_muscles import ArmMuscles
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
        seed: of the tremor.
    """

    kind: Kind = "dummy"
    active: ActiveParameters = field(default_factory=ActiveParameters)
    motions: tuple[Motion, ...] = ()
    tremor: TremorParameters | None = None
    seed: int = 0

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
) -> OutputPort:
    """Adds the systems that move the person, wired to the plant.

    Args:
        builder: of the station.
        plant: finalized.
        person: in the plant; made with `turns` if `behaviour.turns`.
        arms: those that `person_arms` returns for the person.
        behaviour: of the person.
        mesh: the true garment.
        garment_position: port (3n,) of the true garment, m.

    Returns:
        A port (2,): 1 if the left, the right arm moves by the person's own will, else 0.
    """
    will: LeafSystem | None = None
    if behaviour.kind == "dummy":
        source: LeafSystem = ConstantVectorSource(person.tone_torque(plant))
        force = builder.AddSystem(source).get_output_port()
    else:
        force, will = _muscles(builder, plant, person, arms, behaviour, mesh, garment_position)
    if behaviour.tremor is not None and behaviour.tremor.amplitude > 0.0:
        force = _trembling(builder, plant, person, arms, behaviour, force)
    builder.Connect(force, plant.get_applied_generalized_force_input_port())
    if will is not None and will.HasOutputPort("intent"):
        return will.GetOutputPort("intent")
    none = builder.AddNamedSystem("no_intent", ConstantVectorSource(np.zeros(len(SIDES))))
    return none.get_output_port()


def _muscles(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    person: Person,
    arms: Arms,
    behaviour: Behaviour,
    mesh: GarmentMesh,
    garment_position: OutputPort,
) -> tuple[OutputPort, LeafSystem]:
    """Returns the port of the muscles' forces, and the system that outputs their set-points."""
    own, dofs = person.own_dofs(plant), person.arm_dofs(plant)
    mine = np.array([int(np.flatnonzero(own == d)[0]) for d in dofs])
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
    builder.Connect(will.GetOutputPort("set_point"), muscles.GetInputPort("set_point"))
    if behaviour.kind == "active":
        builder.Connect(garment_position, will.GetInputPort("garment_position"))
        builder.Connect(
            will.GetOutputPort("set_point_rate"), muscles.GetInputPort("set_point_rate")
        )
    if person.turns:
        builder.Connect(
            will.GetOutputPort("stance"), plant.get_desired_state_input_port(person.model)
        )
    return muscles.get_output_port(), will


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
    dofs = person.arm_dofs(plant)
    mass = plant.CalcMassMatrix(plant.CreateDefaultContext())
    torque = []
    for i, arm in enumerate(arms.arms):
        mine, rest = dofs[4 * i : 4 * i + 4], arms.rest[i]
        stiffness = np.diag(arms.stiffness) + arm.gravity_stiffness(rest)
        torque.append(
            tremor_torque(
                behaviour.tremor,
                mass[np.ix_(mine, mine)],
                arms.damping,
                stiffness,
                arm.jacobian(rest),
            )
        )
    tremor = builder.AddNamedSystem(
        "hand_tremor",
        HandTremor(
            np.concatenate(torque),
            behaviour.tremor.frequency,
            behaviour.seed,
            plant.num_velocities(),
            dofs,
        ),
    )
    both = builder.AddSystem(Adder(2, plant.num_velocities()))
    builder.Connect(force, both.get_input_port(0))
    builder.Connect(tremor.get_output_port(), both.get_input_port(1))
    return both.get_output_port()
