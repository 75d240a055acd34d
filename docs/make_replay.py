"""Makes the small replay of the front page: python docs/make_replay.py run.h5 OUT.html [BYTES]."""

from __future__ import annotations

import sys

from drake_dress.report.log import RunLog
from drake_dress.report.replay_html import write_replay_html


def main(arguments: list[str]) -> None:
    """Writes a replay with as many frames as fit into BYTES, 2 MB if not given."""
    log, page, *most = arguments
    with RunLog.open(log) as run:
        write_replay_html(run, page, max_bytes=int(most[0]) if most else 2_000_000)


if __name__ == "__main__":
    main(sys.argv[1:])
