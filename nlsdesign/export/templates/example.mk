# make -f @name@.mk: the self-test, on this machine or on the one that CC compiles for.
CC ?= cc
CFLAGS ?= -std=c99 -O2 -Wall -Wextra

@name@_selftest: @name@.c @name@_selftest.c @name@.h
	$(CC) $(CFLAGS) -ffp-contract=off @name@.c @name@_selftest.c -lm -o $@

check: @name@_selftest
	./@name@_selftest

.PHONY: check
