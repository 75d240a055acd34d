"""The log keeps what was written, however the writer ended."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import h5py
import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES
from drake_dress.report import disk, log_writer
from drake_dress.report.log import RunLog
from drake_dress.report.log_schema import JOINT_NAMES
from drake_dress.report.log_writer import RunLogWriter, Sample
from tests.present import present
from tests.report import synthetic


@pytest.fixture(scope="module")
def garment() -> GarmentMesh:
    return synthetic.coat(0.06)


@pytest.fixture
def samples(garment: GarmentMesh) -> list[Sample]:
    return synthetic.dressing(garment, count=6)


@pytest.fixture
def path(tmp_path: Path, garment: GarmentMesh, samples: list[Sample]) -> Path:
    return synthetic.write(tmp_path / "run.h5", garment, samples)


def eager_writer(path: Path, garment: GarmentMesh) -> RunLogWriter:
    """Returns one that flushes every sample."""
    return RunLogWriter(
        path,
        synthetic.content(garment, capsule_radius=np.ones(6)),
        flush_period=0.0,
    )


def test_tapered_limbs_have_a_radius_at_each_end(
    tmp_path: Path, garment: GarmentMesh, samples: list[Sample]
) -> None:
    radius = synthetic.capsules(np.asarray(samples[0].joint_position))[2]
    tapered = np.column_stack([radius, np.linspace(0.5, 1.0, len(radius)) * radius])
    for name, given in (("tapered", tapered), ("plain", radius)):
        content = synthetic.content(garment, capsule_radius=given)
        with RunLogWriter(tmp_path / f"{name}.h5", content) as log:
            log.append(samples[0])
    with RunLog.open(tmp_path / "tapered.h5") as log:
        np.testing.assert_array_equal(log.capsules[2], tapered)
        np.testing.assert_array_equal(log.file["/human/capsule_radius"], radius)
    with RunLog.open(tmp_path / "plain.h5") as log:
        np.testing.assert_array_equal(log.capsules[2], np.column_stack([radius, radius]))
        # logs of persons without tapered limbs are as they were
        assert "/human/capsule_end_radius" not in log.file


def test_what_is_read_is_what_was_written(
    path: Path, garment: GarmentMesh, samples: list[Sample]
) -> None:
    with RunLog.open(path) as log:
        assert len(log) == len(samples)
        assert log.time.tolist() == [s.time for s in samples]  # to the last bit
        assert (log.seed, log.version, log.scenario_text) == (3, "0.0", "seed: 3\n")
        np.testing.assert_array_equal(log.faces, garment.faces)
        np.testing.assert_array_equal(log.rest_position, garment.rest_position)
        for name, loop in garment.loops.items():
            np.testing.assert_array_equal(log.loops[name], loop)
        for i, s in enumerate(samples):
            np.testing.assert_allclose(
                log.garment_position(i), np.asarray(s.garment_position), atol=1e-6
            )
            np.testing.assert_allclose(
                present(log.contact_force(i)), np.asarray(s.contact_force), atol=1e-6
            )
            np.testing.assert_array_equal(log.contact(i), s.contact)
            np.testing.assert_array_equal(log.joint_position[i], s.joint_position)
            np.testing.assert_array_equal(log.capsules[0][i], s.capsule_a)
            np.testing.assert_array_equal(log.stage[i], s.stage)
            np.testing.assert_array_equal(present(log.intent)[i], s.intent)
            for side in SIDES:
                np.testing.assert_array_equal(
                    log.gripper_position[side][i], s.gripper_position[side]
                )
                np.testing.assert_array_equal(log.gripper_force[side][i], s.gripper_force[side])
                np.testing.assert_array_equal(log.dressing[side][i], s.dressing[side])
        np.testing.assert_array_equal(
            log.solve_time("global"), [s.global_solve_time for s in samples]
        )
        np.testing.assert_array_equal(
            log.solves("global"), [np.isfinite(s.global_solve_time) for s in samples]
        )
        np.testing.assert_array_equal(log.solves("local"), [3 for _ in samples])
        assert np.unique(present(log.intent)).tolist() == [0, 1]


def test_layout_is_the_published_one(
    path: Path, garment: GarmentMesh, samples: list[Sample]
) -> None:
    count, n, f = len(samples), len(garment.rest_position), len(garment.faces)
    expected = {
        "time": (count,),
        "garment/faces": (f, 3),
        "garment/rest_position": (n, 3),
        "garment/position": (count, n, 3),
        "garment/contact": (count, n),
        "garment/contact_force": (count, n, 3),
        "human/joint_position": (count, 6, 3),
        "human/radius": (6,),
        "human/intent": (count, 2),
        "control/stage": (count, 2),
        "control/safety": (count, 2),
        "control/global/solve_time": (count,),
        "control/local/solve_time": (count,),
        "control/global/solves": (count,),
        "control/local/solves": (count,),
        "estimate/garment/position": (count, n, 3),
        "estimate/human/joint_position": (count, 6, 3),
    }
    for side in SIDES:
        expected |= {f"gripper/{side}/{name}": (count, 3) for name in ("position", "force")}
        expected |= {f"dressing/{side}/{name}": (count,) for name in ("s", "l", "theta")}
        for opening in ("armhole", "cuff"):
            name = f"{side}_{opening}"
            expected[f"garment/loops/{name}"] = (len(garment.loops[name]),)
    with h5py.File(path) as file:
        assert file.attrs["schema"] == "drake_dress.log/1"
        assert {"scenario", "version", "seed"} <= set(file.attrs)
        assert {name: file[name].shape for name in expected} == expected
        assert file["time"].dtype == np.float64
        assert list(file["human/joint_position"].attrs["names"]) == list(JOINT_NAMES)
        assert file["human/intent"].dtype == file["control/stage"].dtype
        assert list(file["human/intent"].attrs["names"]) == list(SIDES)
        values = file["human/intent"].attrs["values"]
        assert [value.split(":")[0] for value in values] == ["passive", "active"]
        assert file["gripper/left/force"].attrs["unit"] == "N"
        assert file["garment/position"].attrs["frame"] == "world"


def test_log_without_verdicts_is_still_a_log(path: Path) -> None:
    with RunLog.open(path) as log:
        np.testing.assert_array_equal(log.safety, 0)
    _edit(path, _delete_safety)
    with RunLog.open(path) as log:
        assert log.safety is None


def _delete_safety(file: h5py.File) -> None:
    del file["control/safety"]


def test_log_from_before_intent_is_still_a_log(path: Path) -> None:
    _edit(path, _delete_intent)
    with RunLog.open(path) as log:
        assert log.intent is None


def _delete_intent(file: h5py.File) -> None:
    del file["human/intent"]


def test_estimated_log_has_no_truth(
    tmp_path: Path, garment: GarmentMesh, samples: list[Sample]
) -> None:
    """On hardware neither contact nor the person's intent is known."""
    path = tmp_path / "run.h5"
    with RunLogWriter(path, synthetic.content(garment, estimated=True)) as writer:
        writer.append(replace(samples[0], contact=None, contact_force=None, intent=None))
    with RunLog.open(path) as log:
        assert log.estimated
        assert (log.contact(0), log.contact_force(0), log.intent) == (None, None, None)


def test_interrupt_leaves_whole_samples(
    tmp_path: Path,
    garment: GarmentMesh,
    samples: list[Sample],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    path = tmp_path / "run.h5"

    def interrupted(rows: Mapping[str, Any]) -> dict[str, Any]:
        # The signal comes after some datasets of the sample have grown.
        rows = dict(rows)
        last = list(rows)[3]
        rows[last] = _Interrupt()
        return rows

    with pytest.raises(KeyboardInterrupt):
        with RunLogWriter(
            path,
            synthetic.content(garment),
        ) as writer:
            for sample in samples[:3]:
                writer.append(sample)
            original = writer._rows
            monkeypatch.setattr(writer, "_rows", lambda s: interrupted(original(s)))
            writer.append(samples[3])
    with RunLog.open(path) as log:
        assert log.time.tolist() == [s.time for s in samples[:3]]


class _Interrupt:
    def __array__(self, dtype: object = None, copy: object = None) -> NoReturn:
        raise KeyboardInterrupt


def test_killed_process_leaves_what_was_flushed(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    root = Path(__file__).resolve().parents[2]
    script = f"""
import time
import numpy as np
from dataclasses import replace
from drake_dress.report import log_writer
from drake_dress.report.log_writer import RunLogWriter
from tests.report import synthetic
log_writer._MOST_OPEN = 50
garment = synthetic.coat(0.06)
sample = synthetic.dressing(garment, count=2)[0]
content = synthetic.content(garment, capsule_radius=np.ones(6))
writer = RunLogWriter({str(path)!r}, content, flush_period=0.05)
for i in range(10**6):
    writer.append(replace(sample, time=0.01 * i))
    if i in (600, 601):
        # it is written beside
        time.sleep(1.0)
    if i == 601:
        print("written", flush=True)
        # it is killed here, however long that takes
        time.sleep(60.0)
"""
    process = subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        text=True,
        cwd=root,
        env=os.environ | {"PYTHONPATH": str(root)},
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "written\n"
    with pytest.raises(UserError, match="still being written"):
        RunLog.open(path)
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    with RunLog.open(path) as log:
        assert len(log) == 602
        assert np.isfinite(log.garment_position(len(log) - 1)).all()


def test_memory_does_not_grow_with_samples(
    tmp_path: Path, garment: GarmentMesh, samples: list[Sample], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What HDF5 keeps of a file until it is closed, 1 kB a sample, is 100 MB an hour."""
    monkeypatch.setattr(log_writer, "_MOST_OPEN", 50)
    path = tmp_path / "run.h5"
    kept = []
    count = 800
    with eager_writer(path, garment) as writer:
        for k in range(count):
            moved = np.asarray(samples[0].garment_position) + k
            writer.append(replace(samples[0], time=float(k), garment_position=moved))
            if k % 10 == 9:
                writer._drain()
                kept.append(writer._file.id.get_mdc_size()[2])
        writer.note("note", "there")
    third = len(kept) // 3
    assert max(kept[-third:]) < 1.2 * max(kept[:third])
    with RunLog.open(path) as log:
        assert log.time.tolist() == list(range(count))
        first = np.asarray(samples[0].garment_position)
        for k in (0, 49, 50, 51, count - 1):
            np.testing.assert_allclose(log.garment_position(k), first + k, atol=1e-4)


def test_a_file_that_cannot_be_opened_again_ends_the_log(
    tmp_path: Path, garment: GarmentMesh, samples: list[Sample], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(log_writer, "_MOST_OPEN", 2)
    path = tmp_path / "run.h5"
    writer = eager_writer(path, garment)
    writer.append(samples[0])
    writer._drain()
    path.rename(tmp_path / "gone.h5")
    writer.append(samples[1])
    with pytest.raises(OSError, match=r"run\.h5"):
        writer.append(samples[2])
        writer._drain()
    (tmp_path / "gone.h5").rename(path)
    writer.note("ended_by", "the file was gone")
    writer.close()
    with RunLog.open(path) as log:
        assert len(log) == 2
        assert log.ended_by == "the file was gone"


def test_a_log_that_is_being_written_is_neither_read_nor_replaced(
    tmp_path: Path, garment: GarmentMesh, samples: list[Sample], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor in between, when it is opened anew."""
    monkeypatch.setattr(log_writer, "_MOST_OPEN", 1)
    path = tmp_path / "run.h5"
    opened = log_writer._open

    def refused(*words: Any) -> h5py.File:
        with pytest.raises(UserError, match="still being written"):
            RunLog.open(path)
        return opened(*words)

    content = synthetic.content(garment, capsule_radius=np.ones(6))
    with RunLogWriter(path, content, flush_period=0.0) as writer:
        monkeypatch.setattr(log_writer, "_open", refused)
        for sample in samples[:3]:
            writer.append(sample)
            writer._drain()
        with pytest.raises(UserError, match="cannot be written"):
            RunLogWriter(path, content, flush_period=0.0)
    with RunLog.open(path) as log:
        assert len(log) == 3


def test_time_must_increase(tmp_path: Path, garment: GarmentMesh, samples: list[Sample]) -> None:
    with RunLogWriter(
        tmp_path / "run.h5",
        synthetic.content(garment),
    ) as writer:
        writer.append(samples[1])
        with pytest.raises(ValueError, match="not later"):
            writer.append(samples[1])


def test_wrong_shape_is_told(tmp_path: Path, garment: GarmentMesh, samples: list[Sample]) -> None:
    bad = replace(samples[0], joint_position=np.zeros((5, 3)))
    with RunLogWriter(
        tmp_path / "run.h5",
        synthetic.content(garment),
    ) as writer:
        with pytest.raises(ValueError, match="joint_position"):
            writer.append(bad)
        writer.append(samples[0])
    with RunLog.open(tmp_path / "run.h5") as log:
        assert len(log) == 1


def _edit(path: Path, change: Callable[[h5py.File], None]) -> None:
    with h5py.File(path, "r+") as file:
        change(file)


def _delete_positions(file: h5py.File) -> None:
    del file["garment/position"]


def _delete_loop(file: h5py.File) -> None:
    del file["garment/loops/left_cuff"]


def _other_schema(file: h5py.File) -> None:
    file.attrs["schema"] = "drake_dress.log/9"


def _no_schema(file: h5py.File) -> None:
    del file.attrs["schema"]


def _time_back(file: h5py.File) -> None:
    file["time"][2] = 0.0


def _short_force(file: h5py.File) -> None:
    file["gripper/left/force"].resize(3, axis=0)


def _one_intent(file: h5py.File) -> None:
    del file["human/intent"]
    file["human/intent"] = np.zeros(len(file["time"]))


def _wild_face(file: h5py.File) -> None:
    file["garment/faces"][0, 0] = 10**6


@pytest.mark.parametrize(
    ("change", "key"),
    [
        (_delete_positions, "/garment/position"),
        (_delete_loop, "/garment/loops/left_cuff"),
        (_other_schema, "schema"),
        (_no_schema, "schema"),
        (_time_back, "/time"),
        (_short_force, "/gripper/left/force"),
        (_one_intent, "/human/intent"),
        (_wild_face, "/garment/faces"),
    ],
)
def test_unusable_log_names_file_and_key(
    path: Path, change: Callable[[h5py.File], None], key: str
) -> None:
    _edit(path, change)
    with pytest.raises(UserError) as error:
        RunLog.open(path)
    assert str(error.value).startswith(f"{path}: {key}: ")
    assert "\n" not in str(error.value)


def test_what_is_no_log_is_refused(tmp_path: Path) -> None:
    text = tmp_path / "text.h5"
    text.write_text("no HDF5\n")
    cut = tmp_path / "cut.h5"
    cut.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(20))
    for path in (tmp_path / "absent.h5", text, cut, tmp_path):
        with pytest.raises(UserError):
            RunLog.open(path)


def test_a_full_disk_ends_a_log_that_can_be_read(
    tmp_path: Path, garment: GarmentMesh, samples: list[Sample], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Full but for what the log keeps back."""
    path = tmp_path / "run.h5"
    writer = eager_writer(path, garment)
    for sample in samples[:3]:
        writer.append(sample)
    # waits for what is being written
    writer.note("note", "")

    def full(*words: object) -> NoReturn:
        monkeypatch.setattr(log_writer, "keep_room", disk.keep_room)
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(log_writer, "keep_room", full)
    with pytest.raises(OSError, match=r"No space left.*run\.h5"):
        writer.append(samples[3])
    writer.note("ended_by", "log: cannot be written")
    writer.close()
    with RunLog.open(path) as log:
        assert len(log) == 4
        assert log.ended_by == "log: cannot be written"
    assert [p.name for p in tmp_path.iterdir()] == ["run.h5"]


def test_a_disk_without_any_room_keeps_what_was_written(
    tmp_path: Path, garment: GarmentMesh, samples: list[Sample], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another one took what the log had kept back."""
    path = tmp_path / "run.h5"
    writer = eager_writer(path, garment)
    for sample in samples[:3]:
        writer.append(sample)
        writer._drain()

    def full(*words: object) -> NoReturn:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(log_writer, "keep_room", full)
    with pytest.raises(OSError, match="No space left"):
        writer.append(samples[3])
    with pytest.raises(OSError, match="No space left"):
        writer.note("ended_by", "log: cannot be written")
    writer.close()
    with RunLog.open(path) as log:
        assert len(log) == 3
        assert log.ended_by is None


_FILLED = """
import sys, threading, time
from dataclasses import replace
from pathlib import Path
import numpy as np
from benchmarks.hardware.two_processes import fill
from drake_dress.report.log import RunLog
from drake_dress.report.log_writer import RunLogWriter
from tests.report import synthetic

place = Path(sys.argv[1])
path, filler = place / "run.h5", place / "filler"
garment = synthetic.coat(0.06)
sample = synthetic.dressing(garment, count=2)[0]

def fill_later(after):
    time.sleep(after)
    fill(filler)

for after in np.random.default_rng(0).uniform(0.1, 0.5, 6):
    content = synthetic.content(garment, capsule_radius=np.ones(6))
    writer = RunLogWriter(path, content, flush_period=0.02)
    filling = threading.Thread(target=fill_later, args=[after])
    filling.start()
    count, begin = 0, time.monotonic()
    try:
        while time.monotonic() - begin < 20.0:
            count += 1
            writer.append(replace(sample, time=float(count)))
        raise SystemExit("the disk was not filled")
    except OSError as error:
        # not HDF5's, which has more to say
        assert str(error) == f"[Errno 28] No space left on device: {str(path)!r}", error
    writer.note("ended_by", "full")
    writer.close()
    with RunLog.open(path) as log:
        assert len(log) == count and log.ended_by == "full"
    assert path.stat().st_blocks * 512 < path.stat().st_size + 65536
    filling.join()
    filler.unlink()
    path.unlink()
"""


def test_a_disk_that_is_filled_meanwhile_does_not_crash_hdf5(tmp_path: Path) -> None:
    """A disk of its own, filled at any moment of a write."""
    mount = f"mount -t tmpfs -o size=48m tmpfs {tmp_path}"
    alone = ["unshare", "-m", "sh", "-c"]
    try:
        if subprocess.run([*alone, mount], capture_output=True, check=False).returncode:
            pytest.skip("no disk may be mounted")
    except FileNotFoundError:
        pytest.skip("no unshare")
    program = tmp_path.parent / "filled.py"
    program.write_text(_FILLED)
    root = str(Path(__file__).parents[2])
    done = subprocess.run(
        [*alone, f"{mount} && exec {sys.executable} {program} {tmp_path}"],
        cwd=root,
        env=os.environ | {"PYTHONPATH": root},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_a_log_without_room_is_not_begun(
    tmp_path: Path, garment: GarmentMesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object) -> NoReturn:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", none)
    with pytest.raises(UserError, match="no room on the disk"):
        RunLogWriter(
            tmp_path / "run.h5",
            synthetic.content(garment),
        )
    assert not list(tmp_path.iterdir())


def test_a_run_for_which_there_is_no_room_costs_nothing_of_the_one_before(
    tmp_path: Path, garment: GarmentMesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object) -> NoReturn:
        raise OSError(28, "No space left on device")

    before = {"run.h5": b"a log", "summary.json": b"a summary"}
    for name, content in before.items():
        (tmp_path / name).write_bytes(content)
    monkeypatch.setattr(os, "posix_fallocate", none)
    with pytest.raises(UserError, match="no room on the disk"):
        RunLogWriter(
            tmp_path / "run.h5",
            synthetic.content(garment),
            results=["summary.json"],
        )
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before
