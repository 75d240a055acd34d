"""Makes the picture of all cuts: python docs/make_coats_picture.py OUT.png."""

from __future__ import annotations

import sys

import matplotlib.image
import numpy as np
import numpy.typing as npt

from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.report.stills import CameraPose, render_still

SPACING = 0.015  # m
SIZE = (250, 330)
# Where the camera stands around the coat, deg from its front.
DIRECTIONS = (25.0, 205.0)
TARGET = np.array([0.0, 0.0, -0.42])
DISTANCE = 3.0  # m
FLOOR = -50.0  # m: out of the picture


def row(degrees: float) -> npt.NDArray[np.uint8]:
    """Returns the pictures of all cuts from one direction, side by side."""
    at = np.deg2rad(degrees)
    eye = TARGET + DISTANCE * np.array([np.cos(at), np.sin(at), 0.2])
    nobody = np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)
    pictures = []
    for cut in COATS.values():
        mesh = make_coat(cut, SPACING)
        camera = CameraPose(tuple(eye), tuple(TARGET))
        pictures.append(
            render_still(
                mesh.faces, mesh.rest_position, nobody, np.zeros((0, 3)), camera, SIZE, FLOOR
            )
        )
    return np.concatenate(pictures, axis=1)


def main(arguments: list[str]) -> None:
    """Renders every cut from all directions, one row each, in the order of `COATS`."""
    matplotlib.image.imsave(arguments[0], np.concatenate([row(d) for d in DIRECTIONS]))


if __name__ == "__main__":
    main(sys.argv[1:])
