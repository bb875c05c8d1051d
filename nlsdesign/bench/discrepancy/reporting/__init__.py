"""What a diagnosis says: verdict, gap before and after, remainder, advice on what to measure next.

``diagnose`` alone imports it, and what people see; it builds on all other inner rooms.
It never changes what was decided.
"""
