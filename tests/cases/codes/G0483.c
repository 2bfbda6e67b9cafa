/* run: check */
#ifdef FAST
int f(int a) { return a; }
#endif
