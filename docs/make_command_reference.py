"""Write the reference of the commands from the program: ``python docs/make_command_reference.py``."""

import re
from pathlib import Path
from typing import Any

import typer

from cellplan.cli.main import app

PAGE = Path(__file__).resolve().parent / "reference" / "commands.md"
INTRODUCTION = """\
# Commands

This page is made from the program by `docs/make_command_reference.py`; do not edit it by hand. `cellplan COMMAND
--help` prints the same.

Results go to standard output, progress and messages to standard error. With `--json` a command prints one JSON object
and nothing else; with an error its `status` is `error` and its `exit` the exit status.

An option that may be given once is refused when it is given twice, and so is one that another takes no notice of.
What can be known from the files is refused before anything is planned, verified or drawn.

| exit status | means |
|---|---|
| 0 | passed |
| 1 | a check failed |
| 2 | bad input |
| 3 | no solution was found |
| 4 | internal error |
| 130 | interrupted |

[Troubleshooting](../troubleshooting.md) goes from messages to causes.

"""


def main() -> None:
    """Write the page."""
    PAGE.write_text(command_reference(), encoding="utf-8")


def command_reference() -> str:
    """Text of the page."""
    program: Any = typer.main.get_command(app)
    parts = [command_section(name, command) for name, command in program.commands.items()]
    lines = ["\n## Of the program itself\n", *option_table(program)]
    return "\n".join([INTRODUCTION + contents(program), *parts, *lines]) + "\n"


def contents(program: Any) -> str:
    """All commands in their groups, with their first sentence."""
    lines: list[str] = []
    group = None
    for name, command in program.commands.items():
        if command.rich_help_panel != group:
            group = command.rich_help_panel
            lines += ["", f"**{group}**", ""]
        lines.append(f"- [`{name}`](#cellplan-{name}): {sentences(command)[0]}")
    return "\n".join(lines).strip()


def command_section(name: str, command: Any) -> str:
    """Heading, usage, text, options and examples of a command."""
    arguments = [argument_usage(parameter) for parameter in command.params if is_argument(parameter)]
    usage = " ".join(["cellplan", name, "[OPTIONS]", *arguments])
    lines = [f"\n## `cellplan {name}`\n", "```text", usage, "```\n", *paragraphs(command), "", *option_table(command)]
    examples = [line.strip() for line in (command.epilog or "").splitlines() if line.strip().startswith("cellplan ")]
    return "\n".join([*lines, *(["\n```text", *examples, "```"] if examples else [])])


def option_table(command: Any) -> list[str]:
    """Arguments and options of a command with their meaning."""
    shown = [parameter for parameter in command.params if not getattr(parameter, "hidden", False)]
    arguments = [(f"`{parameter.metavar}`", parameter.help) for parameter in shown if is_argument(parameter)]
    options = [(option_words(parameter), parameter.help) for parameter in shown if not is_argument(parameter)]
    rows = [f"| {names} | {cell(meaning)} |" for names, meaning in [*arguments, *options]]
    return ["| argument or option | meaning |", "|---|---|", *rows]


def is_argument(parameter: Any) -> bool:
    """Whether a parameter is an argument, not an option."""
    return bool(parameter.param_type_name == "argument")


def argument_usage(argument: Any) -> str:
    """An argument in the line of usage."""
    text = f"{argument.metavar}..." if argument.nargs == -1 else str(argument.metavar)
    return text if argument.required else f"[{text}]"


def option_words(option: Any) -> str:
    """Names of an option, and of its value."""
    value = "" if option.is_flag else f" {option.metavar or option.type.name.upper()}"
    names = [*sorted(option.opts, key=len, reverse=True), *option.secondary_opts]
    return ", ".join(f"`{name}{value}`" for name in names)


def sentences(command: Any) -> list[str]:
    """Sentences of the text of a command."""
    return re.split(r"(?<=\.)\s+", " ".join(paragraphs(command)))


def paragraphs(command: Any) -> list[str]:
    """Text of a command, one line for each paragraph."""
    text = command.help.partition("\f")[0]
    return "\n\n".join(" ".join(part.split()) for part in re.split(r"\n\s*\n", text.strip())).split("\n")


def cell(text: str | None) -> str:
    """A text as the cell of a table."""
    return " ".join((text or "").split()).replace("|", "\\|").replace("<", "&lt;")


if __name__ == "__main__":
    main()
