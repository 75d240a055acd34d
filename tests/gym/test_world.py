import numpy as np

from drake_dress.diagrams.scenario import load_scenario
from drake_dress.gym.world import World, draw
from drake_dress.shipped import shipped_scenario
from tests.gym.small import COARSE

SOURCE = shipped_scenario("dummy_varied")


def test_a_seed_draws_what_a_run_with_it_draws() -> None:
    drawn = draw(load_scenario(SOURCE, COARSE), 4)
    assert drawn == draw(load_scenario(SOURCE, COARSE, seed=4), 4)
    assert drawn.seed == 4
    assert drawn != draw(load_scenario(SOURCE, COARSE), 5)


def test_a_seed_that_draws_nothing_counts_only_where_a_person_trembles() -> None:
    source = shipped_scenario("active_standing")
    for tremor, same in (("", True), ("person.behaviour.tremor={}", False)):
        nominal = load_scenario(source, [*COARSE, *filter(None, [tremor])])
        world = World(draw(nominal, 1), nominal, source)
        assert world.is_of(draw(nominal, 1))
        assert world.is_of(draw(nominal, 2)) == same


def test_a_world_that_is_restarted_is_as_new() -> None:
    nominal = load_scenario(SOURCE, COARSE)
    worlds = [World(draw(nominal, 1), nominal, SOURCE) for _ in range(2)]
    velocity = np.array([[0.1, 0.0, 0.0], [0.1, 0.0, 0.05]])
    worlds[0].advance(-velocity, 7)
    worlds[0].restart()
    first, second = (w.advance(velocity, 10) for w in worlds)
    np.testing.assert_array_equal(first.loads.gripper_force, second.loads.gripper_force)
    ports = ("cheat_garment_position", "estimate.garment_velocity", "cheat_joint_position")
    for port in ports:
        np.testing.assert_array_equal(worlds[0].value(port), worlds[1].value(port))
    assert worlds[0].time == worlds[1].time == 0.1
