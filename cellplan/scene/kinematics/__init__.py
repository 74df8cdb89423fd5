"""From joint positions to poses and Jacobians, by two engines that share no code."""
