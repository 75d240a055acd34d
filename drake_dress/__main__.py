"""The command line of `drake-dress`."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NoReturn, TypeAlias

import drake_dress
from drake_dress import __version__
from drake_dress.errors import FailedError, UserError
from drake_dress.file_output import (
    DATASET_FILES,
    EXPLAIN_FILES,
    GARMENT_FILES,
    RUN_FILES,
    prove_directory,
    prove_file,
)
from drake_dress.interrupt import interrupt_of, signals_raised
from drake_dress.libraries import check_libraries, import_problem
from drake_dress.machine import worker_count
from drake_dress.shipped import scenario_file, shipped_scenarios
from drake_dress.streams import forgiving_streams, keep_standard_descriptors
from drake_dress.yaml_text import plain_value

FAILED, UNUSABLE = 1, 2
# Ports that a program may open without root rights.
_PORTS = 1024, 65535
# Simulated seconds per second; at lower rates Ctrl-C would take minutes.
_RATES = 0.02, 1e3
# Most sequences of a kind and most dressings: their numbers have five digits.
_MOST_SEQUENCES, _MOST_DRESSINGS = 100_000, 10_000
# Range of the factor on a hidden effect's strength.
_SIZES = 1e-3, 1e3
# Larger noise is meaningless: the size of a room, m, and a gripper's payload, N.
_MOST_MARKER_NOISE, _MOST_FORCE_NOISE = 1.0, 100.0
# Name to what it measures; the first is the default.
BENCHMARKS = {
    "cloth": "accuracy and speed of the cloth schemes, beside other simulators where installed",
    "arms": "every scenario with floating grippers and with two arms; load of the arms",
    "dressing": "success rate over persons, coats and seeds, for each control method",
    "fit": "drawn coats on drawn bodies: success, beside the verdict of drake-dress garment",
    "explain": "share of hidden effects that are named correctly",
    "gym": "speed of the Gymnasium environment, and dressings controlled through it",
    "hardware": "command rate, latency, fault reactions and memory; run and lab in two processes",
    "inputs": "reaction to damaged scenarios, garment files, measured logs and messages",
    "files": "garment files of all kinds, made at run time: read right, or refused for a reason",
    "killed": "files left by runs that are killed, terminated or out of disk space",
    "local": "constrained DDP compared with the exact optimum",
    "delay": "solve time of the global controller on this machine",
    "prediction": "prediction of a person's arms and intent, beside simple predictors",
    "predictors": "active persons dressed with each predictor of their motion",
    "perception": "errors of the coat as it is tracked with depth cameras",
    "transfer": "dressings with MuJoCo as the world, beside the package's own simulation",
    "plant": "accuracy and cost of the plant's cloth compared with a fine reference",
    "realtime": "real-time factor of a dressing, beside an earlier version of the code",
    "repeat": "whether the same seed gives the same log bit for bit under any load",
    "mutation": "share of mutants of central modules that the tests detect",
}

_EXAMPLES = """examples:
  drake-dress scenarios
  drake-dress run dummy_standing
  drake-dress run dummy_varied --seed 3 --out out/try
  drake-dress run my_scenario.yaml --set plant.material.friction=0.5 --no-meshcat
  drake-dress garment jacket.obj --set garment.mesh.up=y --out out/jacket
  drake-dress dataset measured --hide random --seed 1 --out out/lab
  drake-dress dataset motion --out out/motion --dressings 8
  drake-dress dataset motion --out out/motion
  drake-dress train intent --data out/motion --out out/train
  drake-dress explain out/lab/measured.h5 --scenario measured
  drake-dress explain out/lab/measured.h5 --scenario measured --plugin my_effects.py
  drake-dress sim-station lab
  drake-dress run lab --set station.kind=hardware
  drake-dress replay out/dummy_standing-seed0/run.h5
  drake-dress bench cloth --only draping,growth --json cloth.json

exit status: 0 both sleeves on, 1 the run finished but the dressing failed, 2 unusable input"""


_OF_SCENARIO = "a YAML file, or the name of a built-in scenario; see drake-dress scenarios"
# Return type of `add_subparsers`.
_Verbs: TypeAlias = "argparse._SubParsersAction[_Parser]"


class _Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(UNUSABLE, f"drake-dress: {message}; see drake-dress --help\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command line; returns the exit status.

    May be called any number of times in a process: on return, signal handlers and the standard
    streams are restored.
    """
    if arguments is None:
        keep_standard_descriptors()
    words = list(sys.argv[1:] if arguments is None else arguments)
    with forgiving_streams(), signals_raised():
        try:
            return _status(words)
        except UserError as error:
            return _told(str(error), UNUSABLE)
        except FailedError as error:
            return _told(str(error), FAILED)
        except ImportError as error:
            return _told(str(import_problem(error)), UNUSABLE)
        except OSError as error:
            reason = error.strerror or " ".join(str(error).split())
            return _told(f"{error.filename or 'file system'}: {reason}", FAILED)
        except MemoryError:
            return _told("not enough memory", FAILED)
        except KeyboardInterrupt as error:
            interrupt = interrupt_of(error)
            return _told(interrupt.word, interrupt.status)


def _status(words: list[str]) -> int:
    for word in words:
        if "\0" in word:
            raise UserError("command line", repr(word), "holds a NUL character, expected none")
    if words[:1] == ["bench"]:
        # Each benchmark parses its own options.
        return _bench(words[1:])
    options = _parser().parse_args(words)
    check_libraries()
    _load_plugins(getattr(options, "plugin", []))
    status: int = options.command(options)
    return status


def _load_plugins(given: Sequence[str]) -> None:
    if given:
        from drake_dress.plugins import load_for_children

        for plugin in given:
            load_for_children(plugin)


def _told(line: str, status: int) -> int:
    print(f"drake-dress: {line}", file=sys.stderr)
    return status


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="drake-dress",
        description="Two arms put a coat on a person, in simulation.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"drake-dress {__version__}")
    verbs = parser.add_subparsers(title="commands", dest="verb", required=True, metavar="COMMAND")

    _add_run(verbs)
    _add_garment(verbs)
    _add_sim_station(verbs)
    _add_calibrate(verbs)
    _add_replay(verbs)
    _add_explain(verbs)
    _add_dataset(verbs)
    _add_train(verbs)
    shipped = verbs.add_parser(
        "scenarios", help="list the built-in scenarios, which all commands accept by name"
    )
    shipped.set_defaults(command=_scenarios)
    verbs.add_parser(
        "bench", help="measure speed, accuracy and success; see drake-dress bench --help"
    )
    return parser


def _add_run(verbs: _Verbs) -> None:
    run = verbs.add_parser("run", help="simulate a scenario and write log, report and replay")
    run.add_argument("scenario", metavar="SCENARIO", help=_OF_SCENARIO)
    run.add_argument("--out", metavar="DIR", help="default: out/<scenario>-seed<N>")
    run.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="set a value of the scenario by its dotted key; can be repeated",
    )
    run.add_argument("--seed", type=_seed, metavar="N", help="in place of the scenario's seed")
    run.add_argument(
        "--meshcat",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="show the run live in Meshcat on localhost",
    )
    run.add_argument(
        "--realtime-rate",
        type=_rate,
        default=0.0,
        metavar="R",
        help="at most R simulated seconds per second; 0: no limit (default)",
    )
    run.add_argument(
        "--one-process",
        action="store_true",
        help="simulate the garment and solve for plans in this process instead of worker "
        "processes, for example beside other runs; the results are identical",
    )
    _add_plugin(run)
    _add_report(run)
    run.set_defaults(command=_run)


def _add_garment(verbs: _Verbs) -> None:
    garment = verbs.add_parser(
        "garment",
        help="look at a garment before a run: openings, girths, fit, size",
        description="Writes garment.html with drawings and measures of a garment beside the "
        "person's, garment.json with the same for programs, and garment.yaml, a scenario that runs "
        "it. A garment's file is put into the scenario dummy_standing; --set sets its keys, such "
        "as garment.mesh.up=y.",
    )
    garment.add_argument(
        "garment",
        metavar="FILE|SCENARIO",
        help="a garment (OBJ, PLY, STL, glTF), a scenario's YAML file or its name",
    )
    garment.add_argument(
        "--person", metavar="SCENARIO", help="whose person wears it; default: the scenario's own"
    )
    garment.add_argument("--out", metavar="DIR", help="default: out/garment-<name>")
    garment.add_argument("--set", metavar="KEY=VALUE", action="append", default=[])
    garment.add_argument("--seed", type=_seed, metavar="N", help="in place of the scenario's seed")
    garment.set_defaults(command=_garment)


def _add_sim_station(verbs: _Verbs) -> None:
    lab = verbs.add_parser(
        "sim-station",
        help="simulate the lab behind the hardware messages, for a run on hardware",
    )
    lab.add_argument("scenario", metavar="SCENARIO", help=_OF_SCENARIO)
    lab.add_argument("--out", metavar="DIR", help="default: out/<scenario>-seed<N>-lab")
    lab.add_argument("--set", metavar="KEY=VALUE", action="append", default=[])
    lab.add_argument("--seed", type=_seed, metavar="N", help="in place of the scenario's seed")
    lab.add_argument(
        "--realtime-rate",
        type=_rate,
        default=1.0,
        metavar="R",
        help="at most R simulated seconds per second (default: 1)",
    )
    _add_plugin(lab)
    _add_report(lab)
    lab.set_defaults(command=_sim_station)


def _add_calibrate(verbs: _Verbs) -> None:
    calibrate = verbs.add_parser(
        "calibrate", help="estimate a camera's pose from pictures of a board in a gripper"
    )
    calibrate.add_argument(
        "directory",
        metavar="DIR",
        nargs="?",
        help="folder with poses.csv (image,q1,…,q7) and pictures",
    )
    calibrate.add_argument(
        "--scenario", metavar="SCENARIO", help="default: lab.yaml of the program's own"
    )
    calibrate.add_argument("--set", metavar="KEY=VALUE", action="append", default=[])
    calibrate.add_argument(
        "--side", choices=("left", "right"), default="left", help="arm that holds the board"
    )
    calibrate.add_argument(
        "--board",
        metavar="CxR:SQUARE:MARKER:DICT",
        default="7x5:0.03:0.022:DICT_4X4_50",
        help="m; default: %(default)s",
    )
    calibrate.add_argument(
        "--camera",
        metavar="NAME",
        help="scenario camera with the intrinsics; default: estimate them",
    )
    calibrate.add_argument("--out", metavar="FILE", help="default: DIR/calibration.json")
    calibrate.add_argument("--print-board", metavar="FILE.png", help="write the board to print")
    calibrate.set_defaults(command=_calibrate)


def _add_replay(verbs: _Verbs) -> None:
    replay = verbs.add_parser("replay", help="show a log in Meshcat, with a slider")
    replay.add_argument("log", metavar="run.h5")
    replay.add_argument("--port", type=_port, metavar="PORT", help="default: a free one")
    replay.set_defaults(command=_replay)


def _add_explain(verbs: _Verbs) -> None:
    explain = verbs.add_parser(
        "explain", help="show where the simulation differs from measured data, and why"
    )
    explain.add_argument("measured", metavar="MEASURED", nargs="+", help=".h5, .npz or .csv")
    explain.add_argument("--scenario", metavar="SCENARIO", required=True)
    explain.add_argument("--out", metavar="DIR", help="default: out/explain-<first file>")
    explain.add_argument("--set", metavar="KEY=VALUE", action="append", default=[])
    explain.add_argument(
        "--workers", type=_count, metavar="N", help="processes; default: all cores"
    )
    _add_plugin(explain)
    explain.set_defaults(command=_explain)


def _add_dataset(verbs: _Verbs) -> None:
    dataset = verbs.add_parser("dataset", help="make data")
    kinds = dataset.add_subparsers(dest="kind", required=True, metavar="KIND")
    _add_dataset_measured(kinds)
    _add_dataset_motion(kinds)
    _add_dataset_body(kinds)


def _add_dataset_measured(kinds: _Verbs) -> None:
    hidden = kinds.add_parser(
        "measured", help="synthetic measurements of a lab with a hidden effect"
    )
    hidden.add_argument(
        "--motions",
        metavar="NAME,…",
        help="sway, lift, drag, shift, pull, drop, dress; default: all but shift and drop",
    )
    hidden.add_argument("--hide", metavar="EFFECT|nothing|random", required=True)
    hidden.add_argument("--seed", type=_whole, default=0, metavar="N")
    hidden.add_argument("--out", metavar="DIR", required=True)
    hidden.add_argument(
        "--scenario", metavar="SCENARIO", help="default: measured.yaml of the program's own"
    )
    hidden.add_argument("--set", metavar="KEY=VALUE", action="append", default=[])
    hidden.add_argument(
        "--size",
        type=_between(*_SIZES),
        default=1.0,
        help="factor on the strength of the hidden effect; default 1",
    )
    hidden.add_argument(
        "--marker-noise",
        type=_between(0.0, _MOST_MARKER_NOISE),
        default=1e-3,
        metavar="M",
        help="default 1e-3",
    )
    hidden.add_argument(
        "--force-noise",
        type=_between(0.0, _MOST_FORCE_NOISE),
        default=0.05,
        metavar="N",
        help="default 0.05",
    )
    _add_plugin(hidden)
    hidden.set_defaults(command=_dataset_measured)


def _add_dataset_motion(kinds: _Verbs) -> None:
    motion = kinds.add_parser(
        "motion",
        help="sequences of persons in moving garments, to learn motion and intent from",
        description="Makes sequences of 20 s of persons in moving garments, and their description, "
        "card.md. Files of the set that are there are kept, so the same command goes on after an "
        "interruption. The result depends only on the seed and the numbers of sequences.",
    )
    motion.add_argument("--out", metavar="DIR", required=True)
    motion.add_argument(
        "--seed", type=_seed, default=0, metavar="N", help="seed of all draws; default 0"
    )
    for kind, count, meaning in (
        ("passive", 2000, "persons who follow the garment"),
        ("active", 2000, "persons who also move by will"),
        ("free", 1600, "persons without a garment"),
    ):
        motion.add_argument(
            f"--{kind}",
            type=_up_to(_MOST_SEQUENCES),
            default=count,
            metavar="N",
            help=f"sequences of {meaning}; default {count}",
        )
    motion.add_argument(
        "--dressings",
        type=_up_to(_MOST_DRESSINGS),
        default=0,
        metavar="N",
        help="whole dressings by the simulator, to test on; a minute or two each; default 0",
    )
    motion.add_argument(
        "--jobs", type=_count, metavar="N", help="processes side by side; default: all cores"
    )
    motion.add_argument(
        "--ray",
        metavar="ADDRESS",
        help="run on a Ray cluster: auto, its address, or local to start one here",
    )
    motion.set_defaults(command=_dataset_motion)


def _add_dataset_body(kinds: _Verbs) -> None:
    body = kinds.add_parser(
        "body",
        help="file of the parametric body that the package ships",
        description="Makes body.npz, the body by sex, age, height and weight, from the package "
        "anny, which pip install 'drake_dress[bodies]' brings. Takes about three minutes. The "
        "same version of anny gives the same file.",
    )
    body.add_argument("--out", metavar="DIR", required=True)
    body.set_defaults(command=_dataset_body)


def _add_train(verbs: _Verbs) -> None:
    train = verbs.add_parser(
        "train",
        help="train the networks that predict a person",
        description="Trains on a set of drake-dress dataset motion and writes weights and figures. "
        "`motion` needs the weights of `intent` in the same folder. The same command goes on after "
        "an interruption, with the same result. Uses a CUDA device if there is one.",
    )
    train.add_argument("network", choices=("intent", "motion", "recurrent"))
    train.add_argument("--data", metavar="DIR", default="out/motion", help="default: %(default)s")
    train.add_argument("--out", metavar="DIR", default="out/train", help="default: %(default)s")
    train.add_argument("--seed", type=_seed, default=0, metavar="N")
    train.add_argument(
        "--steps", type=_count, metavar="N", help="at most so many steps of each part; for a try"
    )
    train.add_argument(
        "--sleeves",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="whether the networks see the sleeves",
    )
    train.add_argument(
        "--recordings",
        nargs="+",
        default=[],
        metavar="FILE[:KEY=VALUE,…]",
        help="motion: go on from trained weights with recordings of people, see docs/prediction.md",
    )
    train.add_argument(
        "--start",
        metavar="DIR",
        help="weights that recordings are added to; default: those of the package",
    )
    train.add_argument(
        "--rate", type=_between(1.0, 2000.0), metavar="HZ", help="of recordings without stamps"
    )
    train.add_argument(
        "--up", choices=("x", "-x", "y", "-y", "z", "-z"), help="axis of recordings that points up"
    )
    train.add_argument(
        "--unit", type=_between(1e-6, 10.0), metavar="M", help="of the recordings, in metres"
    )
    train.set_defaults(command=_train)


def _add_plugin(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "--plugin",
        metavar="FILE.py|MODULE",
        action="append",
        default=[],
        help="import code that registers effects, costs or predictors; can be repeated",
    )


def _add_report(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "--report",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="also write report.html and replay.html",
    )


def _calibrate(options: argparse.Namespace) -> int:
    from drake_dress.diagrams.calibration import POSES, calibrate_camera, parse_board, write_board
    from drake_dress.diagrams.scenario import load_scenario

    board = parse_board(options.board)
    if options.print_board is not None:
        write_board(board, prove_file("--print-board", options.print_board))
        return 0
    if options.directory is None:
        raise UserError("calibrate", "", "expected DIR, or --print-board FILE.png")
    directory = Path(options.directory)
    source = scenario_file("lab" if options.scenario is None else options.scenario)
    if not os.path.isdir(directory):
        raise UserError(str(directory), "", "no such directory, expected one with poses.csv")
    scenario = load_scenario(source, options.set)
    out = directory / "calibration.json" if options.out is None else options.out
    out = prove_file("--out", out, [source, directory / POSES])
    calibrate_camera(directory, scenario, source, options.side, board, options.camera, out)
    return 0


def _sim_station(options: argparse.Namespace) -> int:
    from drake_dress.diagrams.lab import run_lab
    from drake_dress.diagrams.scenario import load_scenario

    source = scenario_file(options.scenario)
    scenario = load_scenario(source, options.set, options.seed)
    default = Path("out") / f"{source.stem}-seed{scenario.seed}-lab"
    out = _directory(options.out, default, RUN_FILES, [source])
    return run_lab(scenario, source, out, options.realtime_rate, options.report)


def _run(options: argparse.Namespace) -> int:
    from drake_dress.diagrams.run import RunOptions, run_scenario
    from drake_dress.diagrams.scenario import load_scenario

    source = scenario_file(options.scenario)
    scenario = load_scenario(source, options.set, options.seed)
    default = Path("out") / f"{source.stem}-seed{scenario.seed}"
    out = _directory(options.out, default, RUN_FILES, [source])
    in_workers = not options.one_process and worker_count() > 1
    how = RunOptions(options.meshcat, options.realtime_rate, in_workers, options.report)
    return run_scenario(scenario, source, out, how)


def _garment(options: argparse.Namespace) -> int:
    from drake_dress.diagrams.garment_look import garment_source, subject_of, verdict, write_look

    source, _ = garment_source(options.garment)
    person = None if options.person is None else scenario_file(options.person)
    inputs = [source] if person is None else [source, person]
    out = _directory(options.out, Path("out") / f"garment-{source.stem}", GARMENT_FILES, inputs)
    look = write_look(subject_of(options.garment, person, options.set, options.seed), out)
    print(verdict(look))
    print(f"page, figures and scenario: {out}")
    return 0


def _scenarios(_: argparse.Namespace) -> int:
    told = shipped_scenarios()
    width = max(map(len, told), default=0) + 2
    for name, summary in told.items():
        print(f"{name:<{width}}{summary}")
    return 0


def _replay(options: argparse.Namespace) -> int:
    from drake_dress.report.replay import show_replay

    return show_replay(options.log, options.port)


def _explain(options: argparse.Namespace) -> int:
    from drake_dress.discrepancy.commands import explain_files

    default = Path("out") / f"explain-{Path(options.measured[0]).stem}"
    scenario = scenario_file(options.scenario)
    out = _directory(options.out, default, EXPLAIN_FILES, [*options.measured, scenario])
    explain_files(options.measured, str(scenario), options.set, out, options.workers)
    return 0


def _dataset_measured(options: argparse.Namespace) -> int:
    from drake_dress.discrepancy.commands import write_dataset
    from drake_dress.discrepancy.generate import Sensors
    from drake_dress.discrepancy.motions import USUAL

    scenario = scenario_file(options.scenario or "measured")
    out = _directory(options.out, Path(), DATASET_FILES, [scenario])
    sensors = Sensors(marker_noise=options.marker_noise, force_noise=options.force_noise)
    write_dataset(
        options.hide,
        options.seed,
        out,
        str(scenario),
        options.set,
        options.size,
        sensors,
        USUAL if options.motions is None else options.motions.split(","),
    )
    return 0


def _dataset_motion(options: argparse.Namespace) -> int:
    from drake_dress.learning.motion.commands import Wanted, write_motion_set
    from drake_dress.learning.motion.dataset import CARD, INDEX
    from drake_dress.learning.motion.making import Workplace
    from drake_dress.learning.motion.sequence import KINDS

    out = _directory(options.out, Path(), (CARD, INDEX), [])
    counts = {kind: getattr(options, kind) for kind in KINDS}
    if not any(counts.values()):
        raise UserError(
            "--passive, --active, --free", "", "are all 0, expected 1 or more sequences"
        )
    wanted = Wanted(options.seed, counts, options.dressings)
    place = Workplace(options.jobs or worker_count(), options.ray)
    return write_motion_set(out, wanted, place)


def _dataset_body(options: argparse.Namespace) -> int:
    from drake_dress.learning.body.commands import BODY, write_body_file

    return write_body_file(_directory(options.out, Path(), (BODY,), []))


def _train(options: argparse.Namespace) -> int:
    from drake_dress.learning.recordings import RecordingOptions, listed
    from drake_dress.learning.training.commands import FIGURES, TrainOptions, train_command
    from drake_dress.models.human.learned.weights import FILES, SHIPPED

    if options.recordings and options.network != "motion":
        raise UserError("train", "--recordings", "are learned from by motion alone")
    common = RecordingOptions(options.rate, options.up, options.unit)
    recordings = tuple(listed(text, common) for text in options.recordings)
    results = (FIGURES, FILES[options.network])
    out = _directory(options.out, Path(), results, [])
    return train_command(
        options.network,
        TrainOptions(
            Path(options.data),
            out,
            options.seed,
            options.steps,
            options.sleeves,
            recordings,
            SHIPPED if options.start is None else Path(options.start),
        ),
    )


def _bench(words: list[str]) -> int:
    name, arguments = next(iter(BENCHMARKS)), list(words)
    if arguments[:1] in (["-h"], ["--help"]):
        told = "".join(f"  {each:<11}{text}\n" for each, text in BENCHMARKS.items())
        print("usage: drake-dress bench [NAME] [OPTION …]\n\nnames:\n" + told)
        print(f"{name} where none is given; the options of each: drake-dress bench NAME --help")
        print("each takes --plugin FILE.py|MODULE, too")
        return 0
    if arguments and not arguments[0].startswith("-"):
        name = arguments.pop(0)
    if name not in BENCHMARKS:
        raise UserError("bench", name, f"is no benchmark, expected one of {', '.join(BENCHMARKS)}")
    root = Path(drake_dress.__file__).parents[1]
    if not (root / "benchmarks" / name).is_dir():
        raise UserError("bench", name, f"{root} has no benchmarks/, expected a checkout")
    sys.path.insert(0, str(root))
    plugins, arguments = _plugins_of(arguments)
    _load_plugins(plugins)
    module = importlib.import_module(f"benchmarks.{name}.__main__")
    status: int = module.main(arguments)
    return status


def _plugins_of(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """Splits a benchmark's arguments into the values of `--plugin` and all others."""
    parser = _Parser(add_help=False, allow_abbrev=False)
    _add_plugin(parser)
    options, others = parser.parse_known_args(words)
    return options.plugin, others


def _directory(
    out: str | None, default: Path, names: Sequence[str], inputs: Sequence[str | Path]
) -> Path:
    """Returns the output directory after checking that it is writable; it need not exist."""
    return prove_directory("--out", default if out is None else out, names, inputs)


def _number(text: str) -> int | float:
    """Returns the number in `text`, parsed as in a scenario."""
    try:
        value = plain_value(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number")
    return value


def _rate(text: str) -> float:
    value = float(_number(text))
    if value != 0.0 and not _RATES[0] <= value <= _RATES[1]:
        raise argparse.ArgumentTypeError(
            f"{text} is out of range, expected 0 or {_RATES[0]:g} to {_RATES[1]:g}"
        )
    return value


def _between(low: float, high: float) -> Callable[[str], float]:
    """Returns a parser of numbers from `low` to `high`."""

    def number(text: str) -> float:
        value = float(_number(text))
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"{text} is out of range, expected {low:g} to {high:g}"
            )
        return value

    return number


def _whole(text: str) -> int:
    value = _number(text)
    if not isinstance(value, int):
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number")
    return value


def _count(text: str) -> int:
    value = _whole(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is out of range, expected 1 or more")
    return value


def _seed(text: str) -> int:
    value = _whole(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is out of range, expected 0 or more")
    return value


def _up_to(most: int) -> Callable[[str], int]:
    """Returns a parser of whole numbers from 0 to `most`."""

    def number(text: str) -> int:
        value = _whole(text)
        if not 0 <= value <= most:
            raise argparse.ArgumentTypeError(f"{text} is out of range, expected 0 to {most}")
        return value

    return number


def _port(text: str) -> int:
    value, (least, most) = _whole(text), _PORTS
    if not least <= value <= most:
        raise argparse.ArgumentTypeError(f"{text} is out of range, expected {least} to {most}")
    return value


if __name__ == "__main__":
    sys.exit(main())
