"""Reads a run's log into a pandas table: read_log.py [run.h5]; without a log, makes a short run."""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np
import pandas as pd

from drake_dress.__main__ import main


def read_log(path: str | Path) -> pd.DataFrame:
    """Returns progress s, gripper force, N, and stage of both sides over time, s."""
    columns = {}
    with h5py.File(path) as log:
        for column, side in enumerate(("left", "right")):
            columns[f"s_{side}"] = log[f"dressing/{side}/s"][:]
            columns[f"force_{side}"] = np.linalg.norm(log[f"gripper/{side}/force"], axis=1)
            columns[f"stage_{side}"] = log["control/stage"][:, column]
        return pd.DataFrame(columns, index=pd.Index(log["time"][:], name="time"))


with TemporaryDirectory() as folder:
    if sys.argv[1:]:
        path = sys.argv[1]
    else:
        short = ["--set", "duration=0.5", "--set", "plant.fidelity=quick", "--one-process"]
        main(["run", "dummy_standing", *short, "--no-meshcat", "--no-report", "--out", folder])
        path = f"{folder}/run.h5"
    table = read_log(path)
print(table.iloc[:: max(1, len(table) // 5)].round(2).to_string())
print(f"largest force on a gripper: {table.filter(like='force').to_numpy().max():.1f} N")
