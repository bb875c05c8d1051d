static void look_up(const double *grid, const double *values, int64_t nodes, int64_t columns, int exact,
                    column at, column *result) {
    for (int j = 0; j < WIDTH; ++j) {
        double x = at[j];
        int64_t low = 0, high = nodes - 1;
        if (exact) {
            const double place = (x - grid[0]) * (double)(nodes - 1) / (grid[nodes - 1] - grid[0]);
            low = place > 0.0 ? (int64_t)place : 0;
            if (low > nodes - 2) low = nodes - 2;
        } else {
            while (high - low > 1) {
                int64_t middle = low + (high - low) / 2;
                if (x < grid[middle]) high = middle; else low = middle;
            }
        }
        double share = (x - grid[low]) / (grid[low + 1] - grid[low]);
        for (int64_t k = 0; k < columns; ++k)
            result[k][j] = (1.0 - share) * values[low * columns + k]
                           + share * values[(low + 1) * columns + k];
    }
}
