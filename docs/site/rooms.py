"""Where a component stands in the package, and so in the site."""

from nlsdesign.components import Part


def room_of(kind: type[Part]) -> str:
    """Return the inner room of ``components`` in which a law stands.

    Parameters
    ----------
    kind
        A component.
    """
    return kind.__module__.split(".components.")[1].partition(".")[0]
