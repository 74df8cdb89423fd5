"""Compiled templates: kept where Python keeps compiled modules, so that a template is compiled once."""

import importlib.util
import sys
import zlib
from contextlib import suppress
from pathlib import Path
from typing import Final

import jinja2
from jinja2 import Environment, FileSystemBytecodeCache
from jinja2.bccache import Bucket

TEMPLATES: Final = Path(__file__).resolve().parent / "templates"
OPTIONS: Final = ("autoescape", "trim_blocks", "lstrip_blocks", "keep_trailing_newline", "optimized")


class CompiledTemplates(FileSystemBytecodeCache):
    """Keeps compiled templates in the folder ``__pycache__`` beside them, or below ``PYTHONPYCACHEPREFIX``.

    A template is compiled again when its text, the release of Python or of jinja2, or the options of the environment
    have changed. Where nothing can or may be written, it is compiled by each process.
    """

    def __init__(self, environment: Environment) -> None:
        """Prepare."""
        options = {name: getattr(environment, name) for name in OPTIONS}
        release = zlib.crc32(f"{jinja2.__version__} {options} {sorted(environment.extensions)}".encode())
        module = importlib.util.cache_from_source(str(TEMPLATES / "page.py"))
        super().__init__(str(Path(module).parent), f"%s.{sys.implementation.cache_tag}.{release:08x}.template")

    def load_bytecode(self, bucket: Bucket) -> None:
        """Fill in what is kept of a template, unless something is wrong with it."""
        try:
            super().load_bytecode(bucket)
        except Exception:  # noqa: BLE001 - a damaged file is made again
            bucket.reset()

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Keep a compiled template."""
        if sys.dont_write_bytecode:
            return
        with suppress(OSError):
            Path(self.directory).mkdir(parents=True, exist_ok=True)
            super().dump_bytecode(bucket)
