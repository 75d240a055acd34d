"""Explains a recording given as arrays: explain_recording.py."""

from typing import Any

from drake_dress import explain

QUICK = ["plant.spacing=0.06", "plant.time_step=0.008", "plant.tolerance=2e-3"]


def recorded() -> dict[str, Any]:
    """Returns arrays as recorded by a lab; here a simulated lab with displaced cameras."""
    session = explain.Session(motions=["sway"], duration=1.6)
    lab = explain.simulate("measured", "camera_translation", QUICK, size=3.0, session=session)
    return {
        "time": lab.recordings[0].time,  # (T,) s
        "gripper_position": lab.recordings[0].gripper_position,  # (T,2,3) m
        "gripper_force": lab.recordings[0].gripper_force,  # (T,2,3) N
        "marker_position": lab.recordings[0].marker_position,  # (T,m,3) m, NaN where not seen
        "marker_rest_position": lab.recordings[0].marker_rest_position,  # (m,3) m
    }


if __name__ == "__main__":
    sway = explain.Measurement(**recorded(), name="sway")
    (checked,) = explain.check_recordings(sway, "measured", QUICK)
    print(f"{checked.duration:.1f} s, markers good to {1e3 * checked.marker_noise:.1f} mm")
    tried = ["camera_translation", "rest_size", "surface_density"]  # all effects without this line
    found = explain.explain(sway, "measured", QUICK, effects=tried)
    print(found)
    for cause in found.causes:
        print(cause.name, cause.effect, cause.std, f"confidence {cause.confidence:.0%}")
    before, after = found.residual["before"], found.residual["after"]
    print(f"markers off by {1e3 * before['marker_m']:.0f}, now {1e3 * after['marker_m']:.0f} mm")
