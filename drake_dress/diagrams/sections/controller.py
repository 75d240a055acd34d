"""The section `controller`: the global policy, the local controller, the prediction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

from drake_dress.diagrams.planning import LocalSetup
from drake_dress.diagrams.scenario import schema
from drake_dress.diagrams.scenario.mirror import model_of
from drake_dress.models.cloth.material import Material
from drake_dress.models.control.budget import Budget
from drake_dress.models.control.constrained_ddp import solve
from drake_dress.models.control.costs import GarmentCost
from drake_dress.models.control.local_control import LocalController
from drake_dress.models.control.local_model import LocalParameters
from drake_dress.models.control.own_costs import registered_costs
from drake_dress.models.control.person_model import PersonModel
from drake_dress.models.control.policy import DressingPolicy, PolicyParameters
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.learned.forecast import PersonPredictor
from drake_dress.models.human.prediction import (
    PREDICTORS,
    TRAINED,
    MotionPredictor,
    trained_predictor,
)
from drake_dress.solvers.cone_programme import cone_programme


def controller_policy(
    c: schema.Controller,
    mesh: GarmentMesh,
    person: PersonModel,
    budget: Budget,
    costs: Sequence[GarmentCost] = (),
    from_front: bool = False,
) -> DressingPolicy:
    """Returns the policy of the global controller.

    Args:
        c: the section.
        mesh: the controller's garment.
        person: as the controller models it.
        budget: of a plan.
        costs: the user's own, in addition to the registered ones that the section lists.
        from_front: whether the garment comes from in front of the person.
    """
    g = c.global_mpc
    parameters = PolicyParameters(
        time_step=g.time_step,
        horizon=g.horizon,
        max_iterations=g.max_iterations,
        inner_iterations=g.inner_iterations,
        committed_steps=round(g.delay / g.time_step),
        max_speed=g.max_speed,
        plans=c.method != "local",
        spread_share=g.spread_share,
        span_share=g.span_share,
        budget=budget,
        weights=model_of(g.weights),
        finish=model_of(c.finish),
        insertion=model_of(c.insertion),
        tasks=model_of(
            c.tasks,
            progress_rate=g.progress_step / g.time_step,
            approach_distance=g.approach_distance,
            stages=model_of(c.stages, waiting_progress=g.waiting_progress),
        ),
    )
    all_costs = (*registered_costs(c.costs), *costs)
    material = Material(**vars(c.material))
    return DressingPolicy(mesh, material, person, parameters, all_costs, from_front)


def solve_budget(g: schema.GlobalMpc, in_real_time: bool) -> Budget:
    """Returns the budget of a plan: iterations in simulation, seconds in real time."""
    if in_real_time:
        return Budget(seconds=g.delay_share * g.delay)
    return Budget(iterations=g.budget)


def local_setup(c: schema.Controller, policy: DressingPolicy) -> LocalSetup | None:
    """Returns the local controller; None where the grippers follow the global plan directly."""
    if c.method == "global":
        return None
    values = c.local
    parameters = LocalParameters(
        **{
            f.name: getattr(values, f.name)
            for f in fields(LocalParameters)
            if f.name in vars(values)
        }
    )
    solvers = {"constrained_ddp": solve, "cone": cone_programme}
    return LocalSetup(
        LocalController(policy.planner, parameters, solvers[values.solver]),
        values.period,
        values.delay,
        values.feedback,
        values.prediction_step,
        math.ceil(values.horizon * values.time_step / values.prediction_step),
    )


def predictor(c: schema.Controller, base: Path) -> MotionPredictor | PersonPredictor:
    """Returns the predictor of the person's arms.

    Args:
        c: settings.
        base: directory that the folder of weights is relative to.

    Raises:
        UserError: the weights cannot be used.
    """
    if c.predictor == "constant_velocity":
        own: MotionPredictor = model_of(c.constant_velocity)
        return own
    if c.weights is not None and c.predictor in TRAINED:
        return trained_predictor(c.predictor, base / c.weights)
    return PREDICTORS[c.predictor]()
