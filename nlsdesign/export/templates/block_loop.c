for (uint32_t row = 0u; row < @count@u; ++row) {
    @body@
}
