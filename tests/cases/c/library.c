/* run: convert {} {out}/weigh.graf --keep calibrate */
double read_scale(int channel);
static double tare = 0.25;

double calibrate(double raw)
{
    return raw * 1.02 - tare;
}

/* The mean of several readings; -1 if one is out of range. */
double weigh(int channel, int n)
{
    double sum = 0, one;
    int i;

    for (i = 0; i < n; i++) {
        one = calibrate(read_scale(channel));
        if (one < 0)
            return -1;
        sum += one;
    }
    return sum / n;
}
