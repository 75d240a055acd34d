"""Tremor: an involuntary shaking of the arms.

Frequencies: Parkinsonian rest tremor 4 to 6 Hz, essential tremor 4 to 12 Hz (Deuschl, Bain, Brin,
"Consensus statement of the Movement Disorder Society on tremor", 1998). Amplitudes at the hand:
under 0.5 cm is slight, to 1 cm moderate, to 2 cm marked (rating scale of Fahn, Tolosa and Marín,
1993). Torques at the elbow and about the upper arm's axis drive the tremor. Their size follows from
the arm's inertia, damping and stiffness at that frequency. Amplitude and frequency drift slowly, so
the tremor is not a pure sine.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray

# Relative driving torques: abduction, extension, rotation, elbow.
_DRIVE = np.array([0.0, 0.0, 1.0, 1.0])
_WANDERING_AMPLITUDE = 0.15  # standard deviation, relative
_WANDERING_FREQUENCY = 0.02  # likewise
_SLOWEST, _FASTEST = 0.1, 0.5  # of the drift, Hz
_TONES = 8
_SIZE = np.sqrt(2.0 / _TONES)  # of a tone, so that the variance is 1


@dataclass(frozen=True)
class TremorParameters:
    """Parameters of the hands' tremor.

    Attributes:
        amplitude: half of the hand's peak-to-peak motion in the rest pose, m.
        frequency: frequency of the tremor, Hz.

    Raises:
        UserError: a value is not a finite number, the amplitude is negative, or the frequency is
            not positive.
    """

    amplitude: float = 0.005
    frequency: float = 5.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.amplitude) and self.amplitude >= 0.0):
            raise UserError(
                "person.tremor", "amplitude", f"is {self.amplitude} m, expected 0 or more"
            )
        if not (np.isfinite(self.frequency) and self.frequency > 0.0):
            raise UserError(
                "person.tremor", "frequency", f"is {self.frequency} Hz, expected more than 0"
            )


class Wandering:
    """A smooth random function of time with mean 0 and variance 1: tones of random phase.

    Source: Rice (1944), representation of Gaussian noise by tones. The value depends on the time
    alone, not on earlier calls.

    Attributes:
        omega: (n,) of the tones, rad/s.
        phase: (n,) of the tones, rad.

    Args:
        rng: draws frequencies and phases.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self.omega = 2.0 * np.pi * rng.uniform(_SLOWEST, _FASTEST, _TONES)
        self.phase = rng.uniform(0.0, 2.0 * np.pi, _TONES)

    def value(self, time: float) -> float:
        """Returns the function at `time`, s."""
        return float(_SIZE * np.sum(np.cos(self.omega * time + self.phase)))

    def integral(self, time: float) -> float:
        """Returns the integral from a fixed time to `time`, s."""
        return float(_SIZE * np.sum(np.sin(self.omega * time + self.phase) / self.omega))


class Wanderings:
    """Independent functions as `Wandering`, evaluated together.

    Args:
        rng: draws frequencies and phases.
        count: number of functions.
    """

    def __init__(self, rng: np.random.Generator, count: int) -> None:
        each = [Wandering(rng) for _ in range(count)]
        self._omega = np.stack([w.omega for w in each])
        self._phase = np.stack([w.phase for w in each])

    def value(self, time: float) -> FloatArray:
        """Returns the functions (count,) at `time`, s."""
        value: FloatArray = _SIZE * np.cos(self._omega * time + self._phase).sum(axis=1)
        return value


class TremorWave:
    """Tremor of one arm over time, with mean amplitude 1.

    Args:
        frequency: mean frequency, Hz.
        rng: draws phase and drift.
    """

    def __init__(self, frequency: float, rng: np.random.Generator) -> None:
        self._frequency = frequency
        self._phase = rng.uniform(0.0, 2.0 * np.pi)
        self._louder, self._faster = Wandering(rng), Wandering(rng)

    def value(self, time: float) -> float:
        """Returns the wave at `time`, s: (1 + 0.15 n₁) sin 2π(f t + 0.02 f ∫n₂)."""
        cycles = time + _WANDERING_FREQUENCY * self._faster.integral(time)
        amplitude = max(0.0, 1.0 + _WANDERING_AMPLITUDE * self._louder.value(time))
        return float(amplitude * np.sin(2.0 * np.pi * self._frequency * cycles + self._phase))


def tremor_torque(
    p: TremorParameters,
    mass: FloatArray,
    damping: FloatArray,
    stiffness: FloatArray,
    jacobian: FloatArray,
) -> FloatArray:
    """Returns the amplitude (4,), N·m, of the joint torques that cause the tremor `p` of a hand.

    Args:
        p: amplitude and frequency.
        mass: M (4,4) of the arm in its rest pose, kg·m².
        damping: D (4,), N·m·s/rad.
        stiffness: K (4,4), gravity's included, N·m/rad.
        jacobian: J (3,4) of the hand, m/rad.
    """
    return driving_torque(_DRIVE, p.amplitude, p.frequency, mass, damping, stiffness, jacobian)


def driving_torque(
    drive: FloatArray,
    amplitude: float,
    frequency: float,
    mass: FloatArray,
    damping: FloatArray,
    stiffness: FloatArray,
    jacobian: FloatArray,
) -> FloatArray:
    """Returns the amplitude (4,), N·m, of the joint torques that swing a hand.

    x = J (K − ω²M + iωD)⁻¹ τ describes the hand's ellipse; its semi-major axis is the amplitude.

    Args:
        drive: (4,) relative torques of the joints.
        amplitude: of the hand, m.
        frequency: Hz.
        mass: M (4,4) of the arm in its rest pose, kg·m².
        damping: D (4,), N·m·s/rad.
        stiffness: K (4,4), gravity's included, N·m/rad.
        jacobian: J (3,4) of the hand, m/rad.
    """
    omega = 2.0 * np.pi * frequency
    dynamic = stiffness - omega**2 * mass + 1j * omega * np.diag(damping)
    hand = jacobian @ np.linalg.solve(dynamic, drive)
    longest = np.linalg.svd(np.stack([hand.real, hand.imag]), compute_uv=False)[0]
    torque: FloatArray = amplitude / longest * drive
    return torque
