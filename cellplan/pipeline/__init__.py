"""Whole jobs: solve, verify, rehearse, export, each as a sequence of stages."""
