/* Elementary functions of our own: the same bits on every processor with IEEE arithmetic, as long as the compiler
   forms no fused multiply-add (-ffp-contract=off). An ulp is a unit of the last place. */
typedef union {
    @real@ number;
    @word@ bits;
} portable_number;

/* 2^(exponent - bias) from its biased exponent, which lies in the lowest bits. */
static @real@ portable_power_of_two@f@(@word@ biased)
{
    portable_number power;

    power.bits = biased << @digits@u;
    return power.number;
}

/* exp(r) - 1 for |r| up to half of ln 2. */
static @real@ portable_expm1_kernel@f@(@real@ r)
{
    const @real@ polynomial = @polynomial_exp@;

    return r + r * r * polynomial;
}

/* x / ln 2, rounded to an integer that stands in the lowest bits; other bits are those of @shift@. */
static @real@ portable_binary_exponent@f@(@real@ x, @word@ *bits)
{
    portable_number shifted;

    shifted.number = x * @per_ln2@ + @shift@;
    *bits = shifted.bits;
    return shifted.number - @shift@;
}

/* exp(x); at most 1.1 ulp. NaN stays NaN, what is too large becomes infinite, what is too small zero. */
static @real@ portable_exp@f@(@real@ x)
{
    const @real@ above = x < @exp_lowest@ ? @exp_lowest@ : x;
    const @real@ inside = above > @exp_highest@ ? @exp_highest@ : above;
    @word@ bits;
    const @real@ n = portable_binary_exponent@f@(inside, &bits);
    const @real@ r = (inside - n * @ln2_high@) - n * @ln2_low@;
    const @real@ result = @one@ + portable_expm1_kernel@f@(r);
    const @word@ both = bits - @shift_less_two_biases@u;
    const @word@ half = both >> 1;

    return result * portable_power_of_two@f@(half) * portable_power_of_two@f@(both - half);
}

/* exp(x) - 1 where it is finite and more than -1. */
static @real@ portable_expm1_inside@f@(@real@ x)
{
    @word@ bits;
    const @real@ n = portable_binary_exponent@f@(x, &bits);
    const @real@ r = (x - n * @ln2_high@) - n * @ln2_low@;
    const @real@ half_power = portable_power_of_two@f@(bits - @shift_less_bias_below@u);
    const @real@ half_result = half_power * portable_expm1_kernel@f@(r) + (half_power - @half@);

    return half_result + half_result;
}

/* exp(x) - 1; at most 2.2 ulp. NaN stays NaN, what is too large becomes infinite, and -0 becomes 0. */
static @real@ portable_expm1@f@(@real@ x)
{
    const @real@ above = x < @expm1_lowest@ ? @expm1_lowest@ : x;

    return portable_expm1_inside@f@(above > @exp_highest@ ? @exp_highest@ : above);
}

/* tanh(x); at most 3 ulp. NaN stays NaN. */
static @real@ portable_tanh@f@(@real@ x)
{
    const @real@ size = fabs@f@(x);
    const @real@ inside = size > @tanh_one@ ? @tanh_one@ : size;
    const @real@ t = portable_expm1_inside@f@(inside + inside);

    return copysign@f@(t / (t + @two@), x);
}

/* sinh(x); at most 2.6 ulp. NaN stays NaN, what is too large becomes infinite. */
static @real@ portable_sinh@f@(@real@ x)
{
    const @real@ size = fabs@f@(x);
    @real@ result;

    if (size < @exp_large@) {
        const @real@ t = portable_expm1@f@(size);

        result = @half@ * (t + t / (t + @one@));
    } else {
        const @real@ root = portable_exp@f@(@half@ * size);

        result = (@half@ * root) * root;
    }
    return copysign@f@(result, x);
}

/* cosh(x); at most 2.6 ulp. NaN stays NaN, what is too large becomes infinite. */
static @real@ portable_cosh@f@(@real@ x)
{
    const @real@ size = fabs@f@(x);
    @real@ result;

    if (size < @exp_large@) {
        const @real@ e = portable_exp@f@(size);

        result = @half@ * (e + @one@ / e);
    } else {
        const @real@ root = portable_exp@f@(@half@ * size);

        result = (@half@ * root) * root;
    }
    return result;
}

/* The power of two k next to x > 0, and x / 2^k - 1 between sqrt(1/2) - 1 and sqrt(2) - 1. */
static @real@ portable_fraction@f@(@real@ x, @real@ *k)
{
    const @real@ normal = x < @least_normal@ ? x * @denormal_scale@ : x;
    const @real@ lost = x < @least_normal@ ? @denormal_power@ : @zero@;
    portable_number part;
    @word@ bits;
    uint32_t biased;

    part.number = normal;
    bits = part.bits + (@one_bits@u - @root_half_bits@u);
    part.bits = (bits & @fraction_mask@u) + @root_half_bits@u;
    bits >>= @digits@u;
    biased = (uint32_t)bits;
    *k = ((@real@)biased - @bias@) - lost;
    return part.number - @one@;
}

/* log(2^k (1 + f)) with a small correction of the result. */
static @real@ portable_log_kernel@f@(@real@ f, @real@ k, @real@ correction)
{
    const @real@ s = f / (@two@ + f);
    const @real@ z = s * s;
    const @real@ square = @half@ * f * f;
    const @real@ polynomial = z * (@polynomial_log@);

    return k * @ln2_high@ + (f - (square - (s * (square + polynomial) + (k * @ln2_low@ + correction))));
}

/* log(x); at most 0.9 ulp. Zero gives minus infinity, negative numbers and NaN give NaN. */
static @real@ portable_log@f@(@real@ x)
{
    @real@ result;

    if (x > @zero@ && x <= @largest@) {
        @real@ k;
        const @real@ f = portable_fraction@f@(x, &k);

        result = portable_log_kernel@f@(f, k, @zero@);
    } else if (x > @zero@) {
        result = x;
    } else {
        result = x >= @zero@ ? -(@real@)INFINITY : (@real@)NAN;
    }
    return result;
}

/* log(1 + x); at most 0.9 ulp. -1 gives minus infinity, what is less and NaN give NaN. */
static @real@ portable_log1p@f@(@real@ x)
{
    @real@ result;

    if (x > @log1p_direct_below@ && x < @log1p_direct_above@) {
        result = copysign@f@(portable_log_kernel@f@(x, @zero@, @zero@), x);
    } else if (x > -@one@ && x <= @largest@) {
        const @real@ u = @one@ + x;
        const @real@ lost = x < @one@ ? x - (u - @one@) : @one@ - (u - x);
        @real@ k;
        const @real@ f = portable_fraction@f@(u, &k);

        result = portable_log_kernel@f@(f, k, lost / u);
    } else if (x > @zero@) {
        result = x;
    } else {
        result = x >= -@one@ ? -(@real@)INFINITY : (@real@)NAN;
    }
    return result;
}

/* asinh(x); at most 2 ulp. NaN stays NaN. */
static @real@ portable_asinh@f@(@real@ x)
{
    const @real@ size = fabs@f@(x);
    @real@ result;

    if (size < @square_limit@) {
        const @real@ square = size * size;

        result = portable_log1p@f@(size + square / (@one@ + sqrt@f@(square + @one@)));
    } else {
        result = portable_log@f@(size) + @ln2@;
    }
    return copysign@f@(result, x);
}

/* acosh(x); at most 2.2 ulp. What is less than 1, and NaN, give NaN. */
static @real@ portable_acosh@f@(@real@ x)
{
    @real@ result;

    if (x >= @square_limit@) {
        result = portable_log@f@(x) + @ln2@;
    } else if (x >= @one@) {
        const @real@ above = x - @one@;

        result = portable_log1p@f@(above + sqrt@f@(above * (above + @two@)));
    } else {
        result = (@real@)NAN;
    }
    return result;
}

/* atanh(x); at most 2.2 ulp. 1 gives infinity, what is beyond and NaN give NaN. */
static @real@ portable_atanh@f@(@real@ x)
{
    const @real@ size = fabs@f@(x);

    return copysign@f@(@half@ * portable_log1p@f@((size + size) / (@one@ - size)), x);
}

/* x raised to y; at most 2 ulp and 2 |y log x| more. As in C99, where 0, infinity and NaN are concerned. */
static @real@ portable_pow@f@(@real@ x, @real@ y)
{
    const @real@ size = fabs@f@(x);
    const @real@ whole = floor@f@(y);
    const @real@ half = floor@f@(@half@ * whole);
    const int is_whole = y <= whole && y >= whole;
    const int is_odd = is_whole && (whole - half) - half > @half@;
    @real@ result;

    if ((x >= @one@ && x <= @one@) || (y >= @zero@ && y <= @zero@)) {
        result = @one@;
    } else if (size >= @one@ && size <= @one@ && fabs@f@(y) > @largest@) {
        result = @one@;
    } else if (x < @zero@ && size <= @largest@ && !is_whole) {
        result = (@real@)NAN;
    } else {
        result = portable_exp@f@(y * portable_log@f@(size));
    }
    return (is_odd && copysign@f@(@one@, x) < @zero@) ? -result : result;
}

/* The remainder of x over half of pi within a quarter of pi, and the quarter it stands in. */
static @real@ portable_quarter@f@(@real@ x, @word@ *quarter)
{
    const @real@ inside = fabs@f@(x) > @circle_limit@ ? fmod@f@(x, @two_pi@) : x;
    portable_number shifted;
    @real@ n;

    shifted.number = inside * @per_half_pi@ + @shift@;
    n = shifted.number - @shift@;
    *quarter = shifted.bits;
    return (((inside - n * @half_pi_1@) - n * @half_pi_2@) - n * @half_pi_3@) - n * @half_pi_4@;
}

/* sin(r) within a quarter of pi. */
static @real@ portable_sin_kernel@f@(@real@ r)
{
    const @real@ z = r * r;

    return copysign@f@(r + r * z * (@polynomial_sin@), r);
}

/* cos(r) within a quarter of pi. */
static @real@ portable_cos_kernel@f@(@real@ r)
{
    const @real@ z = r * r;
    const @real@ square = @half@ * z;
    const @real@ near_one = @one@ - square;

    return near_one + (((@one@ - near_one) - square) + z * z * (@polynomial_cos@));
}

/* sin(x); at most 2.6 ulp up to @circle_limit@. Beyond, as for the angle less full turns of @two_pi@. NaN and the
   infinities give NaN. */
static @real@ portable_sin@f@(@real@ x)
{
    @word@ quarter;
    const @real@ r = portable_quarter@f@(x, &quarter);
    const @real@ size = (quarter & 1u) != 0u ? portable_cos_kernel@f@(r) : portable_sin_kernel@f@(r);

    return (quarter & 2u) != 0u ? -size : size;
}

/* cos(x); at most 2.6 ulp up to @circle_limit@. Beyond, as for the angle less full turns of @two_pi@. NaN and the
   infinities give NaN. */
static @real@ portable_cos@f@(@real@ x)
{
    @word@ quarter;
    const @real@ r = portable_quarter@f@(x, &quarter);
    const @real@ size = (quarter & 1u) != 0u ? portable_sin_kernel@f@(r) : portable_cos_kernel@f@(r);

    return ((quarter + 1u) & 2u) != 0u ? -size : size;
}

/* tan(x); at most 4 ulp up to @circle_limit@. Beyond, as for the angle less full turns of @two_pi@. NaN and the
   infinities give NaN. */
static @real@ portable_tan@f@(@real@ x)
{
    @word@ quarter;
    const @real@ r = portable_quarter@f@(x, &quarter);
    const @real@ s = portable_sin_kernel@f@(r);
    const @real@ c = portable_cos_kernel@f@(r);

    return (quarter & 1u) != 0u ? -c / s : s / c;
}

/* atan(q) for q between 0 and 1. */
static @real@ portable_atan_kernel@f@(@real@ q)
{
    const int upper = q > @tan_eighth@;
    const @real@ r = upper ? (q - @one@) / (q + @one@) : q;
    const @real@ z = r * r;
    const @real@ bent = r * z * (@polynomial_atan@);

    return upper ? @quarter_pi@ + (r + (bent + @quarter_pi_low@)) : r + bent;
}

/* atan(x); at most 2.1 ulp. NaN stays NaN. */
static @real@ portable_atan@f@(@real@ x)
{
    const @real@ size = fabs@f@(x);
    @real@ result;

    if (size > @one@) {
        result = @half_pi@ - (portable_atan_kernel@f@(@one@ / size) - @half_pi_low@);
    } else {
        result = portable_atan_kernel@f@(size);
    }
    return copysign@f@(result, x);
}

/* The angle of the point (x, y); at most 4 ulp. As in C99, where 0 and infinity are concerned. */
static @real@ portable_atan2@f@(@real@ y, @real@ x)
{
    const @real@ a = fabs@f@(y);
    const @real@ b = fabs@f@(x);
    const @real@ greatest = a > b ? a : b;
    const @real@ least = a > b ? b : a;
    @real@ ratio = least / greatest;
    @real@ angle;

    if (greatest <= @zero@ && least <= @zero@) {
        ratio = @zero@;
    } else if (least > @largest@ && greatest > @largest@) {
        ratio = @one@;
    } else {
        /* an ordinary point */
    }
    angle = portable_atan_kernel@f@(ratio);
    angle = a > b ? @half_pi@ - (angle - @half_pi_low@) : angle;
    angle = copysign@f@(@one@, x) < @zero@ ? @pi@ - (angle - @pi_low@) : angle;
    return copysign@f@(angle, y);
}

/* asin(x); at most 3 ulp. Beyond 1, and of NaN, NaN. */
static @real@ portable_asin@f@(@real@ x)
{
    return portable_atan@f@(x / sqrt@f@((@one@ - x) * (@one@ + x)));
}

/* acos(x); at most 3 ulp. Beyond 1, and of NaN, NaN. */
static @real@ portable_acos@f@(@real@ x)
{
    return @two@ * portable_atan@f@(sqrt@f@((@one@ - x) / (@one@ + x)));
}

/* The length of the vector (x, y); at most 2 ulp. Infinite if one of them is, else NaN if one of them is. */
static @real@ portable_hypot@f@(@real@ x, @real@ y)
{
    const @real@ a = fabs@f@(x);
    const @real@ b = fabs@f@(y);
    const @real@ greatest = a > b ? a : b;
    const @real@ least = a > b ? b : a;
    const @real@ ratio = least / greatest;
    @real@ result = greatest * sqrt@f@(@one@ + ratio * ratio);

    if (a > @largest@ || b > @largest@) {
        result = (@real@)INFINITY;
    } else if (greatest <= @zero@) {
        result = @zero@ * (a + b);
    } else {
        /* an ordinary vector */
    }
    return result;
}

/* The error function; at most 1.6 ulp. NaN stays NaN. */
static @real@ portable_erf@f@(@real@ x)
{
    const @real@ size = fabs@f@(x);
    @real@ result;

    if (size < @erf_near@) {
        const @real@ z = size * size;

        result = size + size * (@polynomial_erf@);
    } else {
        const @real@ inside = size > @erf_one@ ? @erf_one@ : size;
        const @real@ t = @one@ / (@one@ + @half@ * inside);

        result = @one@ - t * portable_exp@f@(-inside * inside) * (@polynomial_erfc@);
    }
    return copysign@f@(result, x);
}
