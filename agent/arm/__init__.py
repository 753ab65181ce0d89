"""The simulated Kinova Jaco: kinematics, grasps from partial clouds, motion planning, execution."""
