"""Strict YAML with source lines."""
