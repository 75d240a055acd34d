"""Allowed words and ranges of a scenario's values."""

import math
import re

from drake_dress.diagrams.scenario.coat import COAT_MEASURES
from drake_dress.diagrams.scenario.fidelity import FIDELITIES
from drake_dress.models.dressing.stages import FIRST
from drake_dress.models.effects.registry import EFFECTS
from drake_dress.models.garment.axes import AXES
from drake_dress.models.garment.coat import COATS, COLLARS, OPENINGS, SIZE_TABLES
from drake_dress.models.garment.hold import HOLDS
from drake_dress.models.garment.life_size import AUTO, UNITS
from drake_dress.models.garment.mesh import LOOP_NAMES
from drake_dress.models.garment.mesh_options import FRONTS, SCALE_RANGE, WELD_RANGE
from drake_dress.models.garment.rest import RESTS
from drake_dress.models.human.prediction import PREDICTORS
from drake_dress.models.human.skin.phenotype import AGE_RANGE, HEIGHT_RANGE, WEIGHT_RANGE
from drake_dress.models.human.skin.scan import JOINT_NAMES
from drake_dress.models.human.wheelchair import ARMRESTS
from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.injection import KINDS

# Sources of the lab's messages, in addition to its cameras.
SOURCES = ("left_arm", "right_arm", "garment", "person")
# Text values that may be written as a number.
NUMBERS_AS_TEXT = ("garment.coat.size",)
# Allowed words of text values (Drake's loader has no literal types).
CHOICES = {
    "garment.coat.preset": tuple(COATS),
    "garment.coat.size_table": SIZE_TABLES,
    "garment.coat.collar": COLLARS,
    "garment.coat.opens": OPENINGS,
    "garment.coat.grasp": ("patch", "seam"),
    "garment.hold": HOLDS,
    "garment.mesh.unit": (*UNITS, AUTO),
    "garment.mesh.up": AXES,
    "garment.mesh.facing": AXES,
    "garment.mesh.front": FRONTS,
    "garment.mesh.rest": RESTS,
    "person.posture": ("standing", "sitting"),
    "person.body.sex": ("female", "male"),
    "person.body.scan.unit": tuple(UNITS),
    "person.body.scan.up": AXES,
    "person.chair.armrests": ARMRESTS,
    "person.behaviour.kind": ("dummy", "passive", "active"),
    **{
        f"person.behaviour.motions.{motion}.side": ("left", "right", "both")
        for motion in ("reach", "withdraw", "wave")
    },
    "person.behaviour.spasm.side": ("left", "right", "both"),
    "plant.fidelity": tuple(FIDELITIES),
    "plant.integrator": ("implicit", "projective_dynamics", "mujoco"),
    "controller.stages.first": FIRST,
    "controller.method": ("full", "global", "local"),
    "controller.local.solver": ("constrained_ddp", "cone"),
    "station.kind": ("simulated", "hardware"),
    "station.hardware.release": ("confirm", "automatic"),
    "station.side": ("behind", "front"),
    "perception.kind": ("oracle", "cameras"),
    "lab.faults.kind": KINDS,
    "station.arms.model": ("floating", "panda"),
    "station.arms.mode": ("position_velocity", "position", "velocity"),
}

# Ranges, including both ends, by the end of the dotted key. The longest matching end counts. Every
# number of the schema has a range.
_RANGES: dict[str, tuple[float, float]] = {
    "seed": (0, 2**63 - 1),
    "duration": (0.1, 86400.0),
    "garment.hold_depth": (0.0, 1.5),
    "arms.distance_behind": (-5.0, 5.0),
    "arms.spread": (0.0, 5.0),
    "arms.height_offset": (-2.0, 2.0),
    "arms.tilt_deg": (-180.0, 180.0),
    "arms.rate": (50.0, 1000.0),
    "resolved_rate.position_gain": (0.0, 200.0),
    "resolved_rate.rotation_gain": (0.0, 200.0),
    "resolved_rate.outward_gain": (0.0, 20.0),
    "resolved_rate.outward_distance": (0.0, 5.0),
    "resolved_rate.home_gain": (0.0, 20.0),
    "resolved_rate.max_turning": (0.0, 10.0),
    "resolved_rate.rotation_weight": (0.0, 1e4),
    "resolved_rate.slowdown_weight": (0.0, 1e4),
    "resolved_rate.least_distance": (0.0, 0.5),
    "resolved_rate.seen_distance": (0.0, 2.0),
    "resolved_rate.approach_acceleration": (0.01, 50.0),
    "constant_velocity.history_length": (2, 200),
    "constant_velocity.sample_period": (0.005, 1.0),
    "constant_velocity.max_speed": (0.0, 10.0),
    "constant_velocity.decay_time": (0.01, 1e6),
    "constant_velocity.least_samples": (2, 200),
    "hardware.status_rate": (20.0, 1000.0),
    "hardware.estimate_rate": (1.0, 200.0),
    "hardware.stale_status": (0.01, 1.0),
    "hardware.stale_estimate": (0.02, 5.0),
    "hardware.stale_camera": (0.05, 10.0),
    "hardware.settle_time": (0.0, 10.0),
    "hardware.patience": (0.0, 60.0),
    "hardware.wait": (0.1, 3600.0),
    "hardware.start_distance": (0.0, 0.2),
    "hardware.start_angle": (0.0, 1.0),
    "beliefs.joint_leap": (0.001, 1.0),
    "beliefs.torque_share": (0.1, 100.0),
    "beliefs.point_error": (0.001, 0.1),
    "beliefs.limb_share": (0.0, 0.5),
    "beliefs.shoulder_distance": (0.02, 2.0),
    "beliefs.turn_deg": (5.0, 150.0),
    "beliefs.joint_room_deg": (0.0, 60.0),
    "beliefs.person_speed": (0.1, 20.0),
    "beliefs.frozen_time": (0.0, 60.0),
    "beliefs.node_noise": (0.0, 0.05),
    "beliefs.strain": (0.0, 1.0),
    "beliefs.least_edge": (0.0, 0.95),
    "beliefs.grasp_distance": (0.01, 1.0),
    "beliefs.garment_speed": (0.1, 20.0),
    "beliefs.garment_velocity": (0.1, 100.0),
    "beliefs.velocity_error": (0.05, 20.0),
    "beliefs.frozen_travel": (0.0, 1.0),
    "lab.stale_command": (0.01, 1.0),
    "lab.wait": (0.1, 3600.0),
    "lab.rest": (0.0, 60.0),
    "lab.push": (0.0, 200.0),
    "cameras.position": (-100.0, 100.0),
    "cameras.target": (-100.0, 100.0),
    "lab.person_noise": (0.0, 0.02),
    "cameras.width": (16, 4096),
    "cameras.height": (16, 4096),
    "cameras.fov_deg": (5.0, 150.0),
    "cameras.rate": (0.5, 60.0),
    "camera_errors.latency": (0.0, 1.0),
    "camera_errors.position": (0.0, 0.1),
    "camera_errors.rotation_deg": (0.0, 10.0),
    "stereo.baseline": (0.005, 0.5),
    "stereo.disparity_noise": (0.0, 2.0),
    "stereo.noise_width": (0.1, 20.0),
    "stereo.disparity_step": (0.0, 2.0),
    "stereo.grazing_deg": (0.0, 90.0),
    "stereo.grazing_spread_deg": (0.0, 45.0),
    "stereo.jump": (0.001, 1.0),
    "stereo.flying": (0.0, 1.0),
    "stereo.edge_loss": (0.0, 1.0),
    "stereo.missing": (0.0, 1.0),
    "stereo.patch_width": (0.1, 200.0),
    "stereo.nearest": (0.0, 5.0),
    "stereo.farthest": (0.1, 50.0),
    "segmentation.outline": (0.0, 50.0),
    "segmentation.outline_width": (0.1, 200.0),
    "segmentation.missed": (0.0, 1.0),
    "segmentation.patch_width": (0.1, 200.0),
    "perception.spacing": (0.01, 0.1),
    "perception.period": (0.005, 5.0),
    "perception.delay": (0.0, 5.0),
    "perception.memory": (0.0, 5.0),
    "filter.time_step": (0.002, 0.2),
    "filter.implicitness": (0.5, 1.0),
    "filter.buckling_wavelength": (0.0, 100.0),
    "filter.rounds": (1, 20),
    "filter.shrinking": (0.05, 1.0),
    "filter.least_reach": (0.001, 0.5),
    "filter.velocity_time": (0.01, 1e3),
    "filter.bias_time": (0.01, 1e3),
    "filter.bias_fading": (0.01, 1e6),
    "points.jump": (0.001, 1.0),
    "points.spacing": (0.002, 0.2),
    "pulls.deviation": (1e-4, 1.0),
    "pulls.across": (0.0, 1.0),
    "pulls.reach": (0.005, 1.0),
    "pulls.robust": (0.01, 100.0),
    "pulls.depth": (0.0, 1.0),
    "pulls.through_depth": (0.0, 2.0),
    "pulls.through_pixels": (0.0, 200.0),
    "pulls.through_deviation": (1e-4, 1.0),
    "pulls.through_reach": (0.0, 1.0),
    "correction.deviation": (1e-4, 1.0),
    "correction.alone": (1e-4, 1e3),
    "correction.together": (0.0, 1e5),
    "correction.tolerance": (1e-9, 0.5),
    "correction.iterations": (1, 10_000),
    "lab.faults.start": (0.0, 1e4),
    "lab.faults.duration": (0.0, 1e4),
    "coat.scale": (0.7, 1.4),
    **{
        f"coat.{name}": (0.0, 3.0)  # m; checked together when the coat is made
        for name in COAT_MEASURES
    },
    "coat.sleeve_slope_deg": (0.0, 90.0),
    **{f"mesh.loops.{name}": (0, 2**31 - 1) for name in LOOP_NAMES},
    **{f"mesh.grasp.{side}": (0, 2**31 - 1) for side in SIDES},
    "mesh.weld": WELD_RANGE,
    "mesh.scale": SCALE_RANGE,
    "body.age": AGE_RANGE,
    "body.height": HEIGHT_RANGE,
    "body.weight": WEIGHT_RANGE,
    "body.muscle": (0.0, 1.0),
    **{f"scan.joints.{name}": (-1e6, 1e6) for name in JOINT_NAMES},  # in any unit
    "material.surface_density": (0.01, 5.0),
    "material.stretch_stiffness": (1.0, 1e5),
    "material.bending_stiffness": (0.0, 1.0),
    "material.damping": (0.0, 1.0),
    "material.friction": (0.0, 2.0),
    "material.margin": (0.0, 0.02),
    "plant.spacing": (0.01, 0.06),
    "controller.spacing": (0.01, 0.06),
    "plant.time_step": (1e-4, 0.05),
    "plant.body_time_step": (1e-4, 0.02),
    "plant.implicitness": (0.5, 1.0),
    "plant.buckling_wavelength": (0.0, 100.0),
    # beyond this, a pushing arm is thrown back within a step
    "plant.grasp_stiffness": (1.0, 1e4),
    "plant.iterations": (1, 1000),
    "plant.tolerance": (1e-10, 0.5),
    "shoulder_stiffness": (0.0, 1000.0),
    "shoulder_damping": (0.0, 1000.0),
    "elbow_stiffness": (0.0, 1000.0),
    "elbow_damping": (0.0, 1000.0),
    "joints.tone": (0.0, 1.0),
    "left_joints.tone": (0.0, 1.0),
    "right_joints.tone": (0.0, 1.0),
    "stages.alike_room": (0.0, 1.0),
    "spasm.torque": (0.0, 30.0),
    "spasm.interval": (1.0, 600.0),
    "spasm.duration": (0.0, 60.0),
    **{
        f"{name}_limits_deg": (-180.0, 180.0)
        for name in ("abduction", "extension", "rotation", "elbow")
    },
    "abduction_deg": (-30.0, 150.0),
    "extension_deg": (-150.0, 70.0),
    "rotation_deg": (-70.0, 70.0),
    "elbow_deg": (0.0, 140.0),
    "following.time_constant": (0.05, 1000.0),
    "following.threshold": (0.0, 100.0),
    "following.return_time_constant": (0.05, 1000.0),
    "following.max_speed": (0.01, 5.0),
    "behaviour.max_hand_speed": (0.01, 2.0),
    "behaviour.max_joint_speed": (0.01, 10.0),
    "reach.start": (0.0, 600.0),
    "reach.within": (0.01, 1.0),
    "reach.push": (0.0, 0.3),
    "turn.angle_deg": (-90.0, 90.0),
    "turn.start": (0.0, 600.0),
    "turn.duration": (0.1, 60.0),
    "withdraw.start": (0.0, 600.0),
    "withdraw.duration": (0.1, 600.0),
    "withdraw.distance": (0.01, 0.4),
    "wave.start": (0.0, 600.0),
    "wave.duration": (0.1, 600.0),
    "wave.amplitude": (0.001, 0.3),
    "wave.frequency": (0.1, 5.0),
    "tremor.amplitude": (0.0, 0.05),
    "tremor.frequency": (1.0, 15.0),
    "lowering.duration": (0.0, 60.0),
    "stirring.amplitude": (0.0, 0.3),
    "stirring.frequency": (0.05, 3.0),
    "global_mpc.period": (0.05, 10.0),
    "global_mpc.delay": (0.001, 10.0),
    "global_mpc.time_step": (0.005, 2.0),
    "global_mpc.horizon": (1, 100),
    "global_mpc.max_iterations": (1, 1000),
    "global_mpc.budget": (1, 10**9),
    "global_mpc.delay_share": (0.05, 1.0),
    "global_mpc.spread_share": (0.0, 3.0),
    "global_mpc.span_share": (0.1, 1.1),
    "global_mpc.inner_iterations": (1, 1000),
    "global_mpc.max_speed": (0.001, 1.0),
    "global_mpc.progress_step": (0.001, 1.0),
    "global_mpc.approach_distance": (0.0, 1.0),
    "global_mpc.waiting_progress": (0.05, 2.0),
    "global_mpc.force_limit": (1.0, 200.0),
    "local.period": (0.001, 1.0),
    "local.delay": (1e-4, 1.0),
    "local.time_step": (0.005, 1.0),
    "local.horizon": (1, 200),
    "local.prediction_step": (0.01, 2.0),
    "local.position": (0.0, 1e6),
    "local.speed": (1e-6, 1e6),
    "local.max_speed": (0.001, 1.0),
    "local.stretch": (0.1, 1.0),
    "local.beside": (0.001, 1.0),
    "local.beside_speed": (0.001, 10.0),
    "local.dragged": (0.0, 1.0),
    "local.prepare_correction": (0.0, 1.0),
    "local.dress_correction": (0.0, 1.0),
    "weights.position": (0.0, 1e6),
    "weights.direction": (0.0, 1e6),
    "weights.speed": (0.0, 1e6),
    "weights.safety": (0.0, 1e6),
    "weights.free_force": (0.0, 1e3),
    "weights.separation": (0.0, 1e6),
    "weights.least_spread": (0.0, 1.0),
    "weights.entering_spread": (0.0, 1.0),
    "weights.clearance": (0.0, 1e6),
    "weights.free_clearance": (0.0, 1.0),
    "weights.level": (0.0, 1e6),
    "weights.least_level": (0.0, 1.0),
    "weights.corridor": (0.0, 1e6),
    "weights.corridor_radius": (0.0, 1.0),
    "weights.corridor_length": (0.0, 2.0),
    "weights.passage": (0.0, 1e6),
    "weights.passage_radius": (0.0, 1.0),
    "weights.passage_length": (0.0, 2.0),
    "weights.collar": (0.0, 1e6),
    "weights.leading": (0.0, 1e6),
    "weights.leading_level": (0.0, 1.0),
    "insertion.rollouts": (0, 1000),
    "insertion.after": (0, 1000),
    "insertion.budget": (100, 10**8),
    "insertion.refined": (1, 1000),
    "insertion.gain": (0.0, 10.0),
    "insertion.again_near": (0.0, 1.0),
    "insertion.again": (0.0, 1.0),
    "insertion.patience": (1, 100_000),
    **{f"insertion.{name}": (-1.0, 1.0) for name in ("behind", "beside", "over", "beyond")},
    "insertion.start_distance": (0.0, 2.0),
    "insertion.spread": (0.0, 0.5),
    "insertion.fine": (0.0, 0.5),
    "insertion.shift": (0.0, 0.2),
    "insertion.turn": (0.0, 3.0),
    **{f"insertion.tilt_{name}": (-1.5, 1.5) for name in ("behind", "beside", "over")},
    "insertion.stretch": (0.3, 1.3),
    "insertion.least_level": (0.0, 1.0),
    "insertion.clearance": (0.0, 0.3),
    "insertion.near": (0.02, 1.0),
    "insertion.depth": (0.01, 0.5),
    "insertion.free_force": (0.0, 1e3),
    "insertion.force": (0.0, 1e3),
    "insertion.time": (0.0, 10.0),
    "insertion.substeps": (1, 100),
    "insertion.iterations": (1, 1000),
    "insertion.stretch_stiffness": (1.0, 1e5),
    "finish.laid_distance": (0.001, 0.2),
    "finish.open_distance": (0.001, 0.5),
    "finish.stall_time": (0.1, 60.0),
    "finish.stall_progress": (0.0, 0.1),
    "finish.least_time": (0.0, 60.0),
    "finish.steady_time": (0.0, 60.0),
    "finish.lowering_progress": (0.0, 2.0),
    "finish.hanging_progress": (0.0, 2.0),
    "finish.hanging_angle": (0.0, 1.6),
    "finish.hanging_time": (0.0, 60.0),
    "finish.lost_progress": (0.0, 2.0),
    "finish.gripper_height": (0.0, 0.5),
    "finish.max_speed": (0.005, 1.0),
    "finish.away_speed": (0.01, 1.0),
    "finish.away_distance": (0.0, 1.0),
    "finish.front_distance": (0.0, 1.0),
    "finish.watch_time": (0.0, 600.0),
    # shares, m and s, each much wider than the useful range
    **{
        f"stages.{name}": bounds
        for bounds, names in {
            (0.0, 1.0): ("least_sight", "lost_sight", "stall_progress", "alike"),
            (0.0, 2.0): ("done_progress", "kept_progress", "creeping_progress"),
            (0.0, 3.0): (
                "prepared_distance",
                "missed_distance",
                "reach",
                "meeting_distance",
                "pushed_distance",
                "entering_distance",
                "lingering_distance",
                "barred_distance",
            ),
            (0.0, 600.0): (
                "sight_time",
                "lingering_timeout",
                "insertion_timeout",
                "barred_timeout",
                "stall_timeout",
                "easing_time",
                "retreat_time",
                "withdrawal_time",
                "swing_time",
            ),
            (1, 1000): ("withdrawal_after", "swing_after"),
        }.items()
        for name in names
    },
    **{
        f"tasks.{name}": bounds
        for bounds, names in {
            (0.0, 1.0): ("flat", "steep", "clear_sight", "widening"),
            (-1.0, 1.0): ("led_inward",),
            (0, 1000): ("led_after",),
            (0.0, 2.0): (
                "tethered_approach_distance",
                "behind_distance",
                "retreat_distance",
                "passing_back",
                "withdrawal_distance",
                "swing_reach",
                "swing_outward",
                "passing_outward",
                "edge_outward",
                "edge_back",
                "passing_behind",
                "passing_from",
                "passing_beside",
                "outlook_distance",
                "longest_reach",
                "funnel_wide",
                "funnel_narrow",
                "funnel_radius",
                "funnel_distance",
                "leading_distance",
                "leading_behind",
                "aside_free",
                "overshoot",
                "inside_radius",
                "touch_distance",
                "edge_touch",
                "near_distance",
                "elbow_outward",
                "elbow_lead",
                "waiting_reach",
                "largest_aside",
                "final_progress",
                "held_progress",
                "settling_speed",
                "largest_lead",
            ),
            (0.0, 100.0): (
                "approach_slope",
                "near_position",
                "near_direction",
                "dressing_direction",
                "dressing_position",
            ),
        }.items()
        for name in names
    },
    **{
        f"{group}.{name}": bounds
        for group in ("approaches", "tethered_approaches", "edge_approaches", "led_approach")
        for name, bounds in {
            "share": (0.0, 1.0),
            "orientation": (0.0, 1.0),
            "emphasis": (0.0, 100.0),
            "tilt": (0.0, 1.0),
        }.items()
    },
    "local.return_speed": (0.0, 1.0),
    "local.taut_share": (0.0, 1.0),
    "local.coupled_share": (0.0, 1.0),
    "local.released_share": (0.0, 1.0),
    "command_rate": (10.0, 1000.0),
    "safety.max_speed": (0.001, 2.0),
    "safety.max_acceleration": (0.01, 50.0),
    "safety.max_braking": (0.01, 100.0),
    "safety.force_limit": (1.0, 200.0),
    "safety.soft_force_limit": (0.0, 200.0),
    "safety.force_filter_time": (0.0, 1.0),
    "safety.yield_rate": (0.0, 0.1),
    "safety.yield_speed": (0.0, 1.0),
    "safety.relax_speed": (0.001, 0.2),
    "safety.stop_time": (0.0, 60.0),
    "safety.max_lead": (0.001, 0.2),
    "safety.stale_time": (0.005, 5.0),
    "safety.person_distance": (0.0, 0.3),
    "safety.held_distance": (0.0, 0.3),
    "safety.least_distance": (0.0, 1.0),
    "safety.largest_distance": (0.05, 3.0),
    "gripper.max_speed": (0.001, 2.0),
    "gripper.max_acceleration": (0.01, 50.0),
    "workspace.low": (-100.0, 100.0),
    "workspace.high": (-100.0, 100.0),
    "start.distance_behind": (0.1, 2.0),
    "start.height_offset": (-1.0, 1.0),
    "start.lateral_offset": (-1.0, 1.0),
    "chair.seat_width": (0.15, 0.80),
    "chair.back_height": (0.10, 0.80),
    "chair.back_gap": (0.0, 0.20),
    "chair.handle_height": (0.05, 0.90),
    "chair.handle_length": (0.0, 0.30),
    "chair.armrest_height": (0.08, 0.45),
    "chair.armrest_length": (0.05, 0.60),
    "chair.armrest_width": (0.02, 0.12),
    "chair.wheel_diameter": (0.10, 0.80),
    "chair.wheel_width": (0.02, 0.12),
    "variation.arm_angle_deg": (0.0, 45.0),
    "variation.coat_scale": (0.0, 0.3),
    "variation.coat_measures": (0.0, 0.2),
    "variation.person_scale": (0.0, 0.3),
    "variation.person_measures": (0.0, 0.2),
    "variation.plant_stiffness": (0.0, 0.9),
    "variation.plant_friction": (0.0, 0.9),
    "variation.start_offset": (0.0, 0.3),
    "log.rate": (1.0, 250.0),
}
# Body sizes, m, and masses, kg, with a margin: from a two-year-old child to the largest adults.
_OF_MEASURES: dict[str, tuple[float, float]] = {
    "shoulder_height": (0.5, 2.2),
    "shoulder_width": (0.12, 0.65),
    "upper_arm_length": (0.10, 0.50),
    "forearm_length": (0.10, 0.55),
    "upper_arm_radius": (0.015, 0.12),
    "forearm_radius": (0.012, 0.09),
    "hand_radius": (0.015, 0.08),
    "chest_width": (0.12, 0.70),
    "chest_depth": (0.08, 0.50),
    "torso_length": (0.20, 0.80),
    "hip_width": (0.12, 0.70),
    "neck_radius": (0.02, 0.12),
    "head_radius": (0.05, 0.15),
    "leg_length": (0.30, 1.40),
    "thigh_radius": (0.03, 0.20),
    "upper_arm_mass": (0.1, 8.0),
    "forearm_mass": (0.1, 6.0),
    "elbow_radius": (0.012, 0.12),
    "wrist_radius": (0.01, 0.08),
    "knee_radius": (0.02, 0.15),
    "ankle_radius": (0.015, 0.10),
    "neck_base_radius": (0.02, 0.20),
    "neck_length": (0.03, 0.25),
    "waist_width": (0.12, 0.80),
    "waist_depth": (0.08, 0.70),
    "hip_depth": (0.08, 0.60),
    "chest_girth": (0.35, 2.0),
    "waist_girth": (0.35, 2.2),
    "hip_girth": (0.35, 2.2),
}
_OF_MEASURES |= {
    f"{name.removesuffix('_radius')}_girth": (2.0 * math.pi * low, 2.0 * math.pi * high)
    for name, (low, high) in _OF_MEASURES.items()
    if name.endswith("_radius")
}
_RANGES |= {
    f"{group}.{name}": bounds
    for group in ("measures", "left_measures", "right_measures")
    for name, bounds in _OF_MEASURES.items()
}


def choices_of(key: str) -> tuple[str, ...] | None:
    """Returns the allowed words at a dotted key; None if any text is allowed."""
    if key == "controller.predictor":
        return tuple(PREDICTORS)
    return CHOICES.get(plain(key))


def plain(key: str) -> str:
    """Returns a dotted key without the indices of lists."""
    return re.sub(r"\[\d+\]", "", key)


def range_of(key: str) -> tuple[float, float] | None:
    """Returns the range of the number at a dotted key, including both ends, if there is one."""
    group, *rest = key.split(".")
    if group == "effects":
        return _range_of_effect(*rest) if len(rest) == 2 else None
    name = "." + plain(key)
    ends = [end for end in _RANGES if name.endswith("." + end)]
    return _RANGES[max(ends, key=len)] if ends else None


def _range_of_effect(name: str, parameter: str) -> tuple[float, float] | None:
    """Returns the range of an effect's parameter or, with `_std`, of its standard deviation."""
    kind = EFFECTS.get(name)
    for p in kind.parameters() if kind else ():
        if parameter == p.name:
            return p.low, p.high
        if parameter == f"{p.name}_std":
            # a poorly observable parameter may have a deviation far beyond its own range
            return 0.0, 100.0 * (p.high - p.low)
    return None
