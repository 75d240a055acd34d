"""Gripper planning and control: global MPC, local constrained DDP, and safety limits."""
