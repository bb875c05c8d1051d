SHOWN void run(int64_t samples, int64_t groups, double *state, const double *given,
                  const double *parameter, const double *c, double *kept) {
    (void)c;
    int64_t every = groups * WIDTH;
    for (int64_t group = 0; group < groups; ++group) {
        int64_t at = group * WIDTH;
        column s[@states@ + 1], p[@parameters@ + 1];
        @onces@
        for (int i = 0; i < @states@; ++i) s[i] = load(state + i * every + at);
        for (int i = 0; i < @parameters@; ++i) p[i] = load(parameter + i * every + at);
        @fixed@
        for (int64_t k = 0; k < samples; ++k) {
            const double *g = given + k * @inputs@ * every + at;
            double *out = kept + k * @shown@ * every + at;
            @body@
        }
        for (int i = 0; i < @states@; ++i) store(state + i * every + at, s[i]);
    }
}
