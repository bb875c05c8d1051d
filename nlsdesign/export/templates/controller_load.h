/* CRC-32 of IEEE 802.3 (polynomial 0x04c11db7, reflected; begun with and at last exclusive-or 0xffffffff) of all
   bytes before the checksum: what it must be after numbers in a block were changed. */
uint32_t @name@_checksum(const @name@_block *block);

/* Says whether a block can be loaded. It takes time in proportion to its size: call it beside the samples. */
@name@_block_result @name@_check(const @name@_block *block);

/* Checks a block and takes over all its numbers, or none. To be called between two steps, by who calls them. States
   and last outputs stay: what the states carry was made with the numbers before, and the difference fades with the
   time constants of the observer and the loop. Limits of inputs and readings stay those of the design. */
@load@;

