/* run: check */
#if SPEED > 3
#error too fast
#endif
#else
int f(int a) { return a; }
