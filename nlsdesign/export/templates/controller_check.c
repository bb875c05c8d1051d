#if defined(__BYTE_ORDER__) && defined(__ORDER_LITTLE_ENDIAN__) && (__BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__)
#error "blocks have the least significant byte first"
#endif

/* A block is a file as it lies in memory: an array of a negative size where the compiler leaves gaps. */
typedef char @name@_block_has_its_size[(sizeof(@name@_block) == @NAME@_BLOCK_SIZE) ? 1 : -1];
typedef char @name@_checksum_has_its_place[(offsetof(@name@_block, checksum) == @bytes@u) ? 1 : -1];

uint32_t @name@_checksum(const @name@_block *block)
{
    static const uint32_t of_half_byte[16] = {
        @half_bytes@
    };
    const unsigned char *const bytes = (const unsigned char *)block;
    uint32_t sum = 0xffffffffu;

    for (uint32_t i = 0u; i < @bytes@u; ++i) {
        sum ^= bytes[i];
        sum = (sum >> 4u) ^ of_half_byte[sum & 15u];
        sum = (sum >> 4u) ^ of_half_byte[sum & 15u];
    }
    return sum ^ 0xffffffffu;
}

/* 1 for a number that is not finite or outside its range, 0 for any other. */
static uint32_t outside(@real@ given, @real@ lowest, @real@ highest)
{
    return (given >= lowest && given <= highest) ? 0u : 1u;
}

@name@_block_result @name@_check(const @name@_block *block)
{
    const @name@_block *const own = &@name@_default_block;
    @name@_block_result result = @NAME@_BLOCK_FITS;

    if (block->magic != own->magic) {
        result = @NAME@_BLOCK_NO_BLOCK;
    } else if (block->version != own->version || block->size != own->size) {
        result = @NAME@_BLOCK_OTHER_VERSION;
    } else if (block->digest[0] != own->digest[0] || block->digest[1] != own->digest[1] ||
               block->digest[2] != own->digest[2] || block->digest[3] != own->digest[3]) {
        result = @NAME@_BLOCK_FOREIGN;
    } else if (block->checksum != @name@_checksum(block)) {
        result = @NAME@_BLOCK_DAMAGED;
    } else {
        uint32_t wrong = 0u;
        @ranges@
        if (wrong != 0u) {
            result = @NAME@_BLOCK_OUT_OF_RANGE;
        }
    }
    return result;
}

/* Takes over the numbers of a block that fits. */
static void @name@_take_block(@name@_state *state, const @name@_block *block)
{
    @taken@
}

