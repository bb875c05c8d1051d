"""One nonlinear program for all designs of one structure: target, limits and sizes are its numbers.

A question (machine, points of the target, limits, what is free) is answered in some hundredths of a second
beside the answer before. Used where many questions follow each other, as on the live page. The program stops
where the search of ``optimisation`` goes on to its finish, so the digits of the two differ; a design that is
to be made comes from ``optimisation``. Never draws or writes files.
"""
