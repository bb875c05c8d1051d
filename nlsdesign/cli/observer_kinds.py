"""The option for the kind of a torque observer, which several commands offer."""

from __future__ import annotations

import click

BEST, CORRECTED, CASCADE, CERTIFIED = "best", "corrected", "cascade", "certified"
KINDS = (BEST, CORRECTED, "adaptive", CASCADE, CERTIFIED, "kalman", "published")
"""As :data:`nlsdesign.feedback.observer.spread.choice.KINDS`, which is not loaded for an option."""
kind_option = click.option(
    "--kind",
    type=click.Choice(KINDS),
    default=None,
    help="best: least expected error over the spread of the deck; the default. corrected: the cascade, its "
    "torque corrected by what the drive shows. adaptive: a joint filter that learns what the deck does not "
    "know. cascade: rubber driven by the measured angle, at the declared numbers. certified: "
    "the same structure with one gain that is proved for every angle. kalman: steady-state Kalman filter at "
    "each angle, with noise from the deck's sensors and assumed disturbances. published: states of Austin et "
    "al. 2015, with the gain of the cascade.",
)
