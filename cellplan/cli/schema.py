"""``cellplan schema``: the JSON Schema of the cell file, for editors that complete and check while one writes."""

from cellplan.cli.output import say_json


def schema() -> None:
    """Print the JSON Schema of the cell file."""
    from cellplan.io.schema import json_schema

    say_json(json_schema())
