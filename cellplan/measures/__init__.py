"""Measures: what planning and checks both compute of joints, tools and part, without limits and verdicts."""
