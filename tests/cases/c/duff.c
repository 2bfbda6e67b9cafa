/* run: convert {} {out}/duff.graf */
/* T. Duff's device: a loop unrolled four times, entered in its middle. Returns the sum of what was copied. */
static char to[32];

int duff(const char from[32], int count)
{
    int i = 0, n, sum = 0;

    if (count < 1 || count > 32)
        return -1;
    n = (count + 3) / 4;
    switch (count % 4) {
    case 0: do {    to[i] = from[i]; i++;
    case 3:         to[i] = from[i]; i++;
    case 2:         to[i] = from[i]; i++;
    case 1:         to[i] = from[i]; i++;
            } while (--n > 0);
    }
    for (i = 0; i < count; i++)
        sum += to[i];
    return sum;
}
