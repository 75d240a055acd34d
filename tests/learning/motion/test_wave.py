"""A wave is a swing to and fro that begins and ends smoothly."""

import numpy as np

from drake_dress.learning.motion.wave import Wave, draw_wave


def test_a_wave_ends_where_it_begins_and_keeps_its_amplitude() -> None:
    wave = Wave(1.0, 4.0, amplitude=0.1, frequency=1.0)
    for time in (0.0, 1.0, 4.0, 5.0):
        np.testing.assert_array_equal(wave.position(time), np.zeros(3))
    sideways = np.array([wave.position(t)[1] for t in np.linspace(1.0, 4.0, 601)])
    assert 0.099 < sideways.max() <= 0.1
    assert -0.1 <= sideways.min() < -0.099
    # three cycles of 1 Hz in three seconds
    inside = sideways[np.abs(sideways) > 1e-9]
    assert np.count_nonzero(np.diff(np.sign(inside))) == 5


def test_a_wave_does_not_leap() -> None:
    for seed in range(20):
        wave = draw_wave(np.random.default_rng(seed), 2.0)
        times = np.linspace(1.9, wave.end + 0.1, 2000)
        speed = np.diff([wave.position(t)[1] for t in times]) / (times[1] - times[0])
        swelling = 15.0 / 8.0 / min(0.5, 0.25 * (wave.end - wave.start))
        limit = wave.amplitude * (2.0 * np.pi * wave.frequency + swelling)
        assert 0.0 < np.abs(speed).max() < limit
