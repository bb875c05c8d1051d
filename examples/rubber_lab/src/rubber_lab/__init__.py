"""A law, an effect and a rubber of one's own, for decks and diagnoses of nlsdesign.

``nlsdesign --with rubber_lab COMMAND`` or, in Python, ``with extended_by(rubber_lab):`` finds what
stands in the modules of this package and in ``materials.toml``; nothing has to be entered in any list.
"""
