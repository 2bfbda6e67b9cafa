/* run: convert {} {out}/peak.graf --calls share */
extern volatile int level;      /* millimetres */
extern volatile _Bool alarm;

static int limited(int value, int most)
{
    return value > most ? most : value;
}

/* Waits for a level above the limit, then reports the highest of three readings. */
int peak(int limit)
{
    int i, highest = 0;

    while (level <= limit)
        ;
    for (i = 0; i < 3; i++) {
        int now = limited(level, 1000);
        if (now > highest)
            highest = now;
    }
    alarm = 1;
    return limited(highest, 500) + limited(limit, 10);
}
