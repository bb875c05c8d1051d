"""Parts put together under names: assemblies, their smooth form, their decks, their circuits.

Everything outside ``components`` may import it; it builds on all other inner rooms.
It never writes an equation; ``model.flatten`` does.
"""
