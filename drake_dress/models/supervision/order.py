"""Order of time stamps: which message is new, which is late, and which shows a clock set back.

    stamp after the newest one                       new
    the same, or before it by at most `late`         dropped: a repeated or overtaken packet
    0 after stamps that were not 0                   unstamped: the sender does not fill it in
    before it by more                                time back

A clock that is set back by at most `late` costs the messages of that time.
"""

from __future__ import annotations

from drake_dress.models.supervision.fault import SOUND, Fault, Finding

# Period of a 32-bit count of µs, s, and the tolerance for recognizing its rollover, s.
_ROLLOVER, _NEAR = 2.0**32 * 1e-6, 2.0


def order(stamp: float, newest: float | None, late: float) -> Finding | None:
    """Returns the finding about a message's time stamp; None if the message is to be dropped.

    Args:
        stamp: time stamp of the message, s of its source's clock.
        newest: greatest time stamp of a sound message so far, s; None before the first.
        late: time by which an overtaken message may be older than the newest one, s.
    """
    if newest is None or stamp > newest:
        return SOUND
    if newest - stamp <= late:
        return None
    if stamp == 0.0:
        return Finding(Fault.UNSTAMPED, f"utime is 0 after {newest:.3f} s, expected it to go on")
    back = newest - stamp
    why = "a clock that was set back, or a second sender on the channel"
    if abs(back - _ROLLOVER) < _NEAR:
        why = "a 32-bit count of µs that rolled over; utime has 64 bits"
    return Finding(
        Fault.TIME_BACK, f"utime went back by {back:.3f} s, expected {late:g} s at most: {why}"
    )
