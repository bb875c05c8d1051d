"""What every room stands on: messages, units, decks as text, symbols, files and processes.

Every room may import its modules; they import nothing of the package but each other, and know no component.
"""
