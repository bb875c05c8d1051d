"""Methods that answer the data set of hidden effects, ours and somebody else's: each is one small file.

A module has ``NAME``, with the version of what it rests on, and ``answer(folder)``, from the folder of a case
to its answer in the format of the README of the data set.
"""
