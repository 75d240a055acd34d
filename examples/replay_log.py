"""Writes the replay of a log as one HTML file: replay_log.py [run.h5]."""

import sys
from pathlib import Path

from drake_dress import dressing

if len(sys.argv) > 1:
    file = Path(sys.argv[1])
else:
    scenario = dressing.load_scenario("dummy_standing", ["plant.fidelity=quick", "duration=1"])
    file = dressing.run(scenario, "out/short", report=False).out / "run.h5"
with dressing.open_log(file) as log:
    page = file.with_name("my_replay.html")
    dressing.write_replay(log, page)
    print(f"{log.time[-1]:.1f} s in {page.name}, {page.stat().st_size / 1e6:.1f} MB")
# dressing.show_replay(file) shows it in Meshcat, with a slider, until Ctrl-C
