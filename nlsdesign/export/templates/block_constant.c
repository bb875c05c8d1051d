/* @title@
   Written by nlsdesign @version@; do not edit: its checksum is that of its numbers. */
#include "@name@.h"

extern const @name@_block @own@;

@numbers@
