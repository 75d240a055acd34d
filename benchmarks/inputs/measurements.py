"""Random mutations of measured logs: HDF5, NPZ and CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from benchmarks.inputs.damage import KINDS, damage
from benchmarks.inputs.trials import Expect, Trial, place
from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.discrepancy.reading import read_recordings
from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES

Rng = np.random.Generator
Data = dict[str, npt.NDArray[Any]]
_SCENARIO = Path(__file__).parents[2] / "scenarios" / "measured.yaml"
_MARKERS, _REST = "garment/marker_position", "garment/marker_rest_position"
_JOINTS, _TIME = "human/joint_position", "time"
_GRIPPERS = tuple(f"gripper/{side}/position" for side in SIDES)
_FORCES = tuple(f"gripper/{side}/force" for side in SIDES)
# Permitted error of a damaged marker that is accepted, m: larger spikes are distinguished from
# motion, see docs/explain.md.
_OFF = 0.06


@dataclass
class _Log:
    """Content of a file to write.

    Attributes:
        data: Arrays by name.
        noise: `noise_std` by name; values other than numbers are written unchanged.
        spoilt: (T,m) markers that a reader must treat as not seen, or refuse.
        units: Attribute `unit` by name.
    """

    data: Data
    noise: dict[str, Any] = field(default_factory=dict)
    spoilt: BoolArray | None = None
    units: dict[str, str] = field(default_factory=dict)


def draw_measurement(rng: Rng) -> Trial:
    """Returns a mutation of a valid measured log."""
    suffix = _pick(rng, ("h5", "npz", "csv"))
    path = place() / f"measured.{suffix}"
    beside = path.with_suffix(".markers.csv")
    beside.unlink(missing_ok=True)
    log = _sound()
    how = _pick(rng, ("content", "content", "bytes", suffix))
    expect = Expect.EITHER
    if how == "content":
        mutate = _pick(rng, _CONTENT)
        told, expect = mutate(rng, log)
        if suffix == "csv" and mutate is _shape:
            # only rows with all columns are written, which may leave a valid log
            expect = Expect.EITHER
        told = f"{mutate.__name__[1:]} {told}"
        _write(log, path)
    elif how == "bytes":
        _write(log, path)
        target = beside if suffix == "csv" and rng.random() < 0.3 else path
        told, data = _damaged(rng, target.read_bytes())
        target.write_bytes(data)
    else:
        mutate = _pick(rng, {"h5": _HDF5, "npz": _NPZ, "csv": _CSV}[suffix])
        told, expect = mutate(rng, log, path)
        told = f"{mutate.__name__[1:]} {told}"
    whole = _sound().data[_MARKERS]
    # a CSV file may have fewer rows, see above
    cut = suffix == "csv" and told.startswith("shape")

    def use() -> str | None:
        [recording] = read_recordings([path], _garment())
        seen = recording.marker_position
        reference = whole[: len(seen)] if cut else whole
        if seen.shape != reference.shape:
            return f"markers of shape {seen.shape}"
        if how == "bytes":
            return _far_off(seen, reference)
        if seen.shape[0] != len(recording.time):
            return f"{len(recording.time)} times of {seen.shape[0]} samples"
        wrong = _believed(seen, log.spoilt)
        if wrong is None and expect is Expect.ACCEPT:
            wrong = _lost(seen, reference, log.spoilt)
        return wrong

    return Trial(f"{suffix} {told}", expect, use)


def _far_off(seen: FloatArray, reference: FloatArray) -> str | None:
    # flipped bits may change a number by as little as noise does
    off = np.linalg.norm(seen - reference, axis=2)
    worst = float(np.nanmax(off)) if np.isfinite(off).any() else 0.0
    return f"a marker {worst:.3g} m off" if worst > _OFF else None


def _believed(seen: FloatArray, spoilt: BoolArray | None) -> str | None:
    if spoilt is None or not np.isfinite(seen[spoilt]).any():
        return None
    return f"{int(np.isfinite(seen[spoilt]).all(axis=-1).sum())} spoilt samples believed"


def _lost(seen: FloatArray, reference: FloatArray, spoilt: BoolArray | None) -> str | None:
    good = np.asarray(np.isfinite(reference).all(axis=2))
    if spoilt is not None:
        good &= ~spoilt
    kept = np.isfinite(seen).all(axis=2) & good
    if kept.sum() < 0.97 * good.sum():
        return f"{int(good.sum() - kept.sum())} of {int(good.sum())} sound samples dropped"
    if not np.allclose(seen[kept], reference[kept], atol=1e-5):
        return "other marker positions"
    return None


def prepare(folder: Path) -> None:
    """Creates the valid recording that all mutations start from, in a folder shared by workers."""
    from drake_dress.discrepancy.commands import write_dataset

    if not (folder / "measured.h5").exists():
        write_dataset("nothing", 1, folder, str(_SCENARIO), motions=("sway",))


def use_base(folder: Path) -> None:
    """Selects the recording created by `prepare`."""
    _BASE.append(folder / "measured.h5")


_BASE: list[Path] = []


@cache
def _garment() -> GarmentMesh:
    scenario = load_scenario(_SCENARIO)
    return build_garment(scenario.garment, scenario.plant.spacing, _SCENARIO.parent)


@cache
def _read_base() -> _Log:
    data: Data = {}
    noise: dict[str, Any] = {}
    units: dict[str, str] = {}
    with h5py.File(_BASE[-1], "r") as file:
        group = file["recording_0"]
        for name in (_TIME, *_GRIPPERS, *_FORCES, _MARKERS, _REST, _JOINTS):
            data[name] = np.asarray(group[name])
            units[name] = str(group[name].attrs["unit"])
            if "noise_std" in group[name].attrs:
                noise[name] = float(group[name].attrs["noise_std"])
    return _Log(data, noise, None, units)


def _sound() -> _Log:
    return deepcopy(_read_base())


def _pick(rng: Rng, items: Sequence[Any] | npt.NDArray[Any]) -> Any:
    return items[int(rng.integers(len(items)))]


_Told = tuple[str, Expect]


def _scaled(rng: Rng, log: _Log) -> _Told:
    names = _pick(rng, ((_MARKERS,), (_REST,), _GRIPPERS, _FORCES, (_JOINTS,), (_TIME,)))
    factors = (1000.0, 100.0, 1e-3, 39.37)
    if names == _FORCES:
        factors = (1000.0, 101.97, 1e-3, 0.10197)
    elif names == (_TIME,):
        factors = (1000.0, 1e6, 1e9, 1e-3)
    factor = _pick(rng, factors)
    for name in names:
        log.data[name] = log.data[name] * factor
    return f"{names[0]} x {factor:g}", Expect.REFUSE


def _all_scaled(rng: Rng, log: _Log) -> _Told:
    factor = _pick(rng, (1000.0, 100.0, 1e-3, 39.37))
    for name in (_MARKERS, _REST, *_GRIPPERS, _JOINTS):
        log.data[name] = log.data[name] * factor
    return f"x {factor:g}", Expect.REFUSE


def _y_up(rng: Rng, log: _Log) -> _Told:
    """Rotates the world about x, as in a motion-capture system with y up."""
    turn = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0.0]])
    for name in (_MARKERS, *_GRIPPERS, *_FORCES, _JOINTS):
        log.data[name] = log.data[name] @ turn.T
    return "", Expect.REFUSE


def _force_sign(rng: Rng, log: _Log) -> _Told:
    for name in _FORCES:
        log.data[name] = -log.data[name]
    return "", Expect.REFUSE


def _frame_numbers(rng: Rng, log: _Log) -> _Told:
    log.data[_TIME] = np.arange(len(log.data[_TIME]), dtype=float)
    return "", Expect.REFUSE


def _epoch(rng: Rng, log: _Log) -> _Told:
    log.data[_TIME] = log.data[_TIME] + 1.7e9
    return "", Expect.ACCEPT


def _gap(rng: Rng, log: _Log) -> _Told:
    k, gap = int(rng.integers(5, len(log.data[_TIME]) - 5)), _pick(rng, (86400.0, 3600.0, 30.0))
    log.data[_TIME][k:] += gap
    return f"{gap:g} s", Expect.REFUSE


def _clock(rng: Rng, log: _Log) -> _Told:
    time = log.data[_TIME]
    k = int(rng.integers(1, len(time)))
    how = _pick(rng, ("repeated", "back", "nan", "inf", "reversed", "constant", "short", "one"))
    if how == "repeated":
        time[k] = time[k - 1]
    elif how == "back":
        time[k:] -= 1.0
    elif how in ("nan", "inf"):
        time[k] = float(how)
    elif how == "reversed":
        log.data[_TIME] = time[::-1].copy()
    elif how == "constant":
        time[:] = 0.0
    else:
        count = 15 if how == "short" else 1
        for name in log.data:
            if name != _REST:
                log.data[name] = log.data[name][:count]
    return how, Expect.REFUSE


def _spoil(rng: Rng, log: _Log, longest: int) -> tuple[int, slice]:
    """Draws a marker and a range of samples, and marks them as spoilt."""
    markers = log.data[_MARKERS]
    count, number = markers.shape[:2]
    marker, length = int(rng.integers(number)), int(rng.integers(1, longest))
    begin = int(rng.integers(5, count - length - 5))
    if log.spoilt is None:
        log.spoilt = np.zeros((count, number), dtype=bool)
    log.spoilt[begin : begin + length, marker] = True
    return marker, slice(begin, begin + length)


def _lost_as(rng: Rng, log: _Log) -> _Told:
    value = _pick(rng, (0.0, -9999.0, 9999.0, 1e6, -1.0, 999.0, 1e30, np.inf))
    for _ in range(int(rng.integers(1, 12))):
        marker, stretch = _spoil(rng, log, 60)
        log.data[_MARKERS][stretch, marker] = value
    return f"{value:g}", Expect.EITHER if np.isinf(value) else Expect.ACCEPT


def _spike(rng: Rng, log: _Log) -> _Told:
    size = float(rng.uniform(0.1, 3.0))
    marker, stretch = _spoil(rng, log, 3)
    log.data[_MARKERS][stretch, marker] += size * np.eye(3)[rng.integers(3)]
    return f"{size:.2f} m", Expect.ACCEPT


def _label_swap(rng: Rng, log: _Log) -> _Told:
    """Swaps two sufficiently distant markers, temporarily or until the end."""
    markers = log.data[_MARKERS]
    rest = log.data[_REST]
    a = int(rng.integers(len(rest)))
    far = np.flatnonzero(np.linalg.norm(rest - rest[a], axis=1) > 0.15)
    b = int(_pick(rng, far))
    begin = int(rng.integers(20, len(markers) - 60))
    end = _pick(rng, (begin + int(rng.integers(5, 50)), len(markers)))
    markers[begin:end, [a, b]] = markers[begin:end, [b, a]]
    log.spoilt = np.zeros(markers.shape[:2], dtype=bool)
    log.spoilt[begin:end, [a, b]] = True
    # the reader may undo a lasting swap by renaming, which shows as different positions
    return f"{a}, {b} for {end - begin}", Expect.EITHER


def _other_labels(rng: Rng, log: _Log) -> _Told:
    """Shuffles the rest positions relative to the markers."""
    log.data[_REST] = log.data[_REST][rng.permutation(len(log.data[_REST]))]
    return "", Expect.REFUSE


def _not_finite(rng: Rng, log: _Log) -> _Told:
    name = _pick(rng, (_TIME, *_GRIPPERS, _REST, _JOINTS))
    flat = log.data[name].reshape(-1)
    flat[rng.integers(flat.size)] = _pick(rng, (np.nan, np.inf, 1e300))
    return name, Expect.REFUSE


def _missing(rng: Rng, log: _Log) -> _Told:
    name = _pick(rng, (_TIME, *_GRIPPERS, _MARKERS, _REST))
    del log.data[name]
    return name, Expect.REFUSE


def _misspelt(rng: Rng, log: _Log) -> _Told:
    name = _pick(rng, (_TIME, *_GRIPPERS, _MARKERS, _REST))
    log.data[name + "s"] = log.data.pop(name)
    return name, Expect.REFUSE


def _shape(rng: Rng, log: _Log) -> _Told:
    name = _pick(rng, tuple(log.data))
    value = log.data[name]
    how = _pick(rng, ("short", "column", "flat", "axis", "empty"))
    if how == "short":
        value = value[:-1]
    elif how == "column":
        value = value[..., None]
    elif how == "flat":
        value = value.ravel()[:-1]
    elif how == "axis":
        value = value[..., :2] if value.ndim > 1 else value[::2]
    else:
        value = value[:0]
    log.data[name] = value
    return f"{name} {how}", Expect.REFUSE


def _swapped_joints(rng: Rng, log: _Log) -> _Told:
    log.data[_JOINTS] = log.data[_JOINTS][:, [3, 4, 5, 0, 1, 2]]
    return "", Expect.REFUSE


def _impossible_joints(rng: Rng, log: _Log) -> _Told:
    joints = log.data[_JOINTS]
    how = _pick(rng, ("zeros", "hand zero", "long limb"))
    if how == "zeros":
        joints[:] = 0.0
    elif how == "hand zero":
        joints[:, _pick(rng, (2, 5))] = 0.0
    else:
        joints[:, 2] += 3.0 * (joints[:, 2] - joints[:, 1])
    return how, Expect.REFUSE


def _extra(rng: Rng, log: _Log) -> _Told:
    log.data["arm/left/q"] = np.zeros((len(log.data[_TIME]), 7))
    return "", Expect.ACCEPT


_CONTENT: tuple[Callable[[Rng, _Log], _Told], ...] = (
    _scaled,
    _scaled,
    _all_scaled,
    _y_up,
    _force_sign,
    _frame_numbers,
    _epoch,
    _gap,
    _clock,
    _lost_as,
    _lost_as,
    _spike,
    _label_swap,
    _other_labels,
    _not_finite,
    _missing,
    _misspelt,
    _shape,
    _swapped_joints,
    _impossible_joints,
    _extra,
)


def _write(log: _Log, path: Path) -> None:
    {".h5": _write_hdf5, ".npz": _write_npz, ".csv": _write_csv}[path.suffix](log, path)


def _write_hdf5(log: _Log, path: Path, **options: Any) -> None:
    with h5py.File(path, "w") as file:
        for name, value in log.data.items():
            data = file.create_dataset(name, data=value, **options)
            if name in log.noise:
                data.attrs["noise_std"] = log.noise[name]
            if name in log.units:
                data.attrs["unit"] = log.units[name]


def _write_npz(log: _Log, path: Path) -> None:
    noise = {f"{name}/noise_std": np.asarray(v) for name, v in log.noise.items()}
    arrays: dict[str, Any] = {**log.data, **noise}
    np.savez(path, **arrays)


def _rows(log: _Log) -> list[list[str]]:
    header, columns = [], []
    for name, value in log.data.items():
        if name == _REST:
            continue
        flat = value.reshape(len(value), int(np.prod(value.shape[1:])))
        if value.ndim == 1:
            header.append(name)
        elif value.ndim == 2:
            header += [f"{name}/{'xyzabcdefg'[k]}" for k in range(value.shape[1])]
        else:
            header += [
                f"{name}/{k}/{a}" for k in range(value.shape[1]) for a in "xyzw"[: value.shape[2]]
            ]
        columns.append(flat)
    count = min((len(c) for c in columns), default=0)
    width = [c.shape[1] for c in columns]
    table = np.hstack([c[:count] for c in columns]) if sum(width) else np.zeros((0, 0))
    return [header[: table.shape[1]]] + [
        [
            "" if np.isnan(x) else repr(round(float(x), 7)) if abs(x) < 1e6 else repr(float(x))
            for x in row
        ]
        for row in table
    ]


def _text(rows: list[list[str]], delimiter: str = ",") -> str:
    out = io.StringIO()
    csv.writer(out, delimiter=delimiter).writerows(rows)
    return out.getvalue()


def _places(log: _Log) -> list[list[str]]:
    rest = log.data.get(_REST)
    if rest is None:
        return []
    table = np.atleast_2d(rest)
    return [["marker", "x", "y", "z"]] + [
        [str(k), *(repr(float(x)) for x in np.ravel(row))] for k, row in enumerate(table)
    ]


def _write_csv(log: _Log, path: Path) -> None:
    path.write_text(_text(_rows(log)))
    if _REST in log.data:
        path.with_suffix(".markers.csv").write_text(_text(_places(log)))


def _damaged(rng: Rng, sound: bytes) -> tuple[str, bytes]:
    how = _pick(rng, KINDS)
    return how, bytes(damage(rng, bytearray(sound), how, most=10, zeroed=64))


def _attribute(rng: Rng, log: _Log, path: Path) -> _Told:
    value = _pick(rng, ("loud", np.nan, -1.0, 0.0, np.inf, 1e9, np.zeros(0), b"\xff"))
    log.noise[_MARKERS] = value
    _write_hdf5(log, path)
    return repr(value), Expect.REFUSE


def _unit(rng: Rng, log: _Log, path: Path) -> _Told:
    name = _pick(rng, (_MARKERS, *_GRIPPERS, _TIME, *_FORCES))
    log.units[name] = unit = _pick(rng, ("mm", "ms", "inch", "lbf"))
    _write_hdf5(log, path)
    return f"{name} {unit}", Expect.REFUSE


def _link(rng: Rng, log: _Log, path: Path) -> _Told:
    name = _pick(rng, (_TIME, *_GRIPPERS, _MARKERS, _REST))
    del log.data[name]
    _write_hdf5(log, path)
    with h5py.File(path, "a") as file:
        how = _pick(rng, ("soft", "external", "group", "self"))
        if how == "soft":
            file[name] = h5py.SoftLink("/nowhere")
        elif how == "external":
            file[name] = h5py.ExternalLink("nowhere.h5", "/x")
        elif how == "self":
            file[name] = h5py.SoftLink(f"/{name}")
        else:
            file.create_group(name)
    return f"{name} {how}", Expect.REFUSE


def _strings(rng: Rng, log: _Log, path: Path) -> _Told:
    name = _pick(rng, (_TIME, *_GRIPPERS, _MARKERS, _REST))
    shape = log.data.pop(name).shape
    _write_hdf5(log, path)
    with h5py.File(path, "a") as file:
        how = _pick(rng, ("text", "compound", "empty", "complex"))
        if how == "text":
            file.create_dataset(name, shape, dtype=h5py.string_dtype())
        elif how == "compound":
            file.create_dataset(name, shape, dtype=[("a", "f8"), ("b", "i4")])
        elif how == "complex":
            file.create_dataset(name, shape, dtype="c16")
        else:
            file[name] = h5py.Empty("f8")
    return f"{name} {how}", Expect.REFUSE


def _damaged_chunk(rng: Rng, log: _Log, path: Path) -> _Told:
    _write_hdf5(log, path, compression="gzip", shuffle=True)
    with h5py.File(path, "r") as file:
        name = _pick(rng, (_TIME, *_GRIPPERS, _MARKERS, _REST))
        chunk = file[name].id.get_chunk_info(0)
    data = bytearray(path.read_bytes())
    k = chunk.byte_offset + int(rng.integers(2, max(3, chunk.size - 8)))
    data[k : k + 4] = rng.bytes(4)
    path.write_bytes(bytes(data))
    # damage outside a checksum may pass, but must not change the values
    return name, Expect.EITHER


def _filter(rng: Rng, log: _Log, path: Path) -> _Told:
    name = _pick(rng, (_TIME, *_GRIPPERS, _MARKERS, _REST))
    value = log.data.pop(name)
    _write_hdf5(log, path)
    with h5py.File(path, "a") as file:
        plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plist.set_chunk(value.shape)
        plist.set_filter(32001, h5py.h5z.FLAG_OPTIONAL, (0, 0, 0, 0, 5, 1, 1))
        parent, _, last = name.rpartition("/")
        group = file.require_group(parent) if parent else file
        space = h5py.h5s.create_simple(value.shape)
        made = h5py.h5d.create(group.id, last.encode(), h5py.h5t.IEEE_F64LE, space, plist)
        made.write_direct_chunk((0,) * value.ndim, rng.bytes(200))
    return name, Expect.REFUSE


_HDF5: tuple[Callable[[Rng, _Log, Path], _Told], ...] = (
    _attribute,
    _unit,
    _link,
    _strings,
    _damaged_chunk,
    _filter,
)


def _not_npz(rng: Rng, log: _Log, path: Path) -> _Told:
    how = _pick(rng, ("npy", "pickle", "object", "text", "zip"))
    if how == "npy":
        with path.open("wb") as file:
            np.save(file, log.data[_MARKERS])
    elif how == "pickle":
        path.write_bytes(b"\x80\x04K\x01.")
    elif how == "object":
        log.data[_TIME] = np.array([None] * len(log.data[_TIME]), dtype=object)
        _write_npz(log, path)
    elif how == "text":
        log.data[_TIME] = np.array(["now"] * len(log.data[_TIME]))
        _write_npz(log, path)
    else:
        import zipfile

        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("time.npy", b"no array")
    return how, Expect.REFUSE


def _npz_noise(rng: Rng, log: _Log, path: Path) -> _Told:
    log.noise[_MARKERS] = value = _pick(rng, (np.nan, -1.0, 0.0, np.array(["loud"]), 1e9))
    _write_npz(log, path)
    return repr(value), Expect.REFUSE


_NPZ: tuple[Callable[[Rng, _Log, Path], _Told], ...] = (_not_npz, _npz_noise)


def _marker_list(rng: Rng, log: _Log, path: Path) -> _Told:
    _write_csv(log, path)
    places = _places(log)
    body, k = places[1:], int(rng.integers(len(places) - 1))
    how = _pick(
        rng, ("missing", "twice", "from 1", "fraction", "word", "more", "empty", "shuffled", "none")
    )
    instead = {"twice": str((k + 1) % len(body)), "fraction": f"{k}.5", "word": "m7"}
    if how in instead:
        body[k][0] = instead[how]
    elif how == "missing":
        del body[k]
    elif how == "from 1":
        for i, row in enumerate(body):
            row[0] = str(i + 1)
    elif how == "more":
        body.append([str(len(body)), "0", "0", "0"])
    elif how == "empty":
        body = []
    elif how == "shuffled":
        rng.shuffle(body)
    beside = path.with_suffix(".markers.csv")
    if how == "none":
        beside.unlink()
    else:
        beside.write_text(_text([places[0], *body]))
    return how, Expect.ACCEPT if how == "shuffled" else Expect.REFUSE


def _columns(rng: Rng, log: _Log, path: Path) -> _Told:
    rows = _rows(log)
    width = len(rows[0])
    k = int(rng.integers(1, width))
    how = _pick(rng, ("shuffled", "dropped", "twice", "ragged", "word", "bom", "spaces", "utf-16"))
    expect, encoding = Expect.REFUSE, "utf-8"
    if how == "shuffled":
        order = rng.permutation(width)
        rows = [[row[j] for j in order] for row in rows]
        expect = Expect.ACCEPT
    elif how == "dropped":
        name = rows[0][k]
        # forces may be missing entirely, but not partly
        rows = [[x for j, x in enumerate(row) if j != k] for row in rows]
        how = f"{how} {name}"
    elif how == "twice":
        rows[0][k] = rows[0][k - 1]
    elif how == "ragged":
        del rows[int(rng.integers(1, len(rows)))][-1]
    elif how == "word":
        rows[int(rng.integers(1, len(rows)))][k] = _pick(rng, ("n/a", "1,5", "--", "0x1", "1e"))
    elif how == "bom":
        encoding, expect = "utf-8-sig", Expect.ACCEPT
    elif how == "spaces":
        rows = [[f" {x} " for x in row] for row in rows]
        expect = Expect.ACCEPT
    else:
        encoding, expect = "utf-16", Expect.EITHER
    path.write_text(_text(rows), encoding=encoding)
    path.with_suffix(".markers.csv").write_text(_text(_places(log)), encoding=encoding)
    return how, expect


def _delimiter(rng: Rng, log: _Log, path: Path) -> _Told:
    delimiter = _pick(rng, (";", "\t", "|"))
    path.write_text(_text(_rows(log), delimiter))
    path.with_suffix(".markers.csv").write_text(_text(_places(log), delimiter))
    return repr(delimiter), Expect.EITHER


_CSV: tuple[Callable[[Rng, _Log, Path], _Told], ...] = (_marker_list, _columns, _delimiter)
