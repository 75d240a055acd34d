"""Reads recordings of people: positions of shoulder, elbow and hand over time."""

from drake_dress.learning.recordings.listed import Listed, listed, read_all
from drake_dress.learning.recordings.reading import RecordingOptions, read_recording

__all__ = ["Listed", "RecordingOptions", "listed", "read_all", "read_recording"]
