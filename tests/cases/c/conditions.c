/* run: convert {} - --to graf -D BLADES=3 */
/* Text that is there or not: constants of the file, those given, and names that nothing defines. */
#define MODE 2

#if MODE == 2 && BLADES > 2
static int scale(int speed) { return speed * BLADES; }
#elif MODE == 2
static int scale(int speed) { return speed; }
#else
#error "no such mode"
#endif

int fan(int speed)
{
#ifdef SAFE
    if (speed > 100) {
        return 0;
    }
#endif
#if TURBO
    speed = speed * 2;
#endif
    return scale(speed);
}
