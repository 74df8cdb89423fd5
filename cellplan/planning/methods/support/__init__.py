"""What several resolution methods share."""
