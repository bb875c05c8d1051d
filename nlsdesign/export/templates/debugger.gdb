# An instance of @name@ in GDB by the names of the deck, in SI units:
#     gdb -x @name@.gdb PROGRAM        then at any stop        @name@_show state
define @name@_show
  @shown@
end
document @name@_show
Print inputs, outputs, states and parameters of an instance of @name@: @name@_show state
end
