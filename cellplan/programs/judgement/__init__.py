"""Judgement of programs as they are read back: rows, tools, speeds, and which rows may be rounded."""
