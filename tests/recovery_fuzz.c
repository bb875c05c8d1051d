/* Two instances of one observer see the same motion; one of them through an encoder that fails now and then.
   Defined from outside: HEADER, NAME(x), REAL, SAMPLE (s), SAMPLES, PERIOD, SETTLED (samples), SIZE (N m), KIND, TORQUE (output).
   Prints: faults, checks, worst difference after SETTLED samples over SIZE, samples not finite, states at the end
   that differ. Nothing of this file is generated. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include HEADER

static uint64_t seed = 88172645463325252ULL;

static double chance(void) /* xorshift: G. Marsaglia, Journal of Statistical Software 8(14), 2003 */
{
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return (double)(seed >> 11) / 9007199254740992.0;
}

static double motion(double t)
{
    return 0.45 * sin(6.2831853071795865 * 1.3 * t) + 0.25 * sin(6.2831853071795865 * 0.37 * t + 1.0);
}

static double counted(double angle)
{
    return 0.767e-3 * floor(angle / 0.767e-3 + 0.5);
}

static double bad(int kind, double good, double frozen, long since)
{
    static double held;
    if (kind == 0) { /* any finite number */
        held = (chance() < 0.5 ? -1.0 : 1.0) * pow(10.0, -3.0 + 41.0 * chance());
        return good + held;
    }
    if (kind == 1) {
        return chance() < 0.5 ? NAN : (chance() < 0.5 ? INFINITY : -INFINITY);
    }
    if (kind == 2) { /* a jump that stays */
        held = since == 0 ? -3.0 + 6.0 * chance() : held;
        return good + held;
    }
    return frozen;
}

int main(void)
{
    static NAME(state) one, two;
    NAME(inputs) given = {0}, failing = {0};
    NAME(outputs) true_, seen;
    double worst = 0.0, frozen = 0.0;
    long faults = 0, checks = 0, lost = 0, begin = PERIOD, length = 0;
    int kind = 0;

    (void)NAME(init)(&one, 0);
    (void)NAME(init)(&two, 0);
    for (long k = 0; k < SAMPLES; ++k) {
        const double t = SAMPLE * (double)k, good = counted(motion(t));
        given.motor.angle = (REAL)good;
        given.motor.current = (REAL)(8.0 * sin(6.2831853071795865 * 1.3 * t + 0.4));
        failing = given;
        if (k == begin) {
            kind = KIND >= 0 ? KIND : (int)(4.0 * chance());
            length = kind == 3 ? 1 + (long)(2000.0 * chance()) : 1 + (long)(chance() < 0.5 ? 0.0 : 40.0 * chance());
            frozen = good;
            ++faults;
        }
        if (k >= begin && k < begin + length) {
            failing.motor.angle = (REAL)bad(kind, good, frozen, k - begin);
        }
        (void)NAME(step)(&one, &given, &true_);
        (void)NAME(step)(&two, &failing, &seen);
        if (!(fabs((double)seen.TORQUE) <= 1e30)) {
            ++lost;
        }
        if (k >= begin + length + SETTLED) {
            const double apart = fabs((double)seen.TORQUE - (double)true_.TORQUE) / SIZE;
            worst = apart > worst ? apart : worst;
            ++checks;
        }
        if (k == begin + length + SETTLED + PERIOD) {
            begin = k + 1 + (long)(50.0 * chance());
            length = 0;
        }
    }
    (void)printf("%ld %ld %.6g %ld\n", faults, checks, worst, lost);
    return 0;
}
