"""The card of a set of motion: what it is, how it was made, its figures and its limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from drake_dress.learning.motion.dataset import (
    PARTS,
    PER_FILE,
    TEST_SHARE,
    VALIDATION_SHARE,
    MotionSet,
    part_range,
)
from drake_dress.learning.motion.figures import Figures
from drake_dress.learning.motion.sequence import AT_REST, COUNT, DURATION, KINDS, PERIOD

_MADE = f"""\
Sequences of {DURATION:g} s at {1 / PERIOD:g} Hz ({COUNT} samples): the joints of a person's arms,
and the armholes of a coat that a robot puts on. They are for learning to predict the motion of the
arms, and to tell whether an arm moves by the person's own will. The data are synthetic. No person
was recorded.

## How it was made

Each sequence draws a person (body measures, standing or sitting, joint limits, comfortable pose;
one in five has a tremor, one in five does not sway, and two in five hold their arms back toward a
coat behind them) and a coat (measures). It begins in a random phase of a dressing: no arm, one arm
or both arms in their sleeves.

- **passive**: the person never moves by will. Two grippers lead the sleeves by the local model of
  the controller: over the hand, which cloth may hinder for a while, up the arm, aside, across to
  the other hand, about, or nowhere. An arm follows its sleeve with the least effort of its joints,
  after a lag. Some arms stay where they are led, others return slowly or spring back.
- **active**: in addition, each hand now and then reaches, returns, fidgets, withdraws or waves, and
  reaches into its sleeve when the armhole comes near, and goes on after it. The body may lean along
  or turn. Strokes have bell-shaped speed profiles, with hesitations and changes of mind. Between
  its movements an arm follows its sleeve. A sleeve on an arm that moves by will goes along with it.
- **free**: no garment. The person reaches more often and faster, steps, bends, squats, turns or
  walks.
"""

_CONTENT = f"""\
## Content

`motion-<kind>-<first number>.h5` has {PER_FILE} sequences; the last file of a kind may have fewer.

| dataset | shape | meaning |
| --- | --- | --- |
| `joint_position` | (n, {COUNT}, 6, 3) | shoulder, elbow, hand; left arm, then right, m, world |
| `sleeve` | (n, {COUNT}, 2, 6) | left and right armhole: centre, m, and unit direction, world |
| `intent` | (n, {COUNT}, 2) | 1 while left or right arm moves by the person's own will, else 0 |
| `on` | (n, {COUNT}, 2) | 1 while left or right arm is in its sleeve, else 0 |
| `time` | ({COUNT},) | s |

The direction of an armhole is that from the cuff to it. Without a garment, `sleeve` is NaN.
`intent` is 1 while will moves the arm, not while the hand pauses in a movement or is held where it
was drawn; and for both arms while the body turns, leans, steps or walks. It is 0 where the hand is
slower than {100 * AT_REST:g} cm/s.
"""

_LIMITS = """\
## What it does not hold

- Real persons. The movements follow rules and published profiles; people vary more, and in other
  ways.
- Cloth. A sleeve is one point and one direction. Nothing wrinkles, catches or slides, and no force
  is known.
- Contact of the body. Arms can pass through the trunk, the legs and each other, and hands through
  the floor.
- Arms that are held back: a movement by will goes where it aims, whatever the garment would do.
- Hands, fingers, heads and legs. The trunk is rigid; shoulders move in it by a few centimetres at
  most.
- Errors of a camera: joints and armholes are true, complete and free of noise.
- Gripper positions, the plan of the robot, and garments other than coats.
"""

_EXPLANATION = f"""\
Shares are of the time of both arms. A hand is at rest while it is slower than {100 * AT_REST:g}
cm/s. Travel is the largest distance from the first place in a sequence. Pairs are the median and
the 95 % quantile.
"""
_COLUMNS = (
    "by will",
    "at rest",
    "hand speed, m/s",
    "hand travel, m",
    "shoulder travel, m",
    "in the sleeve",
)


def card(
    known: MotionSet,
    command: str,
    figures: Mapping[str, Figures],
    dressings: Mapping[str, Figures],
    dressed: int,
) -> str:
    """Returns the card of a set as Markdown.

    Args:
        known: what the folder holds.
        command: that makes the set.
        figures: of each kind that the set has.
        dressings: figures of the whole dressings, by person; empty if there are none.
        dressed: number of these that succeeded.
    """
    told = [
        f"# Motion of persons in garments\n\n{_MADE}",
        f"Made by drake_dress {known.version}, seed {known.seed}:\n\n```text\n{command}\n```\n",
        _CONTENT,
        f"## Figures\n\n{_table('kind', 'sequences', figures)}\n{_EXPLANATION}",
        _parts(known),
    ]
    if dressings:
        told.append(_dressings(dressings, dressed))
    return "\n".join([*told, _LIMITS])


def _table(of: str, counted: str, figures: Mapping[str, Figures]) -> str:
    """Returns a Markdown table with one row for each of `figures`."""
    head = (of, counted, "time, min", *_COLUMNS)
    lines = [_row(head), _row(["---"] * len(head))]
    for name, f in figures.items():
        pairs = (f"{a:.2f} / {b:.2f}" for a, b in (f.speed, f.hand_travel, f.shoulder_travel))
        shares = f"{100 * f.will:.1f} %", f"{100 * f.rest:.1f} %"
        cells = (name, f.count, f"{f.time / 60:.1f}", *shares, *pairs, f"{100 * f.on:.1f} %")
        lines.append(_row(cells))
    return "\n".join(lines) + "\n"


def _row(cells: Sequence[object]) -> str:
    return "| " + " | ".join(map(str, cells)) + " |"


def _parts(known: MotionSet) -> str:
    """Returns the section on training, validation and test."""
    lines = [_row(("kind", *PARTS)), _row(["---"] * (1 + len(PARTS)))]
    for kind in KINDS:
        ranges = [part_range(part, known.counts[kind]) for part in PARTS]
        cells = [f"{r.start} to {r.stop - 1}" if len(r) else "none" for r in ranges]
        if known.counts[kind]:
            lines.append(_row((kind, *cells)))
    return f"""\
## Training, validation and test

By number within a kind, the last {100 * TEST_SHARE:g} % of the sequences are for the test, the
{100 * VALIDATION_SHARE:g} % before them for validation, all others for training. Each sequence has
its own person. `read_motion` of `drake_dress.learning.motion.dataset` reads a part. A set of
another size has other parts.

""" + "\n".join([*lines, ""])


def _dressings(figures: Mapping[str, Figures], dressed: int) -> str:
    """Returns the section on whole dressings."""
    runs = sum(f.count for f in figures.values())
    return f"""\
## Whole dressings

`dressing-<person>-<seed>.h5` is a run of the simulator with cloth, contact and controllers: the
whole of a dressing, at the same rate. **Nothing is trained on these files.** They show how well
what was learned from the sequences above does in another model of persons and garments. {dressed}
of {runs} runs ended with both sleeves on. Coat, body and pose vary as in `dummy_varied`. An active
person reaches into both sleeves; a turn, a withdrawal and a wave each occur in half of the runs.
Attributes give `person`, `run_seed`, `dressed`, `reason` and the `scenario` of the run.

{_table("person", "runs", figures)}"""
