"""Reads recordings of people: positions of shoulder, elbow and hand over time."""

from drake_dress.learning.recordings.reading import RecordingOptions, read_recording

__all__ = ["RecordingOptions", "read_recording"]
