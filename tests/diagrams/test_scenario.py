import dataclasses
import typing
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import load_file, save_file

from drake_dress.diagrams.behaviour import Behaviour
from drake_dress.diagrams.scenario import (
    Scenario,
    apply_variation,
    load_scenario,
    resolved_yaml,
)
from drake_dress.diagrams.scenario.coat import coat_parameters
from drake_dress.diagrams.scenario.ranges import range_of
from drake_dress.diagrams.scenario.schema import SCHEMAS, Arm, Coat, Variation
from drake_dress.diagrams.scenario.typed import check_ranges
from drake_dress.diagrams.sections.controller import predictor
from drake_dress.diagrams.sections.person import behaviour
from drake_dress.diagrams.sections.safety import safety_limits
from drake_dress.errors import UserError
from drake_dress.models.garment.coat import COATS, body_of_size, coat_of_size
from drake_dress.models.garment.mesh import LOOP_NAMES
from drake_dress.models.human.following import FollowingParameters
from drake_dress.models.human.learned.forecast import PersonHistory, PersonPredictor
from drake_dress.models.human.learned.weights import SHIPPED
from drake_dress.models.human.measures import FOREARM_MASS, UPPER_ARM_MASS
from drake_dress.models.human.motions import Reach, Turn, Wave, Withdraw
from drake_dress.models.human.prediction import (
    PREDICTORS,
    ConstantVelocityPredictor,
    StillPredictor,
)
from drake_dress.models.human.skin.scan import JOINT_NAMES
from drake_dress.models.human.tremor import TremorParameters
from drake_dress.models.sides import SIDES

SCENARIOS = sorted((Path(__file__).parents[2] / "scenarios").glob("*.yaml"))

ONE_OF_EVERYTHING = """
seed: 4
duration: 12.5
garment:
  coat: {preset: jacket, size: 48, size_table: men, scale: 1.1, chest: 1.2, collar: none}
  mesh: {file: a.obj, unit: cm, loops: {left_cuff: [1, 2, 3]}, grasp: {left: [4]}}
person:
  posture: sitting
  body: {sex: male, age: 50, height: 1.80, weight: 85.0, muscle: 0.5}
  measures: {shoulder_width: 0.4, waist_girth: 0.8, elbow_radius: 0.04}
  left_measures: {forearm_length: 0.3, wrist_girth: 0.16}
  right_measures: {hand_radius: 0.035}
  left_arm: {abduction_deg: 20.0}
  joints: {shoulder_stiffness: 3.0, elbow_limits_deg: [0, 120]}
  behaviour:
    kind: active
    following: {time_constant: 0.5, return_time_constant: 20.0}
    motions:
      - reach: {side: left, within: 0.3}
      - reach: {side: right, start: 5.0}
      - turn: {angle_deg: -20.0, duration: 2.0}
      - withdraw: {distance: 0.2}
      - wave: {side: left, frequency: 0.5}
    max_hand_speed: 0.6
    tremor: {amplitude: 0.01}
plant:
  spacing: 0.03
  time_step: 0.005
  integrator: projective_dynamics
  self_collision: true
  material: {friction: 0.5}
controller:
  spacing: 0.04
  material: {stretch_stiffness: 80}
  global_mpc: {period: 1.0, delay: 0.3, time_step: 0.1, horizon: 4, weights: {direction: 0.1}}
  predictor: constant_velocity
  weights: mine
  command_rate: 200.0
safety:
  force_limit: 15.0
  soft_force_limit: 5.0
  largest_distance: 0.7
  workspace: {low: [-2.0, -1.0, 0.5], high: [1, 1.0, 2.0]}
station: {kind: simulated, gripper: {max_speed: 0.1}, start: {height_offset: 0.1}}
variation: {arm_angle_deg: 5.0}
log: {rate: 10.0}
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "scenario.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_every_scenario_loads_and_says_what_it_shows(path: Path) -> None:
    assert isinstance(load_scenario(path), Scenario)
    assert path.read_text().startswith("# ")


@pytest.mark.parametrize("text", ["seed: 0", ONE_OF_EVERYTHING], ids=["defaults", "everything"])
def test_resolved_scenario_loads_to_the_same(tmp_path: Path, text: str) -> None:
    scenario = load_scenario(write(tmp_path, text))
    again = load_scenario(write(tmp_path, resolved_yaml(scenario)))
    assert again == scenario


def test_overrides_reach_every_depth(tmp_path: Path) -> None:
    path = write(tmp_path, "seed: 0")
    scenario = load_scenario(
        path, ["plant.material.friction=0.7", "duration=3", "garment.mesh.file=x.obj"], seed=5
    )
    assert scenario.plant.material.friction == 0.7
    assert scenario.duration == 3.0
    assert scenario.garment.mesh is not None
    assert scenario.garment.mesh.file == "x.obj"
    assert scenario.seed == 5


def numbers_below(schema: Any, key: str = "") -> Iterator[str]:
    """Yields the dotted key of every number that a type of the schema may contain."""
    inner = [t for t in typing.get_args(schema) if t is not type(None)]
    if dataclasses.is_dataclass(schema):
        for name, hint in typing.get_type_hints(schema).items():
            dotted = f"{key}.{name}" if key else name
            yield from numbers_below(SCHEMAS[dotted]() if dotted in SCHEMAS else hint, dotted)
    elif typing.get_origin(schema) is dict:
        names = {"loops": LOOP_NAMES, "joints": JOINT_NAMES}.get(key.rsplit(".")[-1], SIDES)
        for name in names:
            yield from numbers_below(inner[1], f"{key}.{name}")
    elif inner:
        yield from numbers_below(inner[0], key)
    elif schema in (int, float):
        yield key


def test_every_number_of_a_scenario_has_a_range() -> None:
    keys = list(numbers_below(Scenario))
    assert len(keys) > 200
    assert [key for key in keys if range_of(key) is None] == []


def test_every_default_is_within_its_range(tmp_path: Path) -> None:
    scenario = load_scenario(write(tmp_path, "seed: 0"))
    check_ranges("defaults", "", scenario)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("person: {measures: {forearm_length: 2.5}}", ["forearm_length", "0.1 to 0.55"]),
        ("person: {measures: {shoulder_height: 0.03}}", ["shoulder_height", "0.5 to 2.2"]),
        ("garment: {mesh: {file: a.obj, grasp: {left: [-4]}}}", ["grasp.left[0]", "-4"]),
        ("controller: {global_mpc: {weights: {corridor: 1e12}}}", ["weights.corridor", "1e+06"]),
    ],
)
def test_a_number_that_nothing_can_have_is_told(
    tmp_path: Path, text: str, words: list[str]
) -> None:
    with pytest.raises(UserError) as error:
        load_scenario(write(tmp_path, text))
    for word in words:
        assert word in str(error.value)


@pytest.mark.parametrize(
    ("key", "allowed"),
    [
        ("duration", (0.1, 86400.0)),
        ("lab.faults[3].duration", (0.0, 1e4)),
        ("person.behaviour.motions[0].turn.duration", (0.1, 60.0)),
        ("plant.material.no_such_key", None),
    ],
)
def test_the_longest_end_of_a_key_says_which_numbers_it_takes(
    key: str, allowed: tuple[float, float] | None
) -> None:
    assert range_of(key) == allowed


def test_old_name_of_the_force_limit_still_sets_it(tmp_path: Path) -> None:
    old = "controller.global_mpc.force_limit=12.5"
    scenario = load_scenario(write(tmp_path, "seed: 0"), [old])
    assert scenario.safety.force_limit == 12.5
    assert safety_limits(scenario.safety).hard_force == 12.5
    assert safety_limits(scenario.safety).soft_force == 6.25
    again = load_scenario(write(tmp_path, resolved_yaml(scenario)))
    assert again == scenario


def test_safety_group_reaches_the_limits(tmp_path: Path) -> None:
    limits = safety_limits(load_scenario(write(tmp_path, ONE_OF_EVERYTHING)).safety)
    assert (limits.soft_force, limits.hard_force, limits.largest_distance) == (5.0, 15.0, 0.7)
    assert limits.workspace is not None
    assert limits.workspace.tolist() == [[-2.0, -1.0, 0.5], [1.0, 1.0, 2.0]]
    defaults = safety_limits(load_scenario(write(tmp_path, "seed: 0")).safety)
    assert (defaults.soft_force, defaults.hard_force, defaults.workspace) == (8.5, 17.0, None)


def test_seed_alone_decides_what_varies(tmp_path: Path) -> None:
    text = "variation: {arm_angle_deg: 10, coat_scale: 0.05, plant_friction: 0.3}"
    path = write(tmp_path, text)
    first = apply_variation(load_scenario(path, seed=1))
    assert first == apply_variation(load_scenario(path, seed=1))
    assert first != apply_variation(load_scenario(path, seed=2))
    assert first.variation == Variation()
    assert abs(first.person.left_arm.abduction_deg - Arm().abduction_deg) <= 10.0
    assert 0.95 <= first.garment.coat.scale <= 1.05


# of limbs whose masses follow from their volumes
MASSES = {"upper_arm_mass": UPPER_ARM_MASS, "forearm_mass": FOREARM_MASS}
WIDTHS = st.fixed_dictionaries(
    {
        "coat_scale": st.floats(0.001, 0.05),
        "coat_measures": st.floats(0.001, 0.03),
        "person_scale": st.floats(0.001, 0.05),
        "person_measures": st.floats(0.001, 0.03),
    }
)


@settings(max_examples=25)
@given(WIDTHS, st.integers(0, 2**32), st.booleans())
def test_variation_acts_on_every_measure_and_within_its_width(
    widths: dict[str, float], seed: int, given_measures: bool
) -> None:
    scenario = Scenario(seed=seed)
    if given_measures:
        scenario.garment.coat = Coat(preset="blazer", chest=1.2, armhole_girth=0.56, cuff_girth=0.3)
    for name, width in widths.items():
        setattr(scenario.variation, name, width)
    drawn = apply_variation(scenario)
    for plain, varied, scale, own in (
        (
            coat_parameters(scenario.garment.coat).lengths,
            coat_parameters(drawn.garment.coat).lengths,
            widths["coat_scale"],
            widths["coat_measures"],
        ),
        (
            asdict(scenario.person.measures),
            asdict(drawn.person.measures),
            widths["person_scale"],
            widths["person_measures"],
        ),
    ):
        ratios = {}
        for name, before in plain.items():
            value = MASSES.get(name, before)
            if value is None:
                assert varied[name] == value
                continue
            power = 3 if name.endswith("mass") else 1
            ratios[name] = varied[name] / value
            assert ratios[name] != 1.0
            assert (1 - scale) ** power * (1 - own) <= ratios[name] * (1 + 1e-12)
            assert ratios[name] <= (1 + scale) ** power * (1 + own) * (1 + 1e-12)
        # each measure is drawn independently
        assert len(set(ratios.values())) == len(ratios)
    assert load_scenario_text(resolved_yaml(drawn)) == drawn


def load_scenario_text(text: str) -> Scenario:
    with TemporaryDirectory() as folder:
        return load_scenario(write(Path(folder), text))


@pytest.mark.parametrize("measures", [{}, {"chest": 1.1, "sleeve_length": 0.6}])
def test_scale_of_a_coat_acts_on_given_measures_too(measures: dict[str, Any]) -> None:
    plain = coat_parameters(Coat(preset="bathrobe", **measures))
    large = coat_parameters(Coat(preset="bathrobe", scale=1.1, **measures))
    assert plain.lengths.keys() == large.lengths.keys()
    for name, value in plain.lengths.items():
        assert large.lengths[name] == pytest.approx(1.1 * value)
    for name in ("grasp_fraction", "grasp_radius", "sleeve_slope_deg", "collar", "opens"):
        assert getattr(large, name) == getattr(plain, name)


def test_an_angle_of_a_coat_is_drawn_and_not_scaled() -> None:
    scenario = Scenario(seed=3)
    scenario.garment.coat = Coat(preset="gown")
    scenario.variation = Variation(coat_scale=0.2, coat_measures=0.02)
    drawn = apply_variation(scenario)
    assert drawn.garment.coat.scale != 1.0
    slope = coat_parameters(drawn.garment.coat).sleeve_slope_deg
    assert slope is not None
    assert 0.98 * 42.0 <= slope <= 1.02 * 42.0
    assert slope != 42.0


def test_a_measure_that_a_cut_lacks_is_not_drawn() -> None:
    scenario = Scenario(seed=3)
    scenario.garment.coat = Coat(preset="jacket")
    scenario.variation = Variation(coat_measures=0.02)
    coat = apply_variation(scenario).garment.coat
    assert (coat.hem_girth, coat.elbow_girth, coat.sleeve_slope_deg) == (None, None, None)


def test_a_size_gives_all_measures_and_given_ones_replace_its_own(tmp_path: Path) -> None:
    text = "garment: {coat: {preset: blazer, size: 40, size_table: women, chest: 1.3}}"
    coat = load_scenario(write(tmp_path, text)).garment.coat
    assert coat.size == "40"
    own = coat_parameters(coat)
    body = body_of_size("women", "40")
    expected = coat_of_size(COATS["blazer"], body).lengths | {"chest": 1.3}
    assert own.lengths == expected
    assert all(own.lengths[k] != v for k, v in COATS["blazer"].lengths.items())
    given = load_scenario(write(tmp_path, "seed: 0"), ["garment.coat.size=XL"]).garment.coat
    assert coat_parameters(given).chest > coat_parameters(Coat()).chest
    assert coat_parameters(Coat(size="M", scale=1.1)).chest == pytest.approx(
        1.1 * coat_parameters(Coat(size="M")).chest
    )


def test_an_unknown_size_is_told_with_those_of_its_table(tmp_path: Path) -> None:
    text = "garment: {coat: {size: 116, size_table: women}}"
    with pytest.raises(UserError, match=r"expected one of XS, S, M, .*, 60 for women") as caught:
        load_scenario(write(tmp_path, text))
    assert caught.value.key == "garment.coat.size"


def test_shape_of_a_coat_is_the_preset_s_unless_given() -> None:
    assert coat_parameters(Coat(preset="bathrobe")).collar == "shawl"
    assert coat_parameters(Coat(preset="bathrobe", collar="none")).collar == "none"
    assert coat_parameters(Coat(preset="gown")).opens == "back"
    assert coat_parameters(Coat(preset="gown", opens="front")).opens == "front"


def test_scale_of_a_mesh_file_is_drawn_with_the_coat_s(tmp_path: Path) -> None:
    text = "garment: {mesh: {file: coat.obj, scale: 2.0}}\nvariation: {coat_scale: 0.1}"
    drawn = apply_variation(load_scenario(write(tmp_path, text), seed=5))
    assert drawn.garment.mesh is not None
    assert drawn.garment.mesh.scale == pytest.approx(2.0 * drawn.garment.coat.scale)
    assert drawn.garment.mesh.scale != 2.0


def test_behaviour_of_a_scenario_is_what_the_person_gets(tmp_path: Path) -> None:
    scenario = load_scenario(write(tmp_path, ONE_OF_EVERYTHING))
    made = behaviour(scenario.person.behaviour, scenario.seed)
    assert made.kind == "active"
    assert made.turns
    assert made.seed == 4
    assert made.active.following == FollowingParameters(0.5, 0.3, 20.0)
    assert made.active.max_hand_speed == 0.6
    assert made.tremor == TremorParameters(0.01, 5.0)
    left, right, turn, withdraw, wave = made.motions
    assert left == Reach(0.0, ("left",), within=0.3)
    assert right == Reach(5.0, ("right",))
    assert turn == Turn(15.0, angle=np.deg2rad(-20.0), duration=2.0)
    assert withdraw == Withdraw(10.0, ("left", "right"), distance=0.2)
    assert wave == Wave(10.0, ("left",), frequency=0.5)


def test_who_is_said_nothing_of_is_a_dummy_that_is_believed_to_stay(tmp_path: Path) -> None:
    scenario = load_scenario(write(tmp_path, "seed: 0"))
    assert behaviour(scenario.person.behaviour, scenario.seed) == Behaviour()
    assert isinstance(predictor(scenario.controller, tmp_path), StillPredictor)
    other = load_scenario(write(tmp_path, "controller: {predictor: constant_velocity}"))
    assert isinstance(predictor(other.controller, tmp_path), ConstantVelocityPredictor)


@pytest.mark.parametrize("name", ["learned", "ridge", "recurrent"])
def test_trained_predictors_take_the_weights_that_the_scenario_names(
    tmp_path: Path, name: str
) -> None:
    """The folder is relative to the scenario; what cannot be used there is told."""
    text = f"controller: {{predictor: {name}, weights: mine}}"
    controller = load_scenario(write(tmp_path, text)).controller
    (tmp_path / "mine").mkdir()
    with pytest.raises(UserError, match=r"mine/\w+.safetensors: no such file"):
        predictor(controller, tmp_path)
    for file in SHIPPED.glob("*.safetensors"):
        weights = {key: 0.5 * array for key, array in load_file(file).items()}
        save_file(weights, tmp_path / "mine" / file.name)
    joints = 0.3 * np.random.default_rng(0).normal(size=(20, 6, 3))
    history = PersonHistory(0.0, joints, np.full((20, 2, 6), np.nan))
    mine, shipped = predictor(controller, tmp_path), PREDICTORS[name]()
    if isinstance(mine, PersonPredictor):
        assert isinstance(shipped, PersonPredictor)
        found, other = (p.forecast(history, p.begin())[0].radius for p in (mine, shipped))
    else:
        assert not isinstance(shipped, PersonPredictor)
        found, other = (p.predict(joints, 0.1, 5) for p in (mine, shipped))
    assert np.abs(found - other).max() > 1e-3


def test_motions_can_be_given_on_the_command_line(tmp_path: Path) -> None:
    scenario = load_scenario(
        write(tmp_path, "seed: 0"),
        ["person.behaviour.kind=active", "person.behaviour.motions=[{turn: {angle_deg: 10}}]"],
    )
    assert scenario.person.behaviour.motions[0].turn is not None
    assert scenario.person.behaviour.motions[0].turn.angle_deg == 10.0


def test_no_variation_changes_nothing(tmp_path: Path) -> None:
    scenario = load_scenario(write(tmp_path, ONE_OF_EVERYTHING.replace("5.0}\nlog", "0.0}\nlog")))
    assert apply_variation(scenario) == scenario
