"""Random mutations of scenarios."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from benchmarks.inputs.trials import Expect, Trial, place
from drake_dress.diagrams.scenario import apply_variation, load_scenario, resolved_yaml
from drake_dress.diagrams.setup import read_setup

Rng = np.random.Generator
_FOLDER = Path(__file__).parents[2] / "scenarios"
# Suffixes of keys whose quantities cannot be negative.
_POSITIVE = re.compile(
    r"(_length|_radius|_width|_depth|_mass|stiffness|damping|friction|rate|speed|time_step|period"
    r"|duration|spacing|density|tolerance|horizon|iterations|margin|shoulder_height|stop_time"
    r"|stale_\w+|force_limit|max_\w+|delay|wait|patience)$"
)
_YAML_1_1 = ("010", "1:30", "0x1F", "1_000", "0b11", "yes", "no", "on", "off", "2024-01-01", "~")


def draw_scenario(rng: Rng) -> Trial:
    """Returns a mutation of a valid scenario."""
    source = _pick(rng, sorted(_FOLDER.glob("*.yaml")))
    mutate = _pick(rng, _MUTATIONS)
    told, content, expect, same = mutate(rng, source)
    path = place() / "scenario.yaml"
    path.write_bytes(content)

    def use() -> str | None:
        scenario = load_scenario(path)
        expected = load_scenario(source)
        if same and resolved_yaml(scenario) != resolved_yaml(expected):
            return "it is another scenario now"
        wrong = _out_of_bounds(yaml.safe_load(resolved_yaml(scenario)))
        if wrong is None:
            read_setup(apply_variation(scenario), path)
        return wrong

    return Trial(f"{mutate.__name__[1:]} {source.stem} {told}", expect, use)


# A mutation: description, bytes of the file, expected outcome, and whether it must load as the same
# scenario.
_Mutated = tuple[str, bytes, Expect, bool]


def _leaves(content: Any, path: tuple[Any, ...] = ()) -> list[tuple[tuple[Any, ...], Any]]:
    if isinstance(content, dict):
        return [leaf for k, v in content.items() for leaf in _leaves(v, (*path, k))]
    if isinstance(content, list):
        return [leaf for k, v in enumerate(content) for leaf in _leaves(v, (*path, k))]
    return [(path, content)]


def _put(content: Any, path: tuple[Any, ...], value: Any) -> None:
    for name in path[:-1]:
        content = content[name]
    content[path[-1]] = value


def _whole(source: Path) -> dict[str, Any]:
    """Returns the resolved scenario without keys that are null."""

    def given(value: Any) -> Any:
        if isinstance(value, dict):
            return {k: given(v) for k, v in value.items() if v is not None}
        return value

    content: dict[str, Any] = given(yaml.safe_load(resolved_yaml(load_scenario(source))))
    return content


def _numbers(content: dict[str, Any]) -> list[tuple[tuple[Any, ...], float]]:
    return [
        (path, value)
        for path, value in _leaves(content)
        if isinstance(value, int | float) and not isinstance(value, bool)
    ]


def _pick(rng: Rng, items: Any) -> Any:
    return items[int(rng.integers(len(items)))]


def _dump(content: Any) -> bytes:
    return yaml.safe_dump(content, sort_keys=False).encode()


def _dotted(path: tuple[Any, ...]) -> str:
    return ".".join(map(str, path))


def _out_of_bounds(content: Any) -> str | None:
    """Returns an impossible value in an accepted scenario; None if there is none."""
    for path, value in _numbers(content):
        if not math.isfinite(value):
            return f"{_dotted(path)} is {value}"
        if _POSITIVE.search(str(path[-1])) and value < 0.0:
            return f"{_dotted(path)} is {value}"
        if abs(value) > 1e10 and path != ("seed",):
            return f"{_dotted(path)} is {value}"
    return None


def _far_number(rng: Rng, source: Path) -> _Mutated:
    content = _whole(source)
    path, _ = _pick(rng, [x for x in _numbers(content) if x[0] != ("seed",)])
    value = _pick(rng, (1e12, -1e12, 1e300, -1e300, math.nan, math.inf, -math.inf, 2**70, -(2**70)))
    _put(content, path, value)
    return f"{_dotted(path)}={value}", _dump(content), Expect.REFUSE, False


def _far_seed(rng: Rng, source: Path) -> _Mutated:
    content = _whole(source)
    content["seed"] = value = _pick(rng, (2**70, -1, -(2**80), 1.5, math.nan, math.inf, 1e300))
    return str(value), _dump(content), Expect.REFUSE, False


def _negative(rng: Rng, source: Path) -> _Mutated:
    content = _whole(source)
    known = [x for x in _numbers(content) if _POSITIVE.search(str(x[0][-1]))]
    path, value = _pick(rng, known)
    _put(content, path, -abs(value) if value else -1)
    return _dotted(path), _dump(content), Expect.REFUSE, False


def _impossible_measure(rng: Rng, source: Path) -> _Mutated:
    content = _whole(source)
    measures = content["person"]["measures"]
    name = _pick(rng, list(measures))
    measures[name] *= float(_pick(rng, (0.02, 10.0, 100.0, 1000.0)))
    return f"{name}={measures[name]:g}", _dump(content), Expect.REFUSE, False


def _wrong_type(rng: Rng, source: Path) -> _Mutated:
    content = _whole(source)
    path, old = _pick(rng, _leaves(content))
    choices: list[Any] = [{"a": 1}, [1, [2]], "wide", "", [], {}, [None]]
    value = _pick(rng, [*choices, 0.5 if isinstance(old, bool) else True])
    _put(content, path, value)
    # a text may be replaced by any text unless it must be one of several words
    expect = Expect.EITHER if isinstance(old, str) and isinstance(value, str) else Expect.REFUSE
    return f"{_dotted(path)}={value!r}", _dump(content), expect, False


def _nothing_there(rng: Rng, source: Path) -> _Mutated:
    content = _whole(source)
    path, _ = _pick(rng, _leaves(content))
    _put(content, path, None)
    return _dotted(path), _dump(content), Expect.EITHER, False


def _unknown_key(rng: Rng, source: Path) -> _Mutated:
    content = _whole(source)
    named = [leaf for leaf in _leaves(content) if all(isinstance(p, str) for p in leaf[0])]
    path, value = _pick(rng, named)
    name = path[-1]
    k = int(rng.integers(len(name)))
    wrong = _pick(
        rng, (name[:k] + name[k + 1 :] + "x", name.upper(), f"{name}\n{name}", name * 200)
    )
    _put(content, (*path[:-1], wrong), value)
    return repr(wrong)[:60], _dump(content), Expect.REFUSE, False


def _odd_key(rng: Rng, source: Path) -> _Mutated:
    content = _whole(source)
    key = _pick(rng, (1, None, 1.5, True, "", " ", "plant.spacing", "\x1b[31m"))
    content[key] = 1
    return repr(key), _dump(content), Expect.REFUSE, False


def _twice(rng: Rng, source: Path) -> _Mutated:
    lines = _dump(_whole(source)).decode().splitlines()
    keyed = [i for i, line in enumerate(lines) if re.match(r" *[a-z_]+:", line)]
    i = int(_pick(rng, keyed))
    indent = len(lines[i]) - len(lines[i].lstrip())
    end = i + 1
    while end < len(lines) and len(lines[end]) - len(lines[end].lstrip()) > indent:
        end += 1
    lines[end:end] = lines[i:end]
    return lines[i].strip()[:40], "\n".join(lines).encode(), Expect.REFUSE, False


def _twice_in_braces(rng: Rng, source: Path) -> _Mutated:
    number = float(rng.uniform(0.02, 0.05))
    text = source.read_text() + f"\nlog: {{rate: 30.0, rate: {number}}}\n"
    return f"{number:.3f}", text.encode(), Expect.REFUSE, False


def _yaml_1_1(rng: Rng, source: Path) -> _Mutated:
    content = _whole(source)
    path, old = _pick(rng, [x for x in _leaves(content) if isinstance(x[1], int | float | str)])
    word = _pick(rng, _YAML_1_1)
    _put(content, path, "@@@")
    text = _dump(content).decode().replace("'@@@'", word)
    # YAML 1.1 booleans may be accepted for a bool if documented; otherwise they are rejected
    expect = Expect.EITHER if isinstance(old, bool) or word == "~" else Expect.REFUSE
    if isinstance(old, str) and "channel" in str(path[-1]):
        expect = Expect.EITHER
    return f"{_dotted(path)}: {word}", text.encode(), expect, False


def _same_in_other_words(rng: Rng, source: Path) -> _Mutated:
    text = source.read_text()
    how = _pick(rng, ("bom", "crlf", "comments", "flow", "document", "quoted", "reordered"))
    content = yaml.safe_load(text)
    if how == "bom":
        data = b"\xef\xbb\xbf" + text.encode()
    elif how == "crlf":
        data = text.replace("\n", "\r\n").encode()
    elif how == "comments":
        data = _dump(content).decode().replace("\n", "  # é µ …\n").encode()
    elif how == "flow":
        data = yaml.safe_dump(content, default_flow_style=True).encode()
    elif how == "document":
        data = f"---\n{text}\n...\n".encode()
    elif how == "quoted":
        data = re.sub(r"^(\s*)([a-z_]+):", r"\1'\2':", _dump(content).decode(), flags=re.M).encode()
    else:
        names = list(content)
        rng.shuffle(names)
        data = _dump({name: content[name] for name in names})
    return how, data, Expect.ACCEPT, True


def _bytes(rng: Rng, source: Path) -> _Mutated:
    data = bytearray(source.read_bytes())
    how = _pick(rng, ("flip", "drop", "insert", "cut", "swap"))
    for _ in range(int(rng.integers(1, 6))):
        k = int(rng.integers(len(data)))
        if how == "flip":
            data[k] ^= 1 << int(rng.integers(8))
        elif how == "drop":
            del data[k : k + int(rng.integers(1, 9))]
        elif how == "insert":
            data[k:k] = rng.bytes(int(rng.integers(1, 5)))
        elif how == "swap":
            j = int(rng.integers(len(data)))
            data[k], data[j] = data[j], data[k]
    if how == "cut":
        del data[int(rng.integers(1, len(data))) :]
    return how, bytes(data), Expect.EITHER, False


def _encoded(rng: Rng, source: Path) -> _Mutated:
    how = _pick(rng, ("utf-16", "utf-32", "latin-1"))
    text = source.read_text() + "# ß é\n"
    expect = Expect.REFUSE if how == "latin-1" else Expect.EITHER
    return how, text.encode(how), expect, False


def _structure(rng: Rng, source: Path) -> _Mutated:
    text = source.read_text()
    how, data = _pick(
        rng,
        (
            ("deep", "[" * 5000 + "]" * 5000),
            ("deep group", "".join(f"{' ' * i}a:\n" for i in range(1500))),
            ("bomb", _bomb()),
            ("python tag", text + "\nlog: !!python/object/apply:os.getcwd []\n"),
            ("tag", text + "\nlog: !Fast {rate: 30}\n"),
            ("two documents", text + "\n---\nseed: 3\n"),
            ("list", "- 1\n"),
            ("text", "hello"),
            ("number", "3"),
            ("nul", text + "\0"),
            ("merge", "a: &a {seed: 1}\n<<: *a\n"),
            ("anchor of itself", "plant: &p {material: *p}\n"),
            ("complex key", "? [1, 2]\n: 3\n"),
            ("long digit", "seed: " + "9" * 6000),
            ("long text", "person: {posture: " + "x" * 100_000 + "}"),
        ),
    )
    return how, data.encode(), Expect.REFUSE, False


def _bomb() -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    for k in range(1, 12):
        lines.append(f"a{k}: &a{k} [" + ", ".join([f"*a{k - 1}"] * 10) + "]")
    return "\n".join(lines)


def _contradiction(rng: Rng, source: Path) -> _Mutated:
    content = _whole(source)
    how = int(rng.integers(5))
    if how == 0:
        content["controller"]["global_mpc"]["delay"] = content["controller"]["global_mpc"]["period"]
    elif how == 1:
        content["safety"]["soft_force_limit"] = content["safety"]["force_limit"] + 1.0
    elif how == 2:
        content["safety"]["largest_distance"] = 0.5 * content["safety"]["least_distance"]
    elif how == 3:
        content["station"]["hardware"]["lcm_url"] = "http://example"
    else:
        content["garment"]["coat"].update(cuff_girth=0.59, armhole_girth=0.4)
    return str(how), _dump(content), Expect.REFUSE, False


_MUTATIONS: tuple[Callable[[Rng, Path], _Mutated], ...] = (
    _far_number,
    _far_seed,
    _negative,
    _impossible_measure,
    _wrong_type,
    _nothing_there,
    _unknown_key,
    _odd_key,
    _twice,
    _twice_in_braces,
    _yaml_1_1,
    _same_in_other_words,
    _bytes,
    _encoded,
    _structure,
    _contradiction,
)
