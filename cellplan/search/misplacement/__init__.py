"""Misplacement: layouts that keep their demands when every base stands a little beside its place."""
