"""Faults of a source of messages, and the finding of a check on one message."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag


class Fault(IntFlag):
    """Faults of a source."""

    NONE = 0
    STALE = 1  # nothing new for too long
    MALFORMED = 2  # bytes that are not a message of this kind
    NOT_FINITE = 4  # a message with a value that is not finite
    WRONG_SIZE = 8  # a message with other joints, nodes, or cameras
    TIME_BACK = 16  # a time stamp long before an earlier one
    CLOCK_JUMP = 32  # a time stamp that advanced much more than time did
    JOINT_LIMIT = 64  # a joint outside the manufacturer's limits
    SPEED_LIMIT = 128  # a joint faster than the manufacturer's limit
    STOPPED = 256  # the source itself reports that it does not follow commands
    IDLE = 512  # the source reports that it follows no command yet, or no longer
    IMPOSSIBLE = 1024  # a person, garment or load that is not possible
    LEAP = 2048  # motion since the last sound message that is faster than possible
    FROZEN = 4096  # values that stay the same to the last bit although they cannot
    UNSTAMPED = 8192  # a utime that is never filled in


# These faults cannot be recovered from: the run ends.
FATAL = Fault.TIME_BACK | Fault.CLOCK_JUMP | Fault.JOINT_LIMIT | Fault.SPEED_LIMIT

# A message with these faults still gives the state of its source.
TELLING = Fault.STOPPED | Fault.IDLE


@dataclass(frozen=True)
class Finding:
    """Result of a check on one message.

    Attributes:
        fault: NONE if the message is sound.
        reason: what was rejected, its value, and the bound; empty if the fault is explanation
            enough.
    """

    fault: Fault = Fault.NONE
    reason: str = ""

    @property
    def usable(self) -> bool:
        """Whether the message's numbers may be used."""
        return not self.fault & ~TELLING


SOUND = Finding()
