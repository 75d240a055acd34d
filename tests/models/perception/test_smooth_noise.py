import numpy as np
import pytest

from drake_dress.models.perception.smooth_noise import smooth_noise

SHAPE = (600, 800)


@pytest.mark.parametrize("width", [0.0, 0.5, 1.5, 6.0])
def test_noise_has_unit_deviation_and_neighbours_within_its_width_are_alike(width: float) -> None:
    noise = smooth_noise(np.random.default_rng(0), SHAPE, width)
    assert noise.shape == SHAPE
    assert noise.std() == pytest.approx(1.0, abs=0.06)
    assert abs(noise.mean()) < 0.1
    away = max(round(2.0 * width), 1)
    alike = np.mean(noise[:, away:] * noise[:, :-away])
    # two Gaussians that are two widths apart overlap by 1/e; half a pixel is less than a Gaussian
    expected = {0.0: 0.0, 0.5: 0.26}.get(width, np.exp(-1.0))
    assert alike == pytest.approx(expected, abs=0.06)


def test_the_generator_advances_by_the_size_of_the_image_alone() -> None:
    one, two = (np.random.default_rng(3) for _ in range(2))
    smooth_noise(one, SHAPE, 0.0)
    smooth_noise(two, SHAPE, 9.0)
    assert one.random() == two.random()
