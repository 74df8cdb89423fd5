"""Joint trajectories of ROS 2: writer and reader."""
