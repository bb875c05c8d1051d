/* One instance, so that its size can be read from the object. */
#include "@name@.h"

extern @name@_state instance;
@name@_state instance;
