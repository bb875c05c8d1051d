"""``nlsdesign analyse``: what can be said of a machine; each analysis is a command in its own module."""

from __future__ import annotations

import click


class _OverAngleByDefault(click.Group):
    """A group in which options alone mean its first command."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put the first command before options that stand alone."""
        if not args or (args[0].startswith("-") and args[0] not in self.get_help_option_names(ctx)):
            args = [next(iter(self.commands)), *args]
        return super().parse_args(ctx, args)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands, the default one first."""
        return list(self.commands)


@click.group(cls=_OverAngleByDefault)
def analyse() -> None:
    """Analyse a machine; without a command it goes over the cam angle, see ``analyse angle --help``."""
