"""What can be wrong with a source of messages, and a finding about one message."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag


class Fault(IntFlag):
    """What is wrong with a source."""

    NONE = 0
    STALE = 1  # nothing new for too long
    MALFORMED = 2  # bytes that are no message of this kind
    NOT_FINITE = 4  # a message with a number that is none
    WRONG_SIZE = 8  # a message of other joints, nodes, or cameras
    TIME_BACK = 16  # a stamp long before one that was heard
    CLOCK_JUMP = 32  # a stamp that went on by much more than time did
    JOINT_LIMIT = 64  # a joint outside what its maker allows
    SPEED_LIMIT = 128  # a joint faster than that
    STOPPED = 256  # the source itself reports that it does not follow
    IDLE = 512  # it reports that it follows no command yet, or no longer
    IMPOSSIBLE = 1024  # a person, garment or load that cannot be
    LEAP = 2048  # something that moved faster than it can since the last sound message
    FROZEN = 4096  # values that cannot stay the same to the last bit, and do
    UNSTAMPED = 8192  # a utime that nobody fills in


# After these nothing that follows can be put in order: the run ends.
FATAL = Fault.TIME_BACK | Fault.CLOCK_JUMP | Fault.JOINT_LIMIT | Fault.SPEED_LIMIT

# With these a message still tells where its source is.
TELLING = Fault.STOPPED | Fault.IDLE


@dataclass(frozen=True)
class Finding:
    """What a check found in one message.

    Attributes:
        fault: none where the message is sound.
        reason: what was refused, its value, and the bound; empty where the fault says it all.
    """

    fault: Fault = Fault.NONE
    reason: str = ""

    @property
    def usable(self) -> bool:
        """Whether the message's numbers may be used."""
        return not self.fault & ~TELLING


SOUND = Finding()
