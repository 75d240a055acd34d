"""Robot arms: kinematics, distances, and which joint velocities move a gripper as asked."""
