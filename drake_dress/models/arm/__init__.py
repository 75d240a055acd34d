"""Robot arms: kinematics, distances, and joint velocities for commanded gripper motions."""
