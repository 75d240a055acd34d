"""Reads measured logs: HDF5 in the layout of `run.h5`, NPZ with the same names, and CSV.

A file holds one recording, or several in groups `recording_0`, `recording_1`, …. Names:

    time                                (T,) s, strictly increasing
    gripper/{left,right}/position       (T,3) m
    gripper/{left,right}/force          (T,3) N, of the garment on the gripper; optional
    garment/marker_position             (T,m,3) m, NaN where not seen
    garment/marker_rest_position        (m,3) m, garment frame; or garment/marker_node (m,)
    human/joint_position                (T,6,3) m; optional

The attributes of an HDF5 dataset are optional. `noise_std` is the standard deviation of its noise,
which is estimated without it. `unit` must be `m`, `N` or `s`, or that unit spelled out. `names`
identifies the points. A group's attribute `motion`, one word, is the name of the recording. A CSV
file has columns such as `gripper/left/position/x` and `garment/marker_position/12/z`, empty where a
marker was not seen. A file `NAME.markers.csv` beside it has the columns marker, x, y, z.

One module reads each format (`hdf5`, `npz`, `csv_file`) into a `RawRecording`. `assembling` turns
that into a `Recording`: it checks shapes, time stamps, units and plausibility, and removes faulty
marker values.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from drake_dress.discrepancy.reading.assembling import all_notes, recording_of
from drake_dress.discrepancy.reading.csv_file import read_csv
from drake_dress.discrepancy.reading.hdf5 import read_hdf5
from drake_dress.discrepancy.reading.npz import read_npz
from drake_dress.discrepancy.reading.raw import RawRecording
from drake_dress.discrepancy.recording import Recording
from drake_dress.errors import UserError
from drake_dress.models.garment.mesh import GarmentMesh

__all__ = ["all_notes", "read_recordings"]

_READERS: dict[str, Callable[[Path], list[RawRecording]]] = {
    ".h5": read_hdf5,
    ".hdf5": read_hdf5,
    ".npz": read_npz,
    ".csv": read_csv,
}
_FORMATS = ".h5, .hdf5, .npz or .csv"


def read_recordings(
    paths: Sequence[str | Path], mesh: GarmentMesh, surface_density: float | None = None
) -> list[Recording]:
    """Returns all recordings of all files.

    Args:
        paths: files.
        mesh: the scenario's garment. It carries the markers, and lengths are compared with it.
        surface_density: of the scenario's fabric, kg/m², with which forces are compared; None
            allows any fabric.

    Raises:
        UserError: a file cannot be used; the message says where and why.
    """
    recordings: list[Recording] = []
    opened: set[Path] = set()
    for given in paths:
        path = Path(given)
        reader = _reader(path)
        if path.resolve() in opened:
            raise UserError(str(path), "", "is given twice, expected each file once")
        opened.add(path.resolve())
        for raw in reader(path):
            r = recording_of(raw, mesh, surface_density)
            alike = sum(other.name.split(" ")[0] == raw.title for other in recordings)
            more = f" {alike + 1}" if alike else ""
            recordings.append(replace(r, name=raw.title + more) if raw.title else r)
    if not recordings:
        source = str(paths[0]) if paths else "MEASURED"
        raise UserError(source, "", "holds no recording, expected one or more")
    return recordings


def _reader(path: Path) -> Callable[[Path], list[RawRecording]]:
    """Returns a file's reader; raises UserError if it is missing, empty or of unknown kind."""
    source = str(path)
    try:
        if path.is_dir():
            raise UserError(source, "", "is a directory, expected a measured log")
        if not path.exists():
            raise UserError(source, "", "no such file, expected a measured log")
        if not path.is_file():
            raise UserError(source, "", "is not a regular file, expected a measured log")
        kind = path.suffix.lower()
        if kind not in _READERS:
            raise UserError(source, "", f"is of unknown kind {kind!r}, expected {_FORMATS}")
        if path.stat().st_size == 0:
            raise UserError(source, "", "is empty (0 bytes), expected a measured log")
        with path.open("rb"):
            pass
    except OSError as error:
        raise UserError(source, "", f"cannot be opened: {error.strerror or error}") from error
    return _READERS[kind]
