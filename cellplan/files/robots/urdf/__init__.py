"""URDF: document, tree, limits, bodies."""

from typing import Final

XACRO_SUFFIX: Final = ".xacro"
