"""Control the simulated Kinova Jaco: kinematics, grasps from partial clouds, motion planning, execution."""
