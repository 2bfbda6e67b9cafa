/* run: check */
#include <stdio.h>
int f(int a) { return a + 1; }
