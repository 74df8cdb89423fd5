"""Sequential linear programs: from one layout to a better one nearby, by exact derivatives and a trust region."""
