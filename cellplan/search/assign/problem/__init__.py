"""What an assignment chooses from: goals, modes, stations, conflicts, rules, and blocks in which the part moves."""
