"""The command `treepipe`: finds the subcommand, and turns every error into one line and an exit code."""

from __future__ import annotations

import difflib
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper
from typing import Any, NoReturn

import click

from pipeline.cli.logs import say, stop_logging
from pipeline.errors import PipelineError
from pipeline.jobs.interrupts import resend_lost_interrupts
from pipeline.output import NO_TEXT

COMMANDS = {
    "run": "Make a tree model of every cloud.",
    "clean": "Drop what is not the tree, and thin the points.",
    "skeleton": "Extract the branching skeleton of a cleaned cloud.",
    "fit": "Measure the radii of a skeleton in its cloud.",
    "export": "Write a model in other formats.",
    "convert": "Turn a model into another format.",
    "generalise": "Shorten an L-system: tips become averages.",
    "grow": "Let an L-system grow for some years.",
    "simulate": "Let a tree grow through the years.",
    "prune": "Prune a tree: one operation.",
    "calibrate": "Fit growth to what two acquisitions show.",
    "expand": "Print the L-string of an L-system.",
    "info": "Tell what a file holds.",
    "validate": "Check a CityJSON or LsJSON file.",
    "synth": "Grow trees whose truth is known, and scan them.",
    "compare": "Tell how far a model is from another, from its points or from the truth.",
    "regress": "Keep references, and check today's output against them.",
    "batch": "Model every tree of airborne tiles.",
    "view": "Look at a cloud, a skeleton, a mesh or a tree.",
    "studio": "Model a tree in the browser.",
    "config": "Show the settings.",
}
"""Subcommands by name, with what `treepipe --help` says of them; the code is in the file of that name."""

INTERRUPTED = 130


class LazyGroup(click.Group):
    """A group that imports a subcommand only when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names in the order in which they are used."""
        del ctx
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import one subcommand."""
        del ctx
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = import_module(f"pipeline.cli.{cmd_name}").command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the subcommand; one that there is not is answered with the nearest."""
        near = [] if args[0] in COMMANDS else difflib.get_close_matches(args[0], COMMANDS, n=1)
        if near:
            ctx.fail(f"No such command {args[0]!r}, do you mean {near[0]!r}?")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the subcommands without importing them."""
        del ctx
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def main(  # type: ignore[override]  # it always leaves, whatever click's own modes are
        self, args: Sequence[str] | None = None, prog_name: str | None = None, **extra: Any
    ) -> NoReturn:
        """Run, and leave with the exit code that the outcome has."""
        given = list(sys.argv[1:] if args is None else args)
        extra["standalone_mode"] = False
        resend_lost_interrupts(signal.SIGINT)
        if isinstance(sys.stdout, TextIOWrapper):  # a name that its encoding lacks is told by escapes
            sys.stdout.reconfigure(errors=NO_TEXT)
        try:
            code = super().main(given, prog_name, **extra)
        except (click.Abort, KeyboardInterrupt):
            say("interrupted; no half-written file is left")
            sys.exit(INTERRUPTED)
        except click.exceptions.NoArgsIsHelpError as error:
            click.echo(error.format_message(), err=True)
            sys.exit(error.exit_code)
        except click.ClickException as error:
            path = error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else "treepipe"
            say(f"{_sentence(error.format_message())}; {_dashed(given)}see `{path} --help`")
            sys.exit(error.exit_code)
        except PipelineError as error:
            say(_sentence(str(error)))
            sys.exit(error.exit_code)
        except Exception as error:  # the last resort: the user gets a line, not a traceback
            if {"-v", "--verbose"} & set(given):
                traceback.print_exc()
            told = _sentence(f"unexpected {type(error).__name__}: {error}")
            say(f"{told}; run it with -v and report what it shows")
            sys.exit(1)
        finally:
            stop_logging()
        sys.exit(code if isinstance(code, int) else 0)


def _sentence(text: str) -> str:
    """Return the text on one line, without the full stop of click."""
    return " ".join(text.split()).rstrip(".")


def _dashed(given: Sequence[str]) -> str:
    """Return how to name a file that was taken for an option; nothing where there is none."""
    names = [name for name in given if name.startswith("-") and os.path.lexists(name)]
    return f"give the file as ./{names[0]}, or " if names else ""


def _show_version(ctx: click.Context, _parameter: click.Parameter, wanted: bool) -> None:
    if wanted:
        from pipeline.version import __version__

        click.echo(f"treepipe {__version__}")
        ctx.exit()


@click.group("treepipe", cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_show_version,
    help="Show the version and exit.",
)
def main() -> None:
    """Turn laser points of trees into compact, measured, exchangeable tree models."""
