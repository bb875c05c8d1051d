/* The numbers that load takes over, as they lie in memory and in a file: least significant byte first, and nothing
   between the members. */
typedef struct {
    uint32_t magic; /* @NAME@_BLOCK_MAGIC */
    uint32_t version; /* @NAME@_BLOCK_VERSION, of this head */
    uint32_t size; /* bytes of all */
    uint32_t reserved; /* 0 */
    uint32_t digest[4]; /* of names, units, order, number type, equations and deck of this code */
    uint32_t deck[2]; /* first digits of the digest of the deck that the numbers are from; any will do */
    @parameters_member@
    @coefficients_member@
    @table_members@
    uint32_t checksum; /* CRC-32 of all above */
    uint32_t unused; /* 0 */
} @name@_block;

/* What check finds wrong first. */
typedef enum {
    @NAME@_BLOCK_FITS = 0,
    @NAME@_BLOCK_NOT_STARTED = 1, /* init was not called */
    @NAME@_BLOCK_NO_BLOCK = 2, /* another magic number */
    @NAME@_BLOCK_OTHER_VERSION = 3, /* another head, or another size */
    @NAME@_BLOCK_FOREIGN = 4, /* of other code: another digest */
    @NAME@_BLOCK_DAMAGED = 5, /* another checksum */
    @NAME@_BLOCK_OUT_OF_RANGE = 6 /* a number that is not finite or outside its range */
} @name@_block_result;

#define @NAME@_BLOCK_MAGIC @magic@
#define @NAME@_BLOCK_VERSION @version@
#define @NAME@_BLOCK_SIZE @size@u

/* The numbers of the design. */
extern const @name@_block @name@_default_block;

