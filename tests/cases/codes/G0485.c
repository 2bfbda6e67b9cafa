/* run: check */
int f(int a);
