import numpy as np
import pytest

from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.sections.station import cameras
from drake_dress.diagrams.setup import station_parameters
from drake_dress.diagrams.station import hung_garment
from drake_dress.gym.views import view_of
from drake_dress.models.human.body import arm_points
from drake_dress.shipped import shipped_scenario


@pytest.mark.parametrize(
    "name", ["dummy_standing", "dummy_sitting", "dummy_overcoat", "gown_front"]
)
def test_both_hands_and_the_whole_coat_are_in_the_image(name: str) -> None:
    source = shipped_scenario(name)
    scenario = load_scenario(source)
    scenario.station.cameras.append(view_of(scenario, "view", 200, 100))
    (camera,) = cameras(scenario.station.cameras)
    p = station_parameters(scenario, build_garment(scenario.garment, 0.05, source.parent))
    arms = [arm_points(p.measures, p.posture, side, p.arms[side]) for side in p.arms]
    points = np.concatenate([hung_garment(p), *arms])
    seen = camera.pose.inverse().multiply(points.T)
    assert (seen[2] > 0.5).all()
    pixel = camera.info.intrinsic_matrix() @ (seen / seen[2])
    assert (pixel[:2].min(axis=1) > 0.0).all()
    assert (pixel[:2].max(axis=1) < [200, 100]).all()
