import numpy as np
import pytest

from drake_dress.diagrams.scenario import load_scenario
from drake_dress.gym import DressingEnv
from drake_dress.models.garment.mesh import face_areas
from drake_dress.shipped import shipped_scenario
from tests.gym.small import small_env

GRAVITY = 9.81
REST = np.zeros((2, 3), dtype=np.float32)
FRONT = "station.cameras=[{name: front, position: [2, 0, 1.2], target: [0, 0, 1.1], width: 40}]"


def test_grippers_carry_the_weight_of_the_coat() -> None:
    env = small_env()
    env.reset(seed=0)
    for _ in range(25):
        seen, *_ = env.step(REST)
    mesh, material = env.parts.garments.plant, env.parts.setup.scenario.plant.material
    area = face_areas(mesh.rest_position, mesh.faces).sum()
    weight = GRAVITY * material.surface_density * area
    total = seen["gripper_force"].sum(axis=0)
    np.testing.assert_allclose(total, [0.0, 0.0, -weight], atol=0.03 * weight)
    assert not seen["person_force"].any()
    assert not seen["contact_force"].any()


def test_a_coat_that_is_drawn_against_the_back_presses_forward() -> None:
    env = small_env(["station.start.distance_behind=0.4"])
    env.reset(seed=0)
    for _ in range(60):
        seen, *_ = env.step(np.array([[0.1, 0.0, 0.0]] * 2, dtype=np.float32))
    assert seen["person_force"][0] > 0.5
    assert seen["gripper_force"][:, 0].max() < -0.2
    # the whole is no more than its parts together
    assert np.linalg.norm(seen["person_force"]) <= seen["contact_force"][0] + 1e-4


def test_what_is_observed_fits_together() -> None:
    env = small_env()
    seen, _ = env.reset(seed=0)
    mesh = env.parts.garments.belief
    x, joints = seen["garment_position"], seen["joint_position"]
    for i, side in enumerate(("left", "right")):
        held = x[mesh.grasp[side]].mean(axis=0)
        assert np.linalg.norm(held - seen["gripper_position"][i]) < 0.02
    # left is left, the coat hangs behind a person who faces +x, hands are below shoulders
    assert seen["gripper_position"][0, 1] > 0.1 > -0.1 > seen["gripper_position"][1, 1]
    assert x[:, 0].max() < joints[:, 0].max()
    assert (joints[[2, 5], 2] < joints[[0, 3], 2]).all()
    assert seen["time"] == 0.0
    assert not seen["linking"].any()
    assert not seen["stage"].any()


def test_velocities_are_those_of_the_positions() -> None:
    env = small_env()
    env.reset(seed=0)
    # up to speed first
    for _ in range(26):
        before, *_ = env.step(np.array([[0.0, 0.0, 0.1]] * 2, dtype=np.float32))
    after, *_ = env.step(np.array([[0.0, 0.0, 0.1]] * 2, dtype=np.float32))
    for name in ("gripper", "garment"):
        slope = (after[f"{name}_position"] - before[f"{name}_position"]) / env.control_period
        np.testing.assert_allclose(slope, after[f"{name}_velocity"], atol=0.05)
    assert after["time"] - before["time"] == pytest.approx(0.02, abs=1e-6)


def test_only_what_is_asked_for_is_observed() -> None:
    assert list(small_env(observe=["force"]).observation_space) == [
        "contact_force",
        "gripper_force",
        "person_force",
    ]
    scenario = load_scenario(shipped_scenario("dummy_standing"))
    assert not scenario.station.cameras
    view = small_env(observe=["color"]).observation_space
    assert {name: space.shape for name, space in view.items()} == {"view_color": (128, 128, 3)}
    front = small_env([FRONT], observe=["depth"], render_mode="rgb_array").observation_space
    assert {name: space.shape for name, space in front.items()} == {"front_depth": (240, 40, 1)}


def test_images_show_person_and_coat() -> None:
    env = DressingEnv(overrides=["plant.spacing=0.05", FRONT], observe=["color", "depth"])
    seen, _ = env.reset(seed=0)
    assert env.observation_space.contains(seen)
    depth = seen["front_depth"]
    # the person's front is 2 m less half a chest away; where nothing is, the depth is the greatest
    assert 1.6 < depth.min() < 2.0
    assert depth.max() == 5.0
    red, blue = (seen["front_color"][:, :, i].astype(int) for i in (0, 2))
    assert (red > blue + 20)[depth[:, :, 0] < 2.2].mean() > 0.5
