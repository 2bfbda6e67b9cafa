/* What no net can express: floating point, structures, a function that is kept. */
#include <math.h>
struct sample { double value; int weight; };
static struct sample samples[4];
static int n_samples = 4;

double scale(double x) { return x * 1.5; }

double clip(double x, double most)
{
    if (x > most) return most;
    return x;
}

/* The weighted mean of a few made-up samples. */
double mean(double base, int n)
{
    double sum = 0.0;
    int i, k = 0;
    double w[3] = { 1.0, 2.0, 3.0 };

    for (i = 0; i < n; i++) {
        samples[i % n_samples].value = base + i; /* new value */
        samples[i % n_samples].weight = i;
        sum += clip(samples[i % n_samples].value, 10.5) * w[i % 3];
        if (scale(sum) > 100.0 && i > 2)
            break;
        k = k + 2;
    }
    switch ((int)sum % 3) {
    case 0: sum = sum + 1; break;
    case 1: sum = -sum;
    default: sum *= 2;
    }
    return sum + k;
}
