"""A command as typer takes it: its options as parameters, its result shown, its failures as JSON too."""

import functools
import inspect
from collections.abc import Callable
from typing import Any, get_type_hints

import typer

from cellplan.cli.options.request import given, parameters
from cellplan.cli.options.shared import Verbose
from cellplan.cli.terminal.output import Result, json_failure, present
from cellplan.cli.terminal.verbosity import be_verbose

Work = Callable[[Any], Result | None]  # from its options to its result; None where it has shown that itself


def as_command(command: Work) -> Callable[..., None]:
    """A function with one parameter for each option, and ``--verbose``; it ends with the exit status of the result.

    typer makes options of the parameters of a function, so its signature is made from the fields of the options.
    """
    kind = get_type_hints(command)[next(iter(inspect.signature(command).parameters))]

    @functools.wraps(command)
    def run(*, verbose: bool, **values: Any) -> None:
        be_verbose(verbose)
        options = given(kind, values)
        is_json = getattr(options, "as_json", False)
        one_object = is_json and not getattr(options, "watch", False)  # each round of watching gives one
        with json_failure(options.schema, desired=one_object):
            result = command(options)
        if result is not None:
            present(result, as_json=is_json)
            raise typer.Exit(result.status)

    option = inspect.Parameter("verbose", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Verbose)
    signature = inspect.Signature([*parameters(kind), option])
    run.__signature__ = signature  # type: ignore[attr-defined]
    run.__annotations__ = {name: parameter.annotation for name, parameter in signature.parameters.items()}
    return run
